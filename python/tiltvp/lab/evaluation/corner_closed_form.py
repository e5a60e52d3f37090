"""The closed form of corners on random poses: exact on exact rays, and as good as any estimate can be on noisy ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import polars as pl

from tiltvp.corner import attitudes, fit, solve_many
from tiltvp.synth import zed_cameras

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["BATCH", "exact_poses", "noisy_poses", "summarise_exact", "summarise_noisy"]

_GAMMA_RAD: Final = (np.deg2rad(17.0), np.deg2rad(160.0))
_FIRM_DEG: Final = 0.1
BATCH: Final = 20_000
"""Poses that are solved at a time."""


@dataclass(frozen=True)
class _Poses:
    """N corners before a camera at the origin."""

    camera_from_object: NDArray[np.float64]
    """(N, 3, 3)."""
    vertex_m: NDArray[np.float64]
    """(N, 3)."""
    gamma_rad: NDArray[np.float64]
    """(N,)."""

    @property
    def edges(self) -> NDArray[np.float64]:
        """(N, 3, 3): unit directions of the edges x, y, z in rows, camera frame."""
        ones, zeros = np.ones_like(self.gamma_rad), np.zeros_like(self.gamma_rad)
        x, y = np.stack([ones, zeros, zeros], 1), np.stack([zeros, ones, zeros], 1)
        z = np.stack([np.cos(self.gamma_rad), zeros, np.sin(self.gamma_rad)], 1)
        edges: NDArray[np.float64] = np.einsum("nij,nkj->nki", self.camera_from_object, np.stack([x, y, z], 1))
        return edges


def exact_poses(count: int = 100_000, *, seed: int = 0, advance: Callable[[], None] = lambda: None) -> pl.DataFrame:
    """One row for each of `count` random poses: attitudes and angles gamma (17 to 160 degrees) of any kind, rays exact.

    `error_rad` is the angle between the true attitude and the nearest of the `hypotheses`, `sensitivity` that of the
    nearest one, radians of attitude per radian of the rays. `advance` is called after each batch of 20,000.
    """
    rng = np.random.default_rng(seed)
    tables = []
    for start in range(0, count, BATCH):
        poses = _random_poses(rng, min(BATCH, count - start))
        points = poses.vertex_m[:, None, :] + 0.3 * poses.edges
        found = solve_many(poses.vertex_m, points[:, 0], points[:, 1], points[:, 2], poses.gamma_rad)
        errors = _angles(found.camera_from_object, poses.camera_from_object[found.corner])
        table = pl.DataFrame({"pose": found.corner, "error_rad": errors, "sensitivity": found.sensitivity})
        best = table.group_by("pose").agg(
            pl.col("error_rad").min(), pl.col("sensitivity").sort_by("error_rad").first(), pl.len().alias("hypotheses")
        )
        every = pl.DataFrame({"pose": np.arange(len(poses.gamma_rad)), "gamma_rad": poses.gamma_rad})
        tables.append(every.join(best, "pose", "left").with_columns(pl.col("pose") + start).sort("pose"))
        advance()
    return pl.concat(tables)


def summarise_exact(table: pl.DataFrame) -> pl.DataFrame:
    """How far the truth is from the nearest hypothesis, and where it is farthest."""
    error = pl.col("error_rad").fill_null(np.inf)
    return table.select(
        poses=pl.len(),
        hypotheses=pl.col("hypotheses").fill_null(0).mean(),
        without=pl.col("hypotheses").is_null().sum(),
        median_rad=error.median(),
        p999_rad=error.quantile(0.999),
        max_rad=error.max(),
        **{"above 1e-9": (error > 1e-9).sum()},
        sensitivity_at_max=pl.col("sensitivity").sort_by(error).last(),
    )


def noisy_poses(
    count: int = 2000,
    *,
    noise_px: float = 0.3,
    ray_px: int = 200,
    seed: int = 0,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """One row for each of `count` poses as of a hand-held camera before a box, of any gamma from 60 to 120 degrees.

    Each ray is `ray_px` pixels long and has a point in each of them, off by Gaussian noise of `noise_px` across.
    Columns: the squared error of the nearest hypothesis (`squared_rad2`), the Cramer-Rao bound of its expectation
    (`bound_rad2`, from the derivatives of the pixels' distances from their lines), the squared error weighted by the
    bound's information (`information_nees`) and by the covariance that the solver says (`nees`): both 3 on average at
    best. `advance` is called after each pose.
    """
    rng = np.random.default_rng(seed)
    camera, _ = zed_cameras()
    poses = _held_poses(rng, count)
    rows = []
    for k in range(count):
        truth, gamma = poses.camera_from_object[k], float(poses.gamma_rad[k])
        pixels, across = _rays(camera, poses.vertex_m[k], poses.edges[k], ray_px)
        information = _information(camera, truth, poses.vertex_m[k], gamma, pixels, across) / noise_px**2
        bound = np.linalg.inv(information)[:3, :3]
        noisy = [p + noise_px * rng.standard_normal((len(p), 1)) * n for p, n in zip(pixels, across, strict=True)]
        x, y, z = (camera.unproject(points) for points in noisy)
        found = attitudes(fit(x, y, z, sigma_rad=noise_px / 702.0), gamma)
        if found:
            best = min(found, key=lambda one: float(_angles(one.camera_from_object[None], truth[None])[0]))
            error = _rotation_vector(truth @ best.camera_from_object.T)
            rows.append({
                "pose": k,
                "gamma_rad": gamma,
                "squared_rad2": float(error @ error),
                "bound_rad2": float(np.trace(bound)),
                "information_nees": float(error @ np.linalg.solve(bound, error)),
                "nees": float(error @ np.linalg.solve(best.covariance_rad2, error)),
            })  # fmt: skip
        advance()
    return pl.DataFrame(rows).with_columns(poses=pl.lit(count))


def summarise_noisy(table: pl.DataFrame) -> pl.DataFrame:
    """Errors against the bound, 1 at best: of all poses by their information, and of the firm ones as they are.

    Firm are those with a bound below a tenth of a degree. Where two roots fall together the bound has no end, and
    errors, which have one, are far below it.
    """
    firm = pl.col("bound_rad2") < np.deg2rad(_FIRM_DEG) ** 2
    squared, bound = pl.col("squared_rad2").filter(firm).mean(), pl.col("bound_rad2").filter(firm).mean()
    return table.select(
        poses=pl.col("poses").first(),
        found=pl.len(),
        weighted_over_bound=(pl.col("information_nees").mean() / 3).sqrt(),
        nees_of_3=pl.col("nees").mean(),
        firm=firm.sum(),
        rms_deg=squared.sqrt().degrees(),
        bound_deg=bound.sqrt().degrees(),
        rms_over_bound=(squared / bound).sqrt(),
    )


def _random_poses(rng: np.random.Generator, count: int) -> _Poses:
    """Any attitude, any gamma, vertices up to 60 degrees off the axis, a metre away."""
    directions = np.stack([*rng.uniform(-1, 1, (2, count)) * np.tan(np.deg2rad(45.0)), np.ones(count)], axis=1)
    vertex = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return _Poses(_random_rotations(rng, count), vertex, rng.uniform(*_GAMMA_RAD, count))


def _held_poses(rng: np.random.Generator, count: int) -> _Poses:
    """Boxes seen from 1 to 3 metres away and 12 to 50 degrees above, at most half of what is left of gamma aside."""
    gamma = rng.uniform(np.deg2rad(60.0), np.deg2rad(120.0), count)
    slope, roll = rng.uniform(np.deg2rad(12.0), np.deg2rad(50.0), count), rng.uniform(-0.2, 0.2, count)
    aside = rng.uniform(-1, 1, count) * (0.5 * gamma - 0.17)
    # The edges x and z run to the back, gamma / 2 to the right and left of the line of sight.
    turn = _about("y", -(np.pi / 2 - 0.5 * gamma) + aside)
    camera_from_object = _about("z", roll) @ _about("x", slope) @ turn
    off = rng.uniform(-0.15, 0.15, (count, 2))
    distance = rng.uniform(1.0, 3.0, count)
    vertex = np.column_stack([off, np.ones(count)]) * distance[:, None]
    return _Poses(camera_from_object, vertex, gamma)


def _about(axis: str, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3, 3): rotations about one axis."""
    s, c, one, nil = np.sin(angles), np.cos(angles), np.ones_like(angles), np.zeros_like(angles)
    entries = {
        "x": [one, nil, nil, nil, c, -s, nil, s, c],
        "y": [c, nil, s, nil, one, nil, -s, nil, c],
        "z": [c, -s, nil, s, c, nil, nil, nil, one],
    }[axis]
    return np.stack(entries, axis=1).reshape(-1, 3, 3)


def _random_rotations(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """(N, 3, 3): uniform over all rotations."""
    q, r = np.linalg.qr(rng.standard_normal((count, 3, 3)))
    q = q * np.sign(np.einsum("nii->ni", r))[:, None, :]
    rotations: NDArray[np.float64] = q * np.sign(np.linalg.det(q))[:, None, None]
    return rotations


def _angles(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,): angles between rotations, exact for small ones: from the chord |A - B| = 2 sqrt(2) sin(angle / 2)."""
    chord = np.linalg.norm(a - b, axis=(1, 2)) / np.sqrt(8.0)
    angles: NDArray[np.float64] = 2.0 * np.arcsin(np.minimum(chord, 1.0))
    return angles


def _rotation_vector(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,): of a rotation by less than half a turn."""
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine = 0.5 * float(np.linalg.norm(skew))
    angle = float(np.arctan2(sine, 0.5 * (np.trace(rotation) - 1.0)))
    vector: NDArray[np.float64] = 0.5 * skew * (angle / sine if sine > 1e-12 else 1.0)
    return vector


def _rays(
    camera: Camera, vertex: NDArray[np.float64], edges: NDArray[np.float64], length_px: int
) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]]]:
    """Points one pixel apart along the image of each edge, and the unit normals of its curve there."""
    fine = np.linspace(0.0, 1.5, 6001)[:, None]
    points, normals = [], []
    for edge in edges:
        curve = camera.project(vertex + fine * edge)
        curve = curve[np.isfinite(curve).all(axis=1)]
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        places = np.arange(1.0, min(length_px, way[-1]))
        tangents = np.gradient(curve, axis=0)
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        at = [np.interp(places, way, column) for column in (*curve.T, *tangents.T)]
        points.append(np.column_stack(at[:2]))
        normals.append(np.column_stack([-at[3], at[2]]))
    return points, normals


def _information(
    camera: Camera,
    truth: NDArray[np.float64],
    vertex: NDArray[np.float64],
    gamma_rad: float,
    pixels: list[NDArray[np.float64]],
    across: list[NDArray[np.float64]],
) -> NDArray[np.float64]:
    """(5, 5): Fisher information, for noise of one pixel, of the attitude's rotation vector and the vertex's direction.

    A point's distance from its edge's image changes by -(m . b') with the plane's normal m, where b' is how the bearing
    changes along the normal of the curve.
    """
    bearing = vertex / np.linalg.norm(vertex)
    tangent = np.linalg.svd(bearing[None])[2][1:]
    local = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [np.cos(gamma_rad), 0.0, np.sin(gamma_rad)]])
    information = np.zeros((5, 5))
    for edge, points, normals in zip(local @ truth.T, pixels, across, strict=True):
        middle = camera.unproject(points)
        along = camera.unproject(points + 0.5 * normals) - camera.unproject(points - 0.5 * normals)
        normal = np.cross(bearing, edge)
        # d (m . b) by the rotation vector w (edge + w x edge) and by the vertex's direction.
        by_turn = np.cross(edge, np.cross(middle, bearing))
        by_place = np.cross(edge, middle) @ tangent.T
        rows = np.hstack([by_turn, by_place]) / (along @ normal)[:, None]
        information += rows.T @ rows
    return information

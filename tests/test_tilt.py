"""The tilt of single images: what every method answers on rendered rooms, and its edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tiltvp
from tiltvp.synth import RoomImage

LARGEST_ERROR_DEG = {
    "refined": 1.2,
    "image-space-ransac": 3.2,
    "image-space-reject-refit": 2.4,
    "vector-consensus": 4.2,
    "segments": 0.4,
}


def error_deg(estimate: tiltvp.TiltEstimate, room: RoomImage) -> float:
    truth = tiltvp.normal_from_alpha_beta(room.alpha_rad, room.beta_rad)
    return math.degrees(tiltvp.tilt_error_rad(estimate.normal, truth))


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_finds_the_lean_of_a_room(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimate = tiltvp.TiltEstimator(camera, method=method)(room.gray)
    assert estimate
    assert error_deg(estimate, room) < LARGEST_ERROR_DEG[method]
    assert np.linalg.norm(estimate.normal) == pytest.approx(1.0, abs=1e-12)
    assert estimate.normal == pytest.approx(tiltvp.normal_from_alpha_beta(estimate.alpha_rad, estimate.beta_rad))
    assert math.tan(estimate.roll_rad) == pytest.approx(estimate.normal[1] / estimate.normal[2])
    assert math.sin(estimate.pitch_rad) == pytest.approx(-estimate.normal[0])
    assert 0.0 < estimate.confidence <= 1.0
    assert estimate.edge_pixels > estimate.prefiltered_pixels >= estimate.inlier_pixels > 100
    assert np.array_equal(estimate.covariance_rad2, estimate.covariance_rad2.T)
    assert (np.linalg.eigvalsh(estimate.covariance_rad2) > 0.0).all()
    assert (estimate.shift_px is not None) == method.startswith("image-space")
    assert estimate.report.iterations > 0
    assert estimate.report.residual_rms > 0.0
    assert estimate.reason == estimate.report.reason


def test_the_default_is_the_first_method(camera: tiltvp.Camera) -> None:
    assert tiltvp.TiltEstimator(camera).method == tiltvp.METHODS[0] == "refined"


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_edges_belong_to_the_estimate(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    estimate, edges = estimator.with_edges(room.gray)
    assert estimate == estimator(room.gray)
    assert len(edges) == estimate.edge_pixels == len(edges.u) == len(edges.v)
    assert edges.prefiltered.sum() == estimate.prefiltered_pixels
    assert edges.inlier.sum() == estimate.inlier_pixels == edges.inlier_mask.sum()
    assert not (edges.inlier & ~edges.prefiltered).any()
    assert edges.inlier_mask.shape == room.gray.shape
    assert edges.inlier_mask[edges.v[edges.inlier], edges.u[edges.inlier]].all()
    assert ((edges.phi_rad >= 0.0) & (edges.phi_rad < math.pi)).all()
    reach = np.cos(edges.phi_rad) * (edges.u - 127.5) + np.sin(edges.phi_rad) * (edges.v - 127.5)
    assert edges.offset_px == pytest.approx(reach, abs=1e-3)
    assert edges == estimator.with_edges(room.gray)[1]


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_edges_tell_their_normals(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimate, edges = tiltvp.TiltEstimator(camera, method=method).with_edges(room.gray)
    normals = edges.normal
    assert normals.shape == (len(edges), 3)
    if method.startswith("image-space"):
        assert np.isnan(normals).all()
        return
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(edges)), abs=1e-6)
    bearings = camera.unproject(np.stack([edges.u, edges.v], axis=1).astype(float))
    # Straight edges pass between pixel centres, at most one and a half away.
    beside = 0.02 if method == "segments" else 5e-3
    assert np.einsum("ni,ni->n", normals, bearings) == pytest.approx(np.zeros(len(edges)), abs=beside)
    away = np.arcsin(np.abs(normals @ estimate.normal))
    # Inliers are within the threshold, of the random sample's direction where there is one.
    assert away[edges.inlier].max() < math.radians(4.1 if method == "refined" else 10.0)


def test_trimming_can_stop_early(camera: tiltvp.Camera, room: RoomImage) -> None:
    runs = [
        tiltvp.TiltEstimator(camera, method="image-space-reject-refit", max_iterations=most).with_edges(room.gray)
        for most in (0, 1, 2, 15)
    ]
    plain, edges = runs[0]
    assert plain.report.stop == "iteration-limit"
    assert (edges.inlier == edges.prefiltered).all()
    least_squares = np.linalg.lstsq(
        np.stack([np.cos(edges.phi_rad), np.sin(edges.phi_rad)], axis=1)[edges.prefiltered],
        edges.offset_px[edges.prefiltered],
    )[0]
    raw = tiltvp.TiltEstimator(camera, method="image-space-reject-refit", max_iterations=0, correction=None)
    assert raw(room.gray).shift_px == pytest.approx(np.hypot(*least_squares), rel=1e-4)
    kept = [run[1].inlier.sum() for run in runs]
    assert kept == sorted(kept, reverse=True)
    assert kept[0] > kept[1] > kept[2]


def test_too_few_edges_are_an_answer(camera: tiltvp.Camera) -> None:
    for method in tiltvp.METHODS:
        estimate, edges = tiltvp.TiltEstimator(camera, method=method).with_edges(np.zeros((256, 256), np.uint8))
        assert not estimate
        assert len(edges) == estimate.edge_pixels == estimate.inlier_pixels == 0
        assert estimate.confidence == 0.0
        assert np.isnan([estimate.alpha_rad, estimate.beta_rad, estimate.roll_rad, estimate.pitch_rad]).all()
        assert np.isnan(estimate.normal).all()
        assert np.isinf(np.diag(estimate.covariance_rad2)).all()
        assert estimate.report.stop == "too-few"
        assert "too few" in estimate.reason
        assert math.isnan(estimate.report.residual_rms)
        assert "no tilt" in repr(estimate)


def test_a_mirror_is_served_by_its_antipodal_vanishing_point(
    camera: tiltvp.Camera, room: RoomImage, upright_room: RoomImage
) -> None:
    """The same picture in a mirror that hangs above the camera: directions and band are upside down."""
    mirror = camera.mirrored()
    down = np.diag([1.0, -1.0, -1.0])
    for image in (room.gray, upright_room.gray):
        plain = tiltvp.TiltEstimator(camera)(image)
        band = {"elevation_min_rad": -math.pi / 4, "elevation_max_rad": 0.0}
        seen = tiltvp.TiltEstimator(mirror, **band)(image)
        assert seen.edge_pixels == plain.edge_pixels
        assert seen.normal == pytest.approx(plain.normal * [-1.0, -1.0, 1.0], abs=1e-6)
        turned = tiltvp.TiltEstimator(mirror, robot_from_camera=down)(image)
        assert turned.normal == pytest.approx(plain.normal * [1.0, -1.0, 1.0], abs=1e-6)

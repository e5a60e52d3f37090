"""Steps of the self-calibration filters against a dense NumPy filter of the same equations, in one process.

The peer is what one writes from the textbook with NumPy alone: the paper's state, dynamics, observation and Jacobians
(eqs. 28 to 31, appendix A.4), whole matrices F P F^T + G Q G^T, S, K. As a check, after ten steps it must be where
`method="paper"` is. Prints the time of a step over the last steps of a drive: median, mean, 99th percentile and worst
(of the default filter some steps relinearise its keyframes), the mean over the whole drive, and the ratio of the peer's
median and mean to ours. Run it with OPENBLAS_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tiltvp.selfcalib import SelfCalibrator
from tiltvp.synth import SimulatedDrive, simulate_drive

BASE_M, K_M, INFLATION, SIGMA_RAD = 0.4, 1e-5, 5.0, math.radians(0.5)
START_POLAR = np.array([-0.3, 0.22, 0.3])
START_POLAR_SIGMA = np.array([0.1, 0.03, 0.1])
DISTANCE_M, DISTANCE_SIGMA_M = 3.0, 2.0


def wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles in [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


class DenseFilter:
    """The paper's filter with dense matrices; all features are seen from the first step on."""

    def __init__(self, bearings: NDArray[np.float64]) -> None:
        n = len(bearings)
        phi, rho, psi = START_POLAR
        self.x = np.concatenate([np.zeros(2 * n), START_POLAR])
        x, y = rho * math.cos(phi), rho * math.sin(phi)
        cos, sin = np.cos(bearings + phi + psi), np.sin(bearings + phi + psi)
        along = x * cos + y * sin
        reach = -along + np.sqrt(along**2 - rho**2 + DISTANCE_M**2)
        self.x[0 : 2 * n : 2] = DISTANCE_M
        self.x[1 : 2 * n : 2] = np.arctan2(y + reach * sin, -(x + reach * cos))
        h = self.jacobian()
        own = h[:, 1 : 2 * n : 2].diagonal()
        # theta from (distance, bearing, mounting), by the observation equation.
        by = np.zeros((2 * n + 3, 2 * n + 3))
        noise = np.concatenate([np.zeros(2 * n), START_POLAR_SIGMA**2])
        by[-3:, -3:] = np.eye(3)
        for i in range(n):
            by[2 * i, 2 * i] = 1.0
            noise[2 * i], noise[2 * i + 1] = DISTANCE_SIGMA_M**2, SIGMA_RAD**2
            by[2 * i + 1, 2 * i] = -h[i, 2 * i] / own[i]
            by[2 * i + 1, 2 * i + 1] = 1.0 / own[i]
            by[2 * i + 1, -3:] = -h[i, -3:] / own[i]
        self.p = by @ np.diag(noise) @ by.T

    def expected(self) -> NDArray[np.float64]:
        """Eq. 30."""
        d, theta, (phi, rho, psi) = self.x[0:-3:2], self.x[1:-3:2], self.x[-3:]
        gamma = theta + phi
        return np.arctan2(-rho * np.sin(gamma), -d - rho * np.cos(gamma)) - gamma - psi

    def jacobian(self) -> NDArray[np.float64]:
        """(n, 2n + 3): appendix A.4."""
        d, theta, (phi, rho, _) = self.x[0:-3:2], self.x[1:-3:2], self.x[-3:]
        sin, cos = np.sin(theta + phi), np.cos(theta + phi)
        scale = 1.0 / (d**2 + 2.0 * rho * d * cos + rho**2)
        turn, rows = (-d * rho * cos - d**2) * scale, np.arange(len(d))
        h = np.zeros((len(d), 2 * len(d) + 3))
        h[rows, 2 * rows], h[rows, 2 * rows + 1] = -rho * sin * scale, turn
        h[:, -3], h[:, -2], h[:, -1] = turn, d * sin * scale, -1.0
        return h

    def step(self, left: float, right: float, bearings: NDArray[np.float64]) -> None:
        """Eqs. 29, 31, 32, then a joint update."""
        n, move, turn = len(bearings), 0.5 * (left + right), (right - left) / BASE_M
        d, theta = self.x[0:-3:2].copy(), self.x[1:-3:2].copy()
        sin, cos, even = np.sin(theta), np.cos(theta), 2 * np.arange(n)
        f, g = np.eye(2 * n + 3), np.zeros((2 * n + 3, 2))
        f[even, even + 1] = -move * sin
        f[even + 1, even] = move / d**2 * sin
        f[even + 1, even + 1] = 1.0 - move / d * cos
        g[even] = 0.5 * cos[:, None]
        g[even + 1, 0], g[even + 1, 1] = 1.0 / BASE_M - 0.5 * sin / d, -1.0 / BASE_M - 0.5 * sin / d
        self.x[0:-3:2] += move * cos
        self.x[1:-3:2] += turn - move / d * sin
        q = K_M * INFLATION * np.diag(np.abs([right, left]))
        p = f @ self.p @ f.T + g @ q @ g.T
        h = self.jacobian()
        s = h @ p @ h.T + SIGMA_RAD**2 * np.eye(n)
        gain = np.linalg.solve(s, h @ p).T
        self.x += gain @ wrapped(bearings - self.expected())
        p = p - gain @ h @ p
        self.p = 0.5 * (p + p.T)


def timed(steps: int, work: Callable[[int], object]) -> NDArray[np.float64]:
    """Seconds of each of so many steps."""
    seconds = []
    for k in range(steps):
        start = time.perf_counter()
        work(k)
        seconds.append(time.perf_counter() - start)
    return np.array(seconds)


def calibrator(method: str) -> SelfCalibrator:
    """Our filter, with the peer's start."""
    phi, rho, psi = START_POLAR
    s, c = math.sin(phi), math.cos(phi)
    by_polar = np.array([[-rho * s, c, 0.0], [rho * c, s, 0.0], [1.0, 0.0, 1.0]])
    return SelfCalibrator(
        wheel_base_m=BASE_M, bearing_sigma_rad=SIGMA_RAD, odometry_k_m=K_M, method=method,
        start=(rho * c, rho * s, phi + psi), start_sigma=by_polar @ np.diag(START_POLAR_SIGMA**2) @ by_polar.T,
    )  # fmt: skip


def check(odometry: NDArray[np.float64], seen: NDArray[np.float64]) -> None:
    """Exits unless the peer and `method="paper"` agree after ten steps; later, once it diverges, rounding decides."""
    peer, ours, names = DenseFilter(seen[0]), calibrator("paper"), np.arange(seen.shape[1])
    ours.step(*odometry[0], names, seen[0])
    for k in range(1, 10):
        peer.step(*odometry[k], seen[k])
        ours.step(*odometry[k], names, seen[k])
    e = ours.estimate
    off = np.abs(wrapped(peer.x[-3:] - (e.phi_rad, e.rho_m, e.psi_rad))).max()
    if not off < 1e-6:
        raise SystemExit(f"the peer and method='paper' are {off} apart: not the same filter")


def compare(drive: SimulatedDrive, landmarks: int, rounds: int) -> dict[str, NDArray[np.float64]]:
    """Of each filter by name the (N,) seconds of its steps, each the median of rounds in which all take turns."""
    odometry, names = drive.odometry, np.arange(landmarks)
    seen = drive.bearings[:, 2].reshape(len(odometry), landmarks)
    check(odometry, seen)
    found: dict[str, list[NDArray[np.float64]]] = {}
    for _ in range(rounds):
        peer = DenseFilter(seen[0])
        peer_steps = timed(len(odometry) - 1, lambda k, f=peer: f.step(*odometry[k + 1], seen[k + 1]))
        found.setdefault("dense NumPy", []).append(peer_steps)
        for method in ("paper", "default"):
            ours = calibrator(method)
            steps = timed(len(odometry), lambda k, f=ours: f.step(*odometry[k], names, seen[k]))
            found.setdefault(f"tiltvp {method}", []).append(steps)
    return {name: np.median(rows, axis=0) for name, rows in found.items()}


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=100, help="steps that are timed, the last of the drive")
    arguments = parser.parse_args()
    heads = ("median us", "mean us", "99 % us", "worst us", "all: mean", "peer / ours")
    print(f"{'features':>8}  {'filter':<16}" + "".join(f"{head:>13}" for head in heads))
    for landmarks in (10, 100):
        drive = simulate_drive("alternating", seed=1, landmarks=landmarks, wheel_base_m=BASE_M, odometry_k_m=K_M)
        found = compare(drive, landmarks, arguments.rounds)
        peer = next(iter(found.values()))[-arguments.steps :]
        for name, seconds in found.items():
            last = seconds[-arguments.steps :]
            numbers = (np.median(last), last.mean(), np.percentile(last, 99), last.max(), seconds.mean())
            ratios = f"{np.median(peer) / numbers[0]:.1f}, {peer.mean() / numbers[1]:.1f}"
            print(f"{landmarks:>8}  {name:<16}" + "".join(f"{1e6 * n:>13.1f}" for n in numbers) + f"{ratios:>13}")


if __name__ == "__main__":
    main()

"""The rendered sequences in which corners are looked for, and what is known beforehand in each."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from tiltvp.synth import Laboratory, Room, StereoSequence, zed_cameras

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["CORNER_SCENES", "CornerScene", "down_in", "fresh_rooms"]


@dataclass(frozen=True)
class CornerScene:
    """A sequence, and the methods that look at it."""

    name: str
    kind: str = "laboratory"
    """`laboratory` for the coloured cuboid, or one of `ROOM_KINDS`."""
    share: float = 1.0
    """Its frames, as a share of the experiment's."""
    width: int = 1280
    gamma_deg: float = 90.0
    """Angle between the cuboid's level edges."""
    marker_m: float = 0.0
    """Side of ArUco markers on the cuboid's coloured faces, which OpenCV looks for; 0 for none."""
    options: dict[str, Any] = field(default_factory=dict)
    """Of `StereoSequence`."""
    known: dict[str, Any] = field(default_factory=dict)
    """Options of `CornerPoseEstimator`, but not for the published method: what is known beforehand, beside gamma, and
    which way is down in a room."""

    @property
    def methods(self) -> tuple[str, ...]:
        """Those of `CornerDetector` for both cameras: ours, and before the cuboid the published one beside it."""
        return ("coloured", "paper") if self.kind == "laboratory" else ("general",)

    @property
    def angle(self) -> dict[str, Any]:
        """That between the level edges, as options of all methods have it."""
        return {"gamma_rad": math.radians(self.gamma_deg)}

    def sequence(self, frames: int, seed: int, threads: int | None) -> StereoSequence:
        """The sequence."""
        scene: Laboratory | Room
        if self.kind == "laboratory":
            gamma_rad = math.radians(self.gamma_deg)
            scene = Laboratory(seed, gamma_rad=gamma_rad, marker_m=self.marker_m, threads=threads)
        else:
            scene = Room(self.kind, seed, threads=threads)
        left, right = zed_cameras(self.width)
        return StereoSequence(scene, left=left, right=right, frames=frames, seed=seed, threads=threads, **self.options)


_OUTER: Final[dict[str, Any]] = {"right_handed": True}
"""The colours name the edges, and whose corner it is is known: an outer one."""

CORNER_SCENES: tuple[CornerScene, ...] = (
    CornerScene("cuboid", known=_OUTER),
    CornerScene("cuboid, inner or outer", share=0.1),
    CornerScene("cuboid, 1080p", share=0.1, width=1920, known=_OUTER),
    CornerScene("cuboid, shutter 8 ms", share=0.1, options={"exposure_s": 0.008, "blur_sigma_px": 1.0}, known=_OUTER),
    CornerScene("cuboid, gamma 70 deg", share=0.1, gamma_deg=70.0, known=_OUTER),
    CornerScene("cuboid, gamma 115 deg", share=0.1, gamma_deg=115.0, known=_OUTER),
    CornerScene("office", kind="office", share=0.1),
    CornerScene("living-room", kind="living-room", share=0.1),
    CornerScene("l-shaped", kind="l-shaped", share=0.1),
    CornerScene("cuboid with markers", share=0.1, marker_m=0.2, known=_OUTER),
)
"""The paper's cuboid: with and without a word on its side, in full HD, blurred, of other angles; corners of
rooms; and the cuboid with ArUco markers on it."""


def fresh_rooms(count: int) -> tuple[CornerScene, ...]:
    """So many rooms of each kind that `CORNER_SCENES` has, in turn, all with as many frames as the experiment."""
    kinds = [scene.kind for scene in CORNER_SCENES if scene.kind != "laboratory"]
    return tuple(CornerScene(f"{kind} {number}", kind=kind) for number in range(1, count + 1) for kind in kinds)


def down_in(sequence: StereoSequence) -> NDArray[np.float64]:
    """(3,): what tells upright edges from level ones: how the board is held, as its accelerometer has it on average."""
    down: NDArray[np.float64] = -sequence.imu(seed=sequence.seed).forces_m_s2.mean(axis=0)
    return down

"""Images made level one by one, and what that takes: the camera of each, its estimator, its leveller."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tiltvp.cli.cluster import Task, on_cluster
from tiltvp.cli.filtering import FilterOptions, Judge
from tiltvp.cli.option_words import typed
from tiltvp.cli.options import MethodOptions
from tiltvp.cli.results import Outcome, outcome_table
from tiltvp.cli.sources import ending_at_interrupt, picture_names
from tiltvp.cli.tables import Table
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import ImageFileError, InvalidInputError, OutputError, TiltvpError
from tiltvp.images import read_mask
from tiltvp.photos import BELIEVED_MIN

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera, FilteredTilt, Leveller, TiltEstimate, TiltEstimator
    from tiltvp.streams import Frame, Motion
    from tiltvp.streams.image_files import ImageFiles

_WIDTH_PX: Final = 1024
"""Columns of a panorama in which edges are looked for. At 2,048 those of 108 panoramas tell the tilt no better, in
three times the time (`tiltvp measure level`)."""
_JPEG: Final = (".jpg", ".jpeg")
TILTS: Final = "tilts"
"""Folder, in that of level images, for the table of a cluster."""


@dataclass(frozen=True)
class Look:
    """One camera: its estimator, of images of the size that its camera has, and its leveller."""

    estimator: TiltEstimator
    leveller: Leveller

    def estimate(self, image: NDArray[np.uint8]) -> TiltEstimate:
        """The tilt of an image of the leveller's camera."""
        from tiltvp.images import gray_from

        gray = gray_from(image)
        camera = self.estimator.camera
        if gray.shape != (camera.height, camera.width) and camera.model == "equirectangular":
            import cv2

            gray = gray_from(cv2.resize(gray, (camera.width, camera.height), interpolation=cv2.INTER_AREA))
        return self.estimator(gray)


@dataclass(frozen=True)
class Looks:
    """The look of each size of images; with a camera there is one."""

    camera: Camera | None
    method: MethodOptions
    keywords: dict[str, Any]
    """Of `tiltvp.Leveller`."""
    metadata_only: bool
    _made: dict[tuple[int, int], Look] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raises `InvalidInputError` for what cannot be together."""
        from tiltvp import Camera

        if self.metadata_only and (self.camera is not None or self.keywords["to"] != "same"):
            raise InvalidInputError("--metadata-only with --camera or --to, expected 360-degree photographs alone")
        if self.camera is not None:
            self.of(self.camera.width, self.camera.height)
        else:
            # What is wrong with all sizes is so with that in which edges are looked for, or with the mask's, and told
            # before any work is done.
            width = _WIDTH_PX if self.method.mask is None else read_mask(self.method.mask).shape[1]
            self._look(Camera.equirectangular(width=width, height=max(1, width // 2)), size=None)

    @property
    def are_panoramas(self) -> bool:
        """Whether level images are equirectangular."""
        is_source = self.camera is None or self.camera.model == "equirectangular"
        return self.keywords["to"] == "panorama" or (self.keywords["to"] == "same" and is_source)

    def of(self, width: int, height: int) -> Look:
        """That of images of a size. Raises `InvalidInputError` for one that is no panorama's, without a camera."""
        from tiltvp import Camera

        camera = self.camera
        if camera is None:
            if width != 2 * height:
                raise InvalidInputError(
                    f"{width} x {height} pixels and no --camera, expected twice as wide as high, a 360-degree panorama"
                )
            camera = Camera.equirectangular(width=width, height=height)
        if (width, height) not in self._made:
            self._made[width, height] = self._look(camera)
        return self._made[width, height]

    def _look(self, camera: Camera, **other: Any) -> Look:
        from tiltvp import Camera, Leveller
        from tiltvp.images import checked_mask
        from tiltvp.photos import PHOTO_TILT_MAX_RAD

        seen_by, method, otherwise = camera, self.method, dict[str, Any]()
        if camera.model == "equirectangular":
            width = min(camera.width, _WIDTH_PX)
            seen_by = Camera.equirectangular(width=width, height=width // 2)
            if method.method is None:
                otherwise |= {"method": "segments", "tilt_max_rad": PHOTO_TILT_MAX_RAD}
            if method.mask is not None:
                otherwise["mask"] = _shrunk(checked_mask(read_mask(method.mask), camera), seen_by)
                method = replace(method, mask=None)
        estimator = method.estimator(seen_by, **otherwise)
        return Look(estimator, Leveller(camera, estimator.robot_from_camera, **(self.keywords | other)))


def _shrunk(mask: NDArray[np.bool_], camera: Camera) -> NDArray[np.bool_]:
    """A mask for images of a camera of fewer pixels: True where all of a pixel shows the world."""
    import cv2
    import numpy as np

    size = (camera.width, camera.height)
    return np.asarray(cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.999)


@dataclass(frozen=True)
class Levelling:
    """What is done with all images, files or frames."""

    looks: Looks
    filtering: FilterOptions
    copies: bool
    """Whether those whose tilt is not believed are written as they are."""

    def look(self, image: NDArray[np.uint8]) -> Look:
        """That of an image."""
        return self.looks.of(image.shape[1], image.shape[0])

    def believed(self, outcome: Outcome) -> TiltEstimate | FilteredTilt | None:
        """The tilt that an image is made level by: what the filter holds to be true, else its own if it is sure."""
        if self.filtering.filter:
            return outcome.filtered or None
        least = BELIEVED_MIN if self.filtering.confidence_min is None else self.filtering.confidence_min
        estimate = outcome.estimate
        return estimate if estimate and estimate.confidence >= least else None

    def why_not(self, outcome: Outcome) -> str:
        """Why an image is not made level."""
        estimate = outcome.estimate
        if estimate is None:
            return str(outcome.error)
        if not estimate:
            return f"no tilt: {typed(estimate.reason)}"
        if outcome.filtered is not None:
            return f"no filtered tilt: {outcome.filtered.reason if outcome.accepted else outcome.verdict_reason}"
        return f"its tilt is not believed, confidence {estimate.confidence:.2f}"


def write_images(
    frames: ImageFiles, motions: Iterable[Motion | None], folder: Path, work: Levelling
) -> tuple[int, int]:
    """Writes level images into a folder, JPEG as JPEG, others as PNG; how many of how many were made level."""
    judge, levelled = work.filtering.judge(), 0
    with ending_at_interrupt(frames) as coming, progress_bar(len(frames.files), "images", told=frames.told) as bar:
        for frame, name, motion in zip(coming, picture_names(frames), motions, strict=False):
            _, problem = _level(frame, motion, folder / name, work, judge)
            if problem is None:
                levelled += 1
            else:
                bar.blame(Path(frame.name), problem)
            bar.advance()
    judge.plot()
    return levelled, len(frames.files)


def _level(
    frame: Frame, motion: Motion | None, path: Path, work: Levelling, judge: Judge
) -> tuple[Outcome, str | None]:
    """Makes one image level, and says what is wrong. Raises `OutputError`, which all images would have."""
    file = Path(frame.name)
    try:
        image, data = _read(frame, work)
        estimate = work.look(image).estimate(image)
    except TiltvpError as error:
        told = " ".join(str(error).split())
        return judge(Outcome(file, error=told, taken_s=frame.time_s), motion), told
    outcome = judge(Outcome(file, estimate, taken_s=frame.time_s), motion)
    return outcome, _write(outcome, image, data, path.with_name(f"{path.name}{_ending(file)}"), work)


@dataclass(frozen=True)
class LevelTask:
    """`write_images` as the task of a worker: the tilt of each image, whether it was made level, and why not."""

    work: Levelling
    folder: Path

    def __call__(self, images: Sequence[tuple[Frame, str]]) -> Table:
        judge = self.work.filtering.judge()
        done = [_level(frame, None, self.folder / name, self.work, judge) for frame, name in images]
        table = outcome_table([outcome for outcome, _ in done], "")
        # Panoramas have a method of their own, if none is asked for.
        types = {name: kind for name, kind in table.types.items() if name != "method"}
        types |= {"levelled": "Boolean", "problem": "String"}
        ends = ({"levelled": problem is None, "problem": problem} for _, problem in done)
        return Table(
            types, [{name: (row | end)[name] for name in types} for row, end in zip(table.rows, ends, strict=True)]
        )


def level_on_cluster(address: str, frames: ImageFiles, folder: Path, work: Levelling) -> tuple[int, int]:
    """The same as `write_images` by the workers of a scheduler, with a table in `folder`/tilts."""
    import polars as pl

    task = Task("level", LevelTask(work, folder.absolute()))
    _, table = on_cluster(address, frames, task, folder / TILTS)
    return table.select(pl.col("levelled").sum(), pl.len()).collect().row(0)


def _ending(file: Path) -> str:
    return file.suffix if file.suffix.lower() in _JPEG else ".png"


def _read(frame: Frame, work: Levelling) -> tuple[NDArray[np.uint8], bytes]:
    """An image and its file's bytes. Raises `ImageFileError` for what is no panorama where one is expected."""
    from tiltvp.images import image_bytes
    from tiltvp.photos import is_jpeg, panorama_kind

    file, image = Path(frame.name), frame.read()
    data = image_bytes(file)
    if work.looks.camera is None:
        kind = panorama_kind(data, image.shape[1], image.shape[0])
        if not kind.is_whole:
            raise ImageFileError(f"{file}: no 360-degree panorama ({kind.reason}), and there is no --camera")
    if work.looks.metadata_only and not is_jpeg(data):
        raise ImageFileError(f"{file}: no JPEG file, and --metadata-only is for them alone")
    return image, data


def _write(outcome: Outcome, image: NDArray[np.uint8], data: bytes, path: Path, work: Levelling) -> str | None:
    """Writes one image, and what is wrong: that it cannot be encoded, or that its tilt is not believed.

    Raises `OutputError`, which all images would have.
    """
    import numpy as np

    from tiltvp.files import write_whole
    from tiltvp.images import decode_as_stored, is_as_stored, write_image
    from tiltvp.photos import encode_like, is_jpeg, pose_deg, with_pose

    tilt = work.believed(outcome)
    # PNG holds 16 bits and opacity, where edges are looked for in 8 bits of what is there.
    stored = image if path.suffix != ".png" or is_jpeg(data) or is_as_stored(data) else decode_as_stored(data)
    try:
        if tilt is None:
            if work.copies and path.suffix == outcome.file.suffix:
                write_whole(path, data)
            elif work.copies:
                write_image(path, stored)
            return f"{work.why_not(outcome)}; {'copied as it is' if work.copies else 'left out'}"
        leveller = work.look(image).leveller
        if work.looks.metadata_only:
            pose = pose_deg(leveller.robot_from_camera, tilt.normal)
            write_whole(path, with_pose(data, *pose, image.shape[1], image.shape[0]))
            return None
        level = leveller(stored, tilt)
        if is_jpeg(data):
            looks = leveller.robot_from_output
            turned = not np.allclose(looks, leveller.robot_from_camera, atol=1e-6)
            shown = pose_deg(looks, np.array([0.0, 0.0, 1.0])) if work.looks.are_panoramas else None
            write_whole(path, encode_like(level, data, shown, turned=turned))
        else:
            write_image(path, level)
    except OutputError:
        raise
    except TiltvpError as error:
        return str(error)
    return None

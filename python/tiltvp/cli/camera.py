"""`tiltvp camera`: what calibration files say, whether their cameras keep their promises, and our own format."""

from __future__ import annotations

import math
import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tiltvp.cli.options import Switch, image_size_from, refuse_beside
from tiltvp.cli.root import group
from tiltvp.cli.terminal import complain, named, new_table, say, show
from tiltvp.errors import CalibrationError, InvalidInputError, TiltvpError, counted
from tiltvp.files import check_output

if TYPE_CHECKING:
    from rich.table import Table

    from tiltvp import Camera
    from tiltvp.formats import CameraSpec
    from tiltvp.streams import Recording

app = group("camera", "Calibration files: their cameras, whether these are sound, and other formats.")

LARGEST_ROUND_TRIP_PX = 1e-6
LARGEST_JACOBIAN_ERROR = 1e-6
_CHECK_COLUMNS = (
    "file", "camera", "model", "pixels", "lost", "round trip px", "round trip rad", "Jacobian error", "rim deg",
    "verdict",
)  # fmt: skip


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """What a calibration file is, where it does not tell itself."""

    format: Annotated[str | None, Parameter(name=("--format", "--camera-format"))] = None
    """The format of FILE, where its content does not tell."""
    image_size: str | None = None
    """WIDTHxHEIGHT in pixels, for formats that do not carry it."""

    def specs(self, file: Path) -> list[CameraSpec]:
        """The cameras of a file, those of a recording named by their topics."""
        from tiltvp.formats import read_cameras
        from tiltvp.streams import Recording, is_recording

        if is_recording(file):
            refuse_beside(self, ("format", "image_size"), f"{file}, a recording")
            return _recorded(Recording(file))
        return read_cameras(file, self.format, image_size_from(self.image_size))

    def one(self, file: Path, name: str | None) -> CameraSpec:
        """The camera of a file that has this name, or else this number, by default the first, 0."""
        from tiltvp.formats.spec import chosen_spec

        return chosen_spec(self.specs(file), name or 0, file)


_READING = FileOptions()


@app.command
def info(file: Path, /, reading: FileOptions = _READING, *, mirror: Switch = False) -> None:
    """Show model, size, parameters and field of view of every camera in a file.

    Parameters
    ----------
    file
        Calibration file.
    mirror
        The image is seen in a mirror.
    """
    for spec in reading.specs(file):
        show(_info_table(spec, built(file, spec, mirror)))


@app.command
def convert(
    file: Path,
    out: Path,
    /,
    reading: FileOptions = _READING,
    *,
    to: str | None = None,
    camera_name: str | None = None,
) -> None:
    """Write the cameras of a file as a file of another tool, or as tiltvp's own TOML.

    A lens that the other format cannot hold is refused, with the formats that can. Of a robot's file the camera alone
    is written, and a line on stderr says so; `tiltvp camera crop` and `scale` write the robot.

    Parameters
    ----------
    file
        Calibration file.
    out
        File to write, whole or not at all.
    to
        Its format: kalibr, opencv, colmap (binary if OUT ends in .bin), ros, basalt, ocamcalib, or tiltvp, which OUT
        that ends in .toml is without being asked.
    camera_name
        Name or number of the one camera to write, the first being 0; otherwise all are.
    """
    from tiltvp.formats import write_cameras

    if to is None and out.suffix.lower() != ".toml":
        raise InvalidInputError(f"{out}: ends in {out.suffix!r}, expected .toml, or --to with another format")
    if os.path.realpath(out) == os.path.realpath(file):
        raise InvalidInputError(f"{out}: is the file to be read, expected another name")
    check_output(out)
    specs = reading.specs(file) if camera_name is None else [reading.one(file, camera_name)]
    for spec in specs:
        built(file, spec)
    write_cameras(specs, out, to or "tiltvp")
    if left_out := _beside_camera(file):
        complain(f"{out}: the camera alone, {', '.join(left_out)} of {file} are not in it")
    for spec in specs:
        if spec.max_theta_rad is not None and to not in (None, "tiltvp"):
            limit = f"{math.degrees(spec.max_theta_rad):.2f} deg from the axis"
            complain(f"{out}: {spec.name}: the limit of {limit} is not in it, {to} has no word for that")
    say(f"{out}: {counted(len(specs), 'cameras')}, {', '.join(spec.model for spec in specs)}")


@app.command
def check(files: list[Path], /, reading: FileOptions = _READING) -> int:
    """Measure round trips and Jacobians of every camera, from the axis to the rim.

    The exit code is 1 if a pixel comes back more than 1e-6 pixels off or not at all, a Jacobian is more than 1e-6 off
    relative to its norm, or a file cannot be read.

    Parameters
    ----------
    files
        Calibration files.
    """
    table = new_table(None, _CHECK_COLUMNS, ("file", "camera", "model", "verdict"))
    sound = True
    for file in files:
        try:
            for spec in reading.specs(file):
                sound &= _check_row(table, file, spec, built(file, spec))
        except TiltvpError as error:
            complain(named(file, str(error)))
            sound = False
    show(table)
    return 0 if sound else 1


@app.command
def formats() -> None:
    """List the formats of calibration files that can be read, and which of them are written too."""
    from tiltvp.formats import FORMATS

    table = new_table(None, ("format", "written", "what it is"), ("format", "written", "what it is"))
    for one in FORMATS:
        words = " ".join((sys.modules[one.parse.__module__].__doc__ or "").split("\n\n")[0].split())
        family, _, kind = one.name.partition("-")
        is_variant = any(other.name == family for other in FORMATS) and kind
        what = f"The same as {family}, taken as a {kind} camera." if is_variant else words
        table.add_row(one.name, "yes" if one.written else "", what)
    show(table)


def _recorded(recording: Recording) -> list[CameraSpec]:
    """The camera of each topic of CameraInfo, of which there is one at least."""
    from tiltvp.streams.bag_setup import CAMERA_KINDS, recorded_camera

    topics = [one.name for one in recording.topics if one.kind in CAMERA_KINDS and one.count]
    if not topics:
        recording.choose(CAMERA_KINDS, "--camera-name")  # It says what there is.
    return [replace(recorded_camera(recording, name).to_spec(), name=name, format="ros") for name in topics]


def _beside_camera(file: Path) -> list[str]:
    """What a robot's file says beside its camera; nothing for other calibrations."""
    from tiltvp.formats.document import Document
    from tiltvp.formats.own import ROBOT_KEYS, root_of
    from tiltvp.robot import is_robot

    return [key for key in ROBOT_KEYS if is_robot(file) and root_of(Document.load(file)).has(key)]


def built(file: Path, spec: CameraSpec, mirror: bool = False) -> Camera:
    """The camera that a file describes so. Raises `CalibrationError` with the name of both."""
    from tiltvp import Camera

    try:
        camera = Camera.from_spec(spec)
    except CalibrationError as error:
        raise CalibrationError(f"{file}: {spec.name}: {error}") from error
    return camera.mirrored() if mirror and not camera.mirror else camera


def _info_table(spec: CameraSpec, camera: Camera) -> Table:
    from tiltvp.field_of_view import field_of_view, looks_like_a_mirror

    view = field_of_view(camera)
    table = new_table(spec.name, ("", "value"), ("", "value"))
    table.show_header = False

    def angle(value_rad: float) -> str:
        return f"{math.degrees(value_rad):.2f} deg"

    table.add_row("model", camera.model + (", seen in a mirror" if camera.mirror else ""))
    table.add_row("format", spec.format)
    table.add_row("image size", f"{camera.width} x {camera.height} px")
    for name, value in camera.parameters.items():
        numbers = value if isinstance(value, list) else [value]
        table.add_row(name, ", ".join(f"{number:.10g}" for number in numbers))
    table.add_row("horizontal view", angle(view.horizontal_rad))
    table.add_row("vertical view", angle(view.vertical_rad))
    table.add_row("diagonal view", angle(view.diagonal_rad))
    table.add_row("largest theta", f"{angle(camera.max_theta_rad)} from the axis")
    table.add_row("axis", f"u {view.axis_px[0]:.3f}, v {view.axis_px[1]:.3f} px")
    table.add_row("valid radius", f"{view.valid_radius_px:.1f} px around the axis")
    table.add_row("valid pixels", f"{100.0 * view.valid_share:.1f} % of the image")
    for note in spec.notes:
        table.add_row("note", note)
    if looks_like_a_mirror(camera, view):
        around = angle(min(view.horizontal_rad, view.vertical_rad))
        table.add_row(
            "note", f"sees {around} all round, as mirrors do: give --mirror if it looks into one, images do not tell"
        )
    return table


def _check_row(table: Table, file: Path, spec: CameraSpec, camera: Camera) -> bool:
    """Adds a row; whether the camera is sound."""
    found = camera.conformance()
    problems = []
    if found["pixels_lost"]:
        problems.append("pixels without a way back")
    if not found["max_round_trip_px"] <= LARGEST_ROUND_TRIP_PX:
        problems.append(f"round trip above {LARGEST_ROUND_TRIP_PX:g} px")
    if not found["max_jacobian_error_relative"] <= LARGEST_JACOBIAN_ERROR:
        problems.append(f"Jacobian error above {LARGEST_JACOBIAN_ERROR:g}")
    table.add_row(
        str(file),
        spec.name,
        camera.model,
        str(found["pixels_tested"]),
        str(found["pixels_lost"]),
        f"{found['max_round_trip_px']:.1e}",
        f"{found['max_round_trip_rad']:.1e}",
        f"{found['max_jacobian_error_relative']:.1e}",
        f"{math.degrees(found['rim_theta_rad']):.2f}",
        ", ".join(problems) or "sound",
        style="red" if problems else None,
    )
    return not problems

"""Datasets as folders: what is read, what is found wrong and where, what the wheels say, and what is made."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from tiltvp import tilt_from_wheel_heights
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.check import check_dataset
from tiltvp.lab.datasets.degrading import HARDSHIPS, degrade_dataset, degrade_image
from tiltvp.lab.datasets.folder import read_dataset
from tiltvp.lab.datasets.new import new_dataset
from tiltvp.lab.datasets.rendering import find_panoramas, render_panoramas, render_rooms

PAPER_WHEELS = {"half_track_m": 0.1545, "caster_behind_m": 0.1394}
"""To a tenth of a millimetre the only lengths that give every angle of table 1 as printed."""

ANGLES = "file,location,environment,alpha_deg,beta_deg"
HEIGHTS = "file,location,environment,left_mm,right_mm,caster_mm"


@pytest.fixture(scope="module")
def small() -> tiltvp.Camera:
    return tiltvp.Camera.equidistant(width=64, height=48, focal_px=15.0, cx=31.5, cy=23.5, max_theta_rad=1.6)


@pytest.fixture
def folder(tmp_path: Path, small: tiltvp.Camera) -> Path:
    """A sound dataset of four images at two locations."""
    small.save(tmp_path / "cam.toml")
    for k in range(4):
        tiltvp.write_image(tmp_path / f"{k}.png", np.full((48, 64), 40 * k, dtype=np.uint8))
    write(
        tmp_path, 'camera = "cam.toml"', [ANGLES, "0.png,a,x,0,0", "1.png,a,x,2,90", "2.png,b,x,0,0", "3.png,b,x,2,0"]
    )
    return tmp_path


def write(folder: Path, description: str | None, rows: list[str] | None) -> None:
    if description is not None:
        (folder / "dataset.toml").write_text(description + "\n")
    if rows is not None:
        (folder / "images.csv").write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize(
    ("height_mm", "main_deg", "caster_deg"),
    [(5.0, 1.38, 2.06), (10.1, 2.80, 4.15), (4.4, 1.22, 1.81), (7.4, 2.05, 3.04), (5.3, 1.47, 2.18)],
)
def test_table_1(height_mm: float, main_deg: float, caster_deg: float) -> None:
    h = 1e-3 * height_mm
    alpha, beta = tilt_from_wheel_heights(left_m=0.0, right_m=0.0, caster_m=h, **PAPER_WHEELS)
    assert round(math.degrees(alpha), 2) == caster_deg
    assert beta == 0.0
    for left, right, sign in ((h, 0.0, -1.0), (0.0, h, 1.0)):
        alpha, beta = tilt_from_wheel_heights(left_m=left, right_m=right, caster_m=0.0, **PAPER_WHEELS)
        assert round(math.degrees(alpha), 2) == main_deg
        # 137.9 degrees; the paper prints the whole ones.
        assert math.floor(sign * math.degrees(beta)) == 137


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"caster_m": 0.15}, "heights that wheels 0.309 m apart"),
        ({"left_m": math.nan}, "finite heights"),
        ({"half_track_m": 0.0}, "half_track_m = 0"),
        ({"caster_behind_m": -1.0}, "caster_behind_m = -1"),
    ],
)
def test_impossible_wheels(wrong: dict[str, float], words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        tilt_from_wheel_heights(**{"left_m": 0.0, "right_m": 0.0, "caster_m": 0.0, **PAPER_WHEELS, **wrong})


def test_reading(folder: Path, small: tiltvp.Camera) -> None:
    dataset = read_dataset(folder)
    assert dataset.camera == small
    assert np.array_equal(dataset.robot_from_camera, np.eye(3))
    assert (dataset.mask, dataset.wheels, dataset.source) == (None, None, {})
    image = dataset.images[1]
    assert (image.file, image.path, image.location, image.environment) == ("1.png", folder / "1.png", "a", "x")
    assert (image.alpha_rad, image.beta_rad, image.yaw_rad) == (math.radians(2.0), math.radians(90.0), 0.0)
    gray = dataset.read(image)
    assert gray.shape == (48, 64)
    assert (gray == 40).all()
    assert check_dataset(folder) == []


def test_reading_everything(folder: Path) -> None:
    mask = np.zeros((48, 64), dtype=np.uint8)
    mask[:20] = 255
    tiltvp.write_image(folder / "mask.png", mask)
    write(
        folder,
        """
        camera = "cam.toml"
        camera_name = "cam0"
        mirror = true
        mask = "mask.png"
        robot_from_camera = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
        wheels = { half_track_m = 0.1545, caster_m = 0.1394 }
        source = { robot = "vacuum", year = 2017 }
        """,
        ["\ufeff" + HEIGHTS + ",yaw_deg", "0.png,a,x,0,0,0,10", "1.png, a ,x,0,0,10.1,-10", "", "2.png,b,y,3,8,3,0"],
    )
    dataset = read_dataset(folder)
    assert dataset.camera.mirror
    assert dataset.mask is not None
    assert dataset.mask.sum() == 20 * 64
    assert np.array_equal(dataset.robot_from_camera, [[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    assert dataset.source["robot"] == "vacuum"
    degrees = [(round(math.degrees(i.alpha_rad), 2), int(math.degrees(i.beta_rad))) for i in dataset.images]
    assert degrees == [(0.0, 0), (4.15, 0), (1.38, 137)]
    assert [round(math.degrees(image.yaw_rad)) for image in dataset.images] == [10, -10, 0]
    assert check_dataset(folder) == []


def test_a_robots_file_brings_its_mounting_and_its_mask(folder: Path, small: tiltvp.Camera) -> None:
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    mask = np.arange(48 * 64).reshape(48, 64) < 1000
    tiltvp.Robot(small, turned, mask=mask).save(folder / "robot.toml")
    write(folder, 'camera = "robot.toml"', None)
    dataset = read_dataset(folder)
    assert np.array_equal(dataset.robot_from_camera, turned)
    assert np.array_equal(dataset.mask, mask)
    digest = dataset.digest()
    tiltvp.write_image(folder / "robot-mask.png", np.full((48, 64), 255, dtype=np.uint8))
    assert read_dataset(folder).digest() != digest
    write(folder, 'camera = "robot.toml"\nrobot_from_camera = "up"', None)
    assert np.array_equal(read_dataset(folder).robot_from_camera, np.eye(3))
    (folder / "robot-mask.png").unlink()
    assert "robot-mask.png" in str(check_dataset(folder)[0])


def test_digest(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    first = read_dataset(folder).digest()
    copy = tmp_path_factory.mktemp("copy") / "of"
    shutil.copytree(folder, copy)
    assert read_dataset(copy).digest() == first
    for name in ("0.png", "cam.toml", "dataset.toml", "images.csv"):
        content = (copy / name).read_bytes()
        (copy / name).write_bytes(content + b"\n")
        assert read_dataset(copy).digest() != first, name
        (copy / name).write_bytes(content)
    (copy / "0.png").unlink()
    with pytest.raises(InvalidInputError, match=r"line 2: no file '0\.png'"):
        read_dataset(copy)


CAMERA = 'camera = "cam.toml"\n'
WRONG: list[tuple[str, str | None, list[str] | None, list[tuple[int | None, str]]]] = [
    ("no camera", "", None, [(None, "no key camera")]),
    ("no such camera", 'camera = "c.yaml"', None, [(None, "camera 'c.yaml': no such file")]),
    ("no calibration", 'camera = "images.csv"', None, [(None, "camera 'images.csv': ")]),
    ("no TOML", "camera = ", None, [(None, "is not TOML")]),
    ("unknown keys", CAMERA + "wheel = 1\nmirrored = true", None, [(None, "wheels?"), (None, "mirror?")]),
    ("wrong types", 'camera = 1\nmirror = "yes"', None, [(None, "camera = 1"), (None, "mirror ="), (None, "no key")]),
    ("a reflection", CAMERA + "robot_from_camera = [[1,0,0],[0,1,0],[0,0,-1]]", None, [(None, "a reflection")]),
    ("no rotation", CAMERA + "robot_from_camera = [[1,0,0],[0,1,0],[0,0,0]]", None, [(None, "no rotation")]),
    ("no matrix", CAMERA + "robot_from_camera = [1, 2]", None, [(None, "robot_from_camera: shape (2,)")]),
    ("no word", CAMERA + 'robot_from_camera = "down"', None, [(None, "robot_from_camera: 'down'")]),
    ("no mask", CAMERA + 'mask = "m.png"', None, [(None, "No such file")]),
    (
        "wheels",
        CAMERA + "wheels = { half_track = 1, caster_m = -1 }",
        None,
        [(None, "half_track_m?"), (None, "no key wheels.half_track_m"), (None, "wheels.caster_m = -1")],
    ),
    ("empty", None, [""], [(None, "is empty")]),
    ("no rows", None, [ANGLES], [(None, "no rows")]),
    (
        "unknown column",
        None,
        [ANGLES + ",alfa_deg", "0.png,a,x,0,0,1"],
        [(1, "unknown column 'alfa_deg' (did you mean")],
    ),
    ("no location", None, ["file,environment,alpha_deg,beta_deg", "0.png,x,0,0"], [(1, "no column location")]),
    ("both forms", None, [ANGLES + ",left_mm", "0.png,a,x,0,0,1"], [(1, "the columns alpha_deg, beta_deg, left_mm")]),
    ("neither form", None, ["file,location,environment", "0.png,a,x"], [(1, "no columns of the true lean")]),
    ("half a form", None, ["file,location,environment,alpha_deg", "0.png,a,x,0"], [(1, "no column beta_deg")]),
    ("a column twice", None, [ANGLES + ",file", "0.png,a,x,0,0,0.png"], [(1, "the column file twice")]),
    ("no wheels", None, [HEIGHTS, "0.png,a,x,0,0,0"], [(1, "wheel heights without the wheels")]),
    (
        "impossible heights",
        CAMERA + "wheels = { half_track_m = 0.15, caster_m = 0.14 }",
        [HEIGHTS, "0.png,a,x,0,0,0", "1.png,b,x,0,0,200", "2.png,b,x,0,nan,0"],
        [(3, "0.2"), (4, "right_mm = 'nan'")],
    ),
    (
        "rows",
        None,
        [ANGLES, "0.png,a,x,0,0", "9.png,b,x,0,0", "0.png,b,y,0,0", "1.png,,x,91,0", "2.png,b,x,inf,z", "3.png,b"],
        [
            (3, "no file '9.png'"),
            (4, "file '0.png' is in line 2 too"),
            (4, "location 'b' is in 'y', in line 3 in 'x'"),
            (5, "location is empty"),
            (5, "alpha_deg = 91"),
            (6, "alpha_deg = 'inf'"),
            (6, "beta_deg = 'z'"),
            (7, "2 cells"),
        ],
    ),
    ("outside", None, [ANGLES, "../0.png,a,x,0,0", "1.png,b,x,0,1"], [(2, "file '../0.png'")]),
    ("negative", None, [ANGLES, "0.png,a,x,-2,0", "1.png,b,x,2,1"], [(2, "alpha_deg = -2")]),
]


@pytest.mark.parametrize(("description", "rows", "expected"), [case[1:] for case in WRONG], ids=[w[0] for w in WRONG])
def test_findings(
    folder: Path, description: str | None, rows: list[str] | None, expected: list[tuple[int | None, str]]
) -> None:
    write(folder, description, rows)
    errors = [finding for finding in check_dataset(folder) if finding.severity == "error"]
    assert len(errors) == len(expected), errors
    for finding, (line, words) in zip(errors, expected, strict=True):
        assert finding.line == line
        assert words in f"{finding.what}, {finding.expected}"
        assert finding.what
        assert finding.expected
        assert str(folder) in finding.file
    with pytest.raises(InvalidInputError) as caught:
        read_dataset(folder)
    assert str(caught.value).startswith(str(errors[0]))
    assert (f"{len(errors) - 1} more" in str(caught.value)) == (len(errors) > 1)


def test_findings_in_images(folder: Path) -> None:
    (folder / "0.png").write_bytes(b"no image")
    tiltvp.write_image(folder / "3.png", np.zeros((64, 48), dtype=np.uint8))
    tiltvp.write_image(folder / "mask.png", np.zeros((10, 10), dtype=np.uint8))
    write(folder, CAMERA + 'mask = "mask.png"', None)
    findings = check_dataset(folder)
    assert [Path(finding.file).name for finding in findings] == ["mask.png", "0.png", "3.png"]
    assert "10 x 10" in findings[0].what
    assert "not an image" in findings[1].what
    assert "48 x 64 pixels" in findings[2].what
    write(folder, CAMERA, None)
    with pytest.raises(InvalidInputError, match=r"3\.png: 48 x 64 pixels, expected 64 x 48"):
        read_dataset(folder).read(read_dataset(folder).images[3])


def test_warnings(folder: Path) -> None:
    write(folder, None, [ANGLES, "0.png,a,x,0,0", "1.png,a,x,0,0"])
    findings = check_dataset(folder)
    assert [finding.severity for finding in findings] == ["warning", "warning"]
    assert len(read_dataset(folder).images) == 2


def test_no_dataset(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="is no folder"):
        read_dataset(tmp_path / "nothing")
    assert {Path(finding.file).name for finding in check_dataset(tmp_path)} == {"dataset.toml", "images.csv"}


@pytest.fixture(scope="module")
def panoramas(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("house")
    for k in range(3):
        noise = np.random.default_rng(k).integers(0, 256, (16, 32), dtype=np.uint8)
        tiltvp.write_image(folder / f"p{k}.png", cv2.resize(noise, (256, 128), interpolation=cv2.INTER_CUBIC))
    return folder


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def test_rendered_panoramas(panoramas: Path, small: tiltvp.Camera, tmp_path: Path) -> None:
    mounting = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]

    def render(name: str, threads: int, limit: int | None = None, **keywords: object) -> Path:
        render_panoramas(
            find_panoramas(panoramas, limit), small, tmp_path / name, tilts_deg=[(0, 0), (3, -100)], turn=True,
            robot_from_camera=mounting, threads=threads, **keywords,  # type: ignore[arg-type]
        )  # fmt: skip
        return tmp_path / name

    one = render("one", 1)
    assert check_dataset(one) == []
    dataset = read_dataset(one)
    assert dataset.camera == small
    assert np.array_equal(dataset.robot_from_camera, mounting)
    assert [image.location for image in dataset.images] == ["p0", "p0", "p1", "p1", "p2", "p2"]
    assert {image.environment for image in dataset.images} == {panoramas.name}
    assert len({image.yaw_rad for image in dataset.images}) == 6
    assert math.degrees(dataset.images[3].beta_rad) == pytest.approx(-100.0)
    assert bytes_of(render("four", 4)) == bytes_of(one)
    part = render("part", 2, limit=2)
    assert (part / "images" / "p1_01.png").read_bytes() == (one / "images" / "p1_01.png").read_bytes()
    assert [image.location for image in read_dataset(part).images] == ["p0", "p0", "p1", "p1"]
    other = render("other", 2, seed=1)
    assert bytes_of(other)["images/p1_01.png"] != bytes_of(one)["images/p1_01.png"]
    with pytest.raises(InvalidInputError, match="exists"):
        render("one", 1)
    before = bytes_of(one)
    render("one", 1, force=True, noise_sigma=0.0)
    assert bytes_of(one) != before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["four", "one", "other", "part"]


@pytest.mark.slow
def test_rendered_rooms(small: tiltvp.Camera, tmp_path: Path) -> None:
    def render(name: str, **keywords: object) -> dict[str, bytes]:
        options = {"kinds": ["narrow", "under-table"], "rooms": 2, "locations_per_room": 2, "samples": 1} | keywords
        render_rooms(small, tmp_path / name, tilts_deg=[(2, 30)], **options)  # type: ignore[arg-type]
        return bytes_of(tmp_path / name)

    one = render("one", threads=1)
    assert check_dataset(tmp_path / "one") == []
    images = read_dataset(tmp_path / "one").images
    assert [image.location for image in images] == [
        "narrow-000-00", "narrow-000-01", "under-table-001-00", "under-table-001-01",
    ]  # fmt: skip
    assert {image.environment for image in images} == {"narrow", "under-table"}
    assert render("two", threads=3) == one


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"tilts_deg": []}, "no tilts"),
        ({"tilts_deg": [(91.0, 0.0)]}, "tilt 91"),
        ({"noise_sigma": math.nan}, "noise_sigma"),
        ({"seed": -1}, "seed = -1"),
        ({"samples": 0}, "samples = 0"),
        ({"threads": 0}, "threads = 0"),
        ({"robot_from_camera": np.eye(2)}, "robot_from_camera"),
    ],
)
@pytest.mark.parametrize("what", ["panoramas", "rooms"])
def test_wrong_making(
    panoramas: Path, small: tiltvp.Camera, tmp_path: Path, what: str, keywords: dict[str, object], words: str
) -> None:
    make: Callable[..., None] = (
        (lambda *given, **named: render_panoramas(find_panoramas(panoramas), *given, **named))
        if what == "panoramas"
        else (lambda *given, **named: render_rooms(*given, kinds=["narrow"], rooms=1, **named))
    )
    with pytest.raises(InvalidInputError, match=words):
        make(small, tmp_path / "out", **keywords)
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_left_of_a_failure(small: tiltvp.Camera, tmp_path: Path) -> None:
    def fail(directory: Path) -> None:
        with new_dataset(directory, small) as new:
            new.write("a", np.zeros((48, 64), np.uint8), location="a", environment="x", alpha_rad=0.0, beta_rad=0.0)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail(tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    with pytest.raises(InvalidInputError, match="is no dataset"), new_dataset(tmp_path / "mine", small, force=True):
        pass
    assert (tmp_path / "mine" / "thesis.txt").exists()


def test_no_panoramas(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="no images"):
        find_panoramas(tmp_path)
    with pytest.raises(InvalidInputError, match="is no folder"):
        find_panoramas(tmp_path / "nothing")
    (tmp_path / "a.png").write_bytes(b"")
    with pytest.raises(InvalidInputError, match="limit = 0"):
        find_panoramas(tmp_path, 0)


@pytest.mark.slow
def test_a_degraded_dataset_is_harder_and_its_truth_the_same(tmp_path: Path) -> None:
    camera = tiltvp.Camera.equidistant(width=96, height=72, focal_px=21.0, cx=47.5, cy=35.5, max_theta_rad=1.6)
    render_rooms(camera, tmp_path / "plain", kinds=["office"], rooms=1, locations_per_room=2, samples=1, seed=4)
    dataset = read_dataset(tmp_path / "plain")
    for threads in (1, 2):
        degrade_dataset(dataset, tmp_path / f"hard{threads}", seed=3, threads=threads)
    hard = read_dataset(tmp_path / "hard1")
    assert hard.digest() == read_dataset(tmp_path / "hard2").digest()
    truth = [(image.location, image.environment, image.alpha_rad, image.beta_rad) for image in dataset.images]
    assert [(image.location, image.environment, image.alpha_rad, image.beta_rad) for image in hard.images] == truth
    assert {image.file.split("_")[-1] for image in hard.images} <= {f"{hardship}.png" for hardship in HARDSHIPS}
    before, after = (np.stack([each.read(image) for image in each.images]).astype(float) for each in (dataset, hard))
    gradients = [np.abs(np.diff(cv2.GaussianBlur(i, (0, 0), 2.0), axis=1)).mean() for i in (*before, *after)]
    assert np.mean(gradients[len(before) :]) < 0.7 * np.mean(gradients[: len(before)])
    with pytest.raises(InvalidInputError, match="hardship = 'wet', expected one of hidden, blurred, dark"):
        degrade_image(np.zeros((72, 96), dtype=np.uint8), "wet", camera, np.random.default_rng(0))

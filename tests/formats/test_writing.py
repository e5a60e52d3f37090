"""Calibration files of other tools as we write them: what our readers, OpenCV and COLMAP make of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pycolmap
import pytest
import yaml

import tiltvp
from calibration_texts import AFFINE, KB, OCAM, RADTAN
from tiltvp.errors import CalibrationError, OutputError, UnsupportedFormatError
from tiltvp.formats import FORMATS, CameraSpec, read_cameras, write_cameras

FULL = {**RADTAN, "k3": 5e-3, "k4": 0.01, "k5": -0.02, "k6": 1e-3}
LENSES: dict[str, CameraSpec] = {
    name: CameraSpec(model, 640, 480, dict(parameters), name="cam3")
    for name, (model, parameters) in {
        "plain": ("pinhole", AFFINE),
        "radtan": ("pinhole", AFFINE | RADTAN),
        "k3": ("pinhole", AFFINE | RADTAN | {"k3": 5e-3}),
        "rational": ("pinhole", AFFINE | FULL),
        "fisheye": ("kannala_brandt", AFFINE | KB),
        "equidistant": ("equidistant", {"focal_px": 139.7, "cx": 319.5, "cy": 239.5}),
        "unified": ("unified", AFFINE | {"xi": 1.375}),
        "mei": ("unified", AFFINE | RADTAN | {"xi": 1.375}),
        "mei skew": ("unified", AFFINE | RADTAN | {"xi": 1.375, "skew": 0.125}),
        "mei k3": ("unified", AFFINE | RADTAN | {"xi": 1.375, "k3": 0.01}),
        "double sphere": ("double_sphere", AFFINE | {"xi": -0.25, "alpha": 0.5}),
        "extended": ("extended_unified", AFFINE | {"alpha": 0.5, "beta": 1.125}),
        "ocam": ("ocam", OCAM),
        "panorama": ("equirectangular", {}),
    }.items()
}
HELD: dict[str, set[str]] = {
    "kalibr": {"plain", "radtan", "fisheye", "equidistant", "unified", "mei", "double sphere", "extended"},
    "opencv": {"plain", "radtan", "k3", "rational", "fisheye", "equidistant", "unified", "mei", "mei skew"},
    "colmap": {"plain", "radtan", "k3", "rational", "fisheye", "equidistant", "extended", "panorama"},
    "ros": {"plain", "radtan", "k3", "rational", "fisheye", "equidistant"},
    "basalt": {"plain", "fisheye", "equidistant", "unified", "double sphere", "extended"},
    "ocamcalib": {"ocam"},
    "tiltvp": set(LENSES),
}
PAIRS = [(tool, lens) for tool, held in HELD.items() for lens in sorted(held)]
ENDINGS = {
    "kalibr": ".yaml",
    "opencv": ".yml",
    "colmap": ".txt",
    "ros": ".yaml",
    "basalt": ".json",
    "ocamcalib": ".txt",
}


def written(folder: Path, tool: str, *specs: CameraSpec, ending: str | None = None) -> Path:
    path = folder / f"cameras{ending or ENDINGS.get(tool, '.toml')}"
    write_cameras(specs, path, tool)
    return path


def bearings_before(camera: tiltvp.Camera) -> np.ndarray:
    """Bearings that the lens sees, from pixels all over its image."""
    u, v = np.meshgrid(np.linspace(0.0, camera.width - 1.0, 9), np.linspace(0.0, camera.height - 1.0, 7))
    bearings = camera.unproject(np.stack([u.ravel(), v.ravel()], axis=1))
    seen = bearings[np.isfinite(bearings).all(axis=1)]
    assert len(seen) > 15
    return seen


def seen_by_colmap(camera: pycolmap.Camera, bearings: np.ndarray) -> np.ndarray:
    """COLMAP's lenses, but for its panoramas, end 90 degrees from the axis."""
    return bearings if camera.model_name == "EQUIRECTANGULAR" else bearings[bearings[:, 2] > 0.1]


def test_the_table_of_formats_says_what_is_written() -> None:
    assert {one.name for one in FORMATS if one.written} == set(HELD)


@pytest.mark.parametrize(("tool", "lens"), PAIRS)
def test_our_reader_gives_the_same_camera_back(tool: str, lens: str, tmp_path: Path) -> None:
    before = tiltvp.Camera.from_spec(LENSES[lens])
    path = written(tmp_path, tool, LENSES[lens])
    spec = read_cameras(path)[0]
    assert spec.format == tool
    after = tiltvp.Camera.from_spec(spec)
    bearings = bearings_before(before)
    assert np.abs(after.project(bearings) - before.project(bearings)).max() < 1e-9
    if lens != "equidistant" and (tool, lens) != ("basalt", "unified"):
        # The same numbers, apart from the half pixel that COLMAP adds and we take off again.
        for key, value in before.parameters.items():
            assert np.allclose(after.parameters[key], value, rtol=0.0, atol=1e-12 if tool == "colmap" else 0.0), key


@pytest.mark.parametrize("tool", sorted(HELD))
def test_what_cannot_be_held_is_refused_with_what_can(tool: str, tmp_path: Path) -> None:
    for lens in sorted(set(LENSES) - HELD[tool]):
        path = tmp_path / "camera.any"
        with pytest.raises(UnsupportedFormatError) as refused:
            write_cameras([LENSES[lens]], path, tool)
        said = str(refused.value)
        assert said.startswith(f"{path}: cam3: ")
        assert LENSES[lens].model in said
        able = said.rsplit("; ", 1)[1].removesuffix(" can hold it").split(", ")
        assert set(able) == {other for other, held in HELD.items() if lens in held}
        assert not path.exists()


def test_mirrors_several_cameras_and_formats_that_are_only_read(tmp_path: Path) -> None:
    path = tmp_path / "camera"
    fisheye = LENSES["fisheye"]
    for tool in sorted(set(HELD) - {"tiltvp"}):
        with pytest.raises(UnsupportedFormatError, match=r"seen in a mirror, .*; tiltvp can hold it"):
            write_cameras([replace(LENSES["ocam" if tool == "ocamcalib" else "fisheye"], mirror=True)], path, tool)
    for tool in ("ros", "opencv", "ocamcalib"):
        with pytest.raises(UnsupportedFormatError, match=r"2 cameras, expected one .* a, b; tiltvp"):
            write_cameras([replace(fisheye, name="a"), replace(fisheye, name="b")], path, tool)
    with pytest.raises(UnsupportedFormatError, match="camodocal is not written, expected one of tiltvp, "):
        write_cameras([fisheye], path, "camodocal")
    with pytest.raises(UnsupportedFormatError, match="unknown format 'kalibar', expected near it: kalibr"):
        write_cameras([fisheye], path, "kalibar")
    with pytest.raises(CalibrationError, match="no camera to write"):
        write_cameras([], path, "kalibr")
    with pytest.raises(CalibrationError, match=r"fx = -1.*at cam3"):
        write_cameras([replace(fisheye, parameters=AFFINE | {"fx": -1.0})], path, "kalibr")
    with pytest.raises(OutputError):
        write_cameras([fisheye], tmp_path, "kalibr")
    assert not path.exists()


def test_names_stay_where_files_have_them(tmp_path: Path) -> None:
    lens, odd = LENSES["fisheye"], 'left: "1"\t#ü'
    for tool in ("ros", "opencv"):
        assert read_cameras(written(tmp_path, tool, replace(lens, name="gate")))[0].name == "gate"
        # Readers take quotes and spaces around a name off.
        assert read_cameras(written(tmp_path, tool, replace(lens, name=odd)))[0].parameters["fx"] == 210.5
    two = [replace(lens, name="cam7"), replace(lens, name="cam3")]
    for ending in (".txt", ".bin"):
        assert [one.name for one in read_cameras(written(tmp_path, "colmap", *two, ending=ending))] == ["cam7", "cam3"]
        for names in (("cam0", "cam1"), ("a", "cam7"), ("cam7", "cam7")):
            renamed = [replace(lens, name=name) for name in names]
            back = read_cameras(written(tmp_path, "colmap", *renamed, ending=ending))
            assert [one.name for one in back] == ["cam1", "cam2"]


@pytest.mark.parametrize("ending", [".txt", ".bin"])
@pytest.mark.parametrize("lens", sorted(HELD["colmap"]))
def test_colmap_projects_as_we_do(lens: str, ending: str, tmp_path: Path) -> None:
    written(tmp_path, "colmap", LENSES[lens], ending=ending)
    for empty in ("images", "points3D", "rigs", "frames"):
        (tmp_path / f"{empty}{ending}").write_bytes(bytes(8) if ending == ".bin" else b"# nothing\n")
    theirs = pycolmap.Reconstruction(tmp_path).cameras[3]
    ours = tiltvp.Camera.from_spec(LENSES[lens])
    bearings = bearings_before(ours)
    ahead = seen_by_colmap(theirs, bearings)
    pixels = np.array([theirs.img_from_cam(bearing) for bearing in ahead])
    assert np.abs(pixels - 0.5 - ours.project(ahead)).max() < 1e-6


@pytest.mark.parametrize("ending", [".txt", ".bin"])
def test_what_colmap_writes_is_read(ending: str, tmp_path: Path) -> None:
    """All models that have a lens here."""
    numbers = {"f": 210.0, "fx": 210.0, "fy": 212.0, "cx": 320.0, "cy": 241.0, "alpha": 0.6, "beta": 1.2}
    reconstruction, names = pycolmap.Reconstruction(), []
    for name, model in pycolmap.CameraModelId.__members__.items():
        if name == "INVALID" or any(word in name for word in ("FOV", "PRISM", "DIVISION")):
            continue
        camera = pycolmap.Camera.create_from_model_id(len(names) + 1, model, 300.0, 640, 480)
        keys = camera.params_info.split(", ") if camera.params_info != "w,h" else []
        if keys:
            camera.params = [numbers.get(key, 0.01 / (place + 1)) for place, key in enumerate(keys)]
        reconstruction.add_camera(camera)
        names.append(name)
    assert len(names) == 13
    (reconstruction.write_text if ending == ".txt" else reconstruction.write_binary)(tmp_path)
    for camera_id, spec in zip(
        sorted(reconstruction.cameras), read_cameras(tmp_path / f"cameras{ending}"), strict=True
    ):
        theirs, ours = reconstruction.cameras[camera_id], tiltvp.Camera.from_spec(spec)
        bearings = bearings_before(ours)
        bearings = seen_by_colmap(theirs, bearings)
        pixels = np.array([theirs.img_from_cam(bearing) for bearing in bearings])
        assert spec.name == f"cam{camera_id}"
        assert np.abs(pixels - 0.5 - ours.project(bearings)).max() < 1e-6, theirs.model_name


def test_damaged_binary_files_are_refused(tmp_path: Path) -> None:
    whole = written(tmp_path, "colmap", LENSES["fisheye"], LENSES["extended"], ending=".bin").read_bytes()
    cases: dict[str, bytes] = {
        "the file ends early, expected the 2 cameras": whole[:-70],
        "the file ends early, expected 6 parameters of EUCM": whole[:-1],
        "1 bytes after the last camera": whole + b"\0",
        "the COLMAP model 7 is not supported": whole[:12] + b"\x07" + whole[13:],
        "there is no camera": bytes(8),
        "20000 cameras, expected at most 10000": (20_000).to_bytes(8, "little") + whole[8:],
        "expected a finite number": whole[:-8] + np.array([np.nan]).tobytes(),
        "the camera id 1 occurs twice": whole[:8] + 2 * whole[8 : 8 + 24 + 64],
    }
    for said, raw in cases.items():
        (tmp_path / "broken.bin").write_bytes(raw)
        with pytest.raises(CalibrationError) as refused:
            read_cameras(tmp_path / "broken.bin")
        assert said in str(refused.value)
        assert str(refused.value).startswith(f"{tmp_path / 'broken.bin'}: ")


OPENCVS = sorted(HELD["ros"])


@pytest.mark.parametrize(
    ("tool", "lens"), [pair for pair in PAIRS if pair[0] in ("opencv", "ros", "kalibr") and pair[1] in OPENCVS]
)
def test_opencv_projects_as_we_do(lens: str, tool: str, tmp_path: Path) -> None:
    path = written(tmp_path, tool, LENSES[lens])
    matrix, coefficients, is_fisheye = of_opencv(path) if tool == "opencv" else of_yaml(path, tool)
    ours = tiltvp.Camera.from_spec(LENSES[lens])
    bearings = bearings_before(ours)
    ahead = bearings[bearings[:, 2] > 0.2]
    project = cv2.fisheye.projectPoints if is_fisheye else cv2.projectPoints
    points = np.ascontiguousarray(ahead[:, None, :])
    pixels = project(points, np.zeros(3), np.zeros(3), matrix, coefficients)[0].reshape(-1, 2)
    assert np.abs(pixels - ours.project(ahead)).max() < 1e-6


def of_opencv(path: Path) -> tuple[np.ndarray, np.ndarray, bool]:
    """Matrix, coefficients and whether they are a fisheye's, by OpenCV's own reader."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    is_fisheye = storage.getNode("model").string() == "fisheye"
    names = ("K", "D") if is_fisheye else ("camera_matrix", "distortion_coefficients")
    matrix, coefficients = (storage.getNode(name).mat() for name in names)
    assert (storage.getNode("image_width").real(), storage.getNode("image_height").real()) == (640.0, 480.0)
    return matrix, coefficients, is_fisheye


def of_yaml(path: Path, tool: str) -> tuple[np.ndarray, np.ndarray, bool]:
    """The same from the YAML of the tools, read as these document it."""
    tree: dict[str, Any] = yaml.safe_load(path.read_text())
    if tool == "kalibr":
        camera = tree["cam0"]
        fx, fy, cx, cy = camera["intrinsics"]
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        return matrix, np.array(camera["distortion_coeffs"]), camera["distortion_model"] == "equidistant"
    assert np.array(tree["projection_matrix"]["data"]).reshape(3, 4)[:, 3].tolist() == [0.0, 0.0, 0.0]
    matrix = np.array(tree["camera_matrix"]["data"]).reshape(3, 3)
    coefficients = np.array(tree["distortion_coefficients"]["data"])
    known = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}
    assert len(coefficients) == known[tree["distortion_model"]]
    return matrix, coefficients, tree["distortion_model"] == "equidistant"


def test_basalts_unified_model_is_that_of_its_paper(tmp_path: Path) -> None:
    """Usenko et al. 2018, eq. 16: (fx x, fy y) / (alpha d + (1 - alpha) z)."""
    tree = json.loads(written(tmp_path, "basalt", LENSES["unified"]).read_text())["value0"]
    assert (tree["intrinsics"][0]["camera_type"], tree["resolution"]) == ("ucm", [[640, 480]])
    n = tree["intrinsics"][0]["intrinsics"]
    ours = tiltvp.Camera.from_spec(LENSES["unified"])
    x, y, z = bearings_before(ours).T
    scale = n["alpha"] + (1.0 - n["alpha"]) * z
    theirs = np.stack([n["fx"] * x / scale + n["cx"], n["fy"] * y / scale + n["cy"]], axis=1)
    assert np.abs(theirs - ours.project(np.stack([x, y, z], axis=1))).max() < 1e-9


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_ocamcalib_gets_an_inverse_polynomial_that_its_world2cam_can_use(sign: float, tmp_path: Path) -> None:
    polynomial = [sign * number for number in (-170.0, 0.0, 1.9e-3, -2.5e-6, 1.1e-8)]
    parameters = OCAM | {"polynomial": polynomial}
    del parameters["inverse_polynomial"]
    lens = CameraSpec("ocam", 640, 480, parameters)
    back = read_cameras(written(tmp_path, "ocamcalib", lens))[0].parameters
    inverse = back["inverse_polynomial"]
    ours = tiltvp.Camera.from_spec(lens)
    bearings = bearings_before(ours)
    # OCamCalib's world2cam in its axes: x along the rows, y along the columns, z backwards.
    x, y, z = bearings[:, 1], bearings[:, 0], -bearings[:, 2]
    norm = np.hypot(x, y)
    rho = np.polynomial.polynomial.polyval(np.arctan2(z, norm), inverse)
    row = back["c"] * x / norm * rho + back["d"] * y / norm * rho + back["cy"]
    column = back["e"] * x / norm * rho + y / norm * rho + back["cx"]
    assert np.abs(np.stack([column, row], axis=1) - ours.project(bearings)).max() < 0.02
    steep = [sign * -200.0, *[0.0] * 58, sign * 200.0 / 200.0**59]
    with pytest.raises(UnsupportedFormatError, match="no inverse polynomial of 33 coefficients is within"):
        written(tmp_path, "ocamcalib", replace(lens, parameters=parameters | {"polynomial": steep}))

"""Corrections from Python: trained on arrays, applied to arrays and by estimators, and values like the others."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.rotations import about_vertical
from tiltvp.synth import RoomImage

PAPERS = [method for method in tiltvp.METHODS if method not in ("refined", "segments")]


def draws(count: int = 400, factor: float = 130.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(0.005, 0.12, count)
    return np.hypot(factor * alpha + rng.normal(0, 0.01 * factor, count), rng.normal(0, 0.01 * factor, count)), alpha


def corrections(factor: float = 130.0) -> list[Any]:
    shift, alpha = draws(factor=factor)
    return [
        tiltvp.train_factor(shift, alpha),
        tiltvp.train_affine(shift, alpha),
        tiltvp.train_posterior(shift, alpha),
        tiltvp.train_posterior(shift, alpha, prior=tiltvp.PriorOfTilt.uniform(0.2)),
        tiltvp.train_posterior(shift, alpha, prior=tiltvp.PriorOfTilt.rayleigh(0.05)),
    ]


def test_training_finds_the_law() -> None:
    shift, alpha = draws(4000)
    factor, affine, posterior, *_ = corrections()
    assert factor == pytest.approx(np.mean(draws()[0] / draws()[1]))
    assert affine.factor == pytest.approx(130.0, rel=0.05)
    assert posterior.factor == pytest.approx(130.0, rel=0.03)
    assert posterior.spread == pytest.approx(1.3, rel=0.2)
    for correction in corrections():
        error = tiltvp.apply_correction(correction, shift) - alpha
        assert np.sqrt(np.mean(error**2)) < 0.012
    assert (np.diff(posterior.mean_rad) >= 0.0).all()
    assert posterior.std_rad.shape == posterior.mean_rad.shape


@pytest.mark.parametrize("method", PAPERS)
def test_estimators_apply_what_arrays_do(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    raw = estimator.with_options(correction=130.0 if method.startswith("image") else 1.0)(room.gray)
    shift = raw.shift_px if raw.shift_px is not None else raw.alpha_rad
    for correction in corrections(130.0 if method.startswith("image") else 1.8):
        corrected = estimator.with_options(correction=correction)
        found = corrected(room.gray)
        assert found.alpha_rad == pytest.approx(tiltvp.apply_correction(correction, [shift])[0], abs=1e-9)
        assert found.beta_rad == pytest.approx(raw.beta_rad, abs=1e-9)
        assert corrected.options["correction"] == correction
        assert pickle.loads(pickle.dumps(corrected)) == corrected
        if isinstance(correction, tiltvp.PosteriorCorrection):
            place = np.interp(shift, np.arange(len(correction.std_rad)) * correction.step, correction.std_rad)
            along = found.normal[:2] / np.linalg.norm(found.normal[:2])
            assert along @ found.covariance_rad2 @ along > 0.99 * place**2


def test_applying_takes_nan_and_refuses_nonsense() -> None:
    for correction in corrections():
        alpha = tiltvp.apply_correction(correction, [0.0, 5.0, np.nan, 1e9])
        assert np.isnan(alpha).tolist() == [False, False, True, False]
        with pytest.raises(InvalidInputError, match="-1 in place 1"):
            tiltvp.apply_correction(correction, [1.0, -1.0])
    for wrong in (0.0, -3.0, np.nan, "line", None):
        with pytest.raises(InvalidInputError, match="correction"):
            tiltvp.apply_correction(wrong, [1.0])  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=r"expected an array \(N,\)"):
        tiltvp.apply_correction(3.0, [[1.0]])
    assert tiltvp.apply_correction(tiltvp.AffineCorrection(100.0, -0.02), [1.0, 5.0]) == pytest.approx([0.0, 0.03])


def test_values() -> None:
    priors = [tiltvp.PriorOfTilt.empirical(), tiltvp.PriorOfTilt.uniform(0.2), tiltvp.PriorOfTilt.rayleigh(0.1)]
    values = [*corrections()[1:], *priors]
    for i, value in enumerate(values):
        twins = [copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))]
        if i < 4:
            twins.append(type(value).from_dict(value.to_dict()))
        for twin in twins:
            assert twin == value
            assert hash(twin) == hash(value)
            assert repr(twin) == repr(value)
        assert all(value != other for j, other in enumerate(values) if j != i)
        with pytest.raises(AttributeError):
            value.factor = 3.0
    posterior = values[1]
    for key in posterior.to_dict():
        with pytest.raises(InvalidInputError, match=key):
            type(posterior).from_dict({k: v for k, v in posterior.to_dict().items() if k != key})
    with pytest.raises(InvalidInputError, match="unknown key"):
        type(posterior).from_dict({**posterior.to_dict(), "mean": 3.0})


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: tiltvp.AffineCorrection(0.0, 0.0), "factor"),
        (lambda: tiltvp.AffineCorrection(1.0, np.nan), "offset_rad"),
        (lambda: tiltvp.PriorOfTilt.uniform(0.0), "max_rad"),
        (lambda: tiltvp.PriorOfTilt.rayleigh(-1.0), "sigma_rad"),
        (lambda: tiltvp.train_factor([1.0], [0.0]), "above zero"),
        (lambda: tiltvp.train_factor([1.0, 2.0], [0.1]), "1 for 2 shifts"),
        (lambda: tiltvp.train_affine([1.0, 2.0], [0.1, 0.1]), "leans that differ"),
        (lambda: tiltvp.train_affine([2.0, 1.0], [0.1, 0.2]), "grow"),
        (lambda: tiltvp.train_posterior([1.0] * 12, [np.nan] * 12), "alpha_rad: got NaN in place 0"),
        (lambda: tiltvp.train_posterior([1.0] * 12, [0.1] * 12, prior="flat"), "prior"),  # type: ignore[arg-type]
    ],
)
def test_nonsense_is_refused(make: Any, words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        make()


def test_the_prefilter_follows_the_lens() -> None:
    """The same image at half the size: half the offset, the same lean."""
    for method in PAPERS[:2]:
        paper = tiltvp.Camera.equidistant(width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5)
        image = np.random.default_rng(0).integers(0, 256, (480, 640), np.uint8)
        given = tiltvp.TiltEstimator(paper, method=method, offset_max_px=40.0)
        assert tiltvp.TiltEstimator(paper, method=method)(image) == given(image)
        small = tiltvp.Camera.equidistant(width=48, height=40, focal_px=10.5, cx=23.5, cy=19.5)
        assert tiltvp.TiltEstimator(small, method=method).options["offset_max_px"] is None
        with pytest.raises(InvalidInputError, match="offset_max_px = 40"):
            tiltvp.TiltEstimator(small, method=method, offset_max_px=40.0)
        with pytest.raises(InvalidInputError, match="correction = 1"):
            tiltvp.TiltEstimator(paper, method=method, correction=1.0)


@pytest.mark.parametrize("kind", tiltvp.corrections.CORRECTION_KINDS)
def test_a_trained_correction_is_a_file(camera: tiltvp.Camera, tmp_path: Path, kind: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=None, threshold_px=8.0)
    shift, alpha = draws()
    trained = tiltvp.train_correction(estimator, [*shift, math.nan], [*alpha, 0.1], kind=kind)
    assert (trained.kind, trained.images, trained.options["threshold_px"]) == (kind, len(shift), 8.0)
    path = tmp_path / "correction.toml"
    trained.save(path)
    read = tiltvp.TrainedCorrection.load(path)
    assert read == trained
    options = read.estimator_options(camera, {"threshold_px": 8.0, "seed": 3}, None)
    made = tiltvp.TiltEstimator(camera, **options)
    assert (made.method, made.options["correction"]) == ("image-space-ransac", trained.correction)
    for told, others in (
        ("trained at 8.0", (camera, {"threshold_px": 9.0}, None)),
        ("tilt_max_rad = 0.1", (camera, {"tilt_max_rad": 0.1}, None)),
        ("method vector-consensus", (camera, {}, "vector-consensus")),
        ("another camera", (camera.scaled(0.5), {}, None)),
    ):
        with pytest.raises(InvalidInputError, match=told):
            read.estimator_options(*others)
    text = path.read_text()
    for old, new in (
        ("version = 1", "version = 2"), (f'kind = "{kind}"', 'kind = "line"'), ("factor = ", "faktor = "),
        ("tiltvp-correction", "tiltvp-camera"),
    ):  # fmt: skip
        path.write_text(text.replace(old, new))
        with pytest.raises(CalibrationError, match=str(path)):
            tiltvp.TrainedCorrection.load(path)


def test_what_has_no_correction_is_refused(camera: tiltvp.Camera) -> None:
    with pytest.raises(InvalidInputError, match="no correction"):
        tiltvp.train_correction(tiltvp.TiltEstimator(camera), *draws())
    with pytest.raises(InvalidInputError, match="estimator: Camera, expected a TiltEstimator"):
        tiltvp.train_correction(camera, *draws())  # type: ignore[arg-type]
    estimator = tiltvp.TiltEstimator(camera, method="vector-consensus", correction=None)
    with pytest.raises(InvalidInputError, match="expected one of"):
        tiltvp.train_correction(estimator, *draws(), kind="line")


def test_an_estimator_that_corrects_measures_no_raw_shifts(camera: tiltvp.Camera) -> None:
    for method, correction in (("image-space-ransac", "closed-form"), ("vector-consensus", 1.8)):
        estimator = tiltvp.TiltEstimator(camera, method=method, correction=correction)
        with pytest.raises(InvalidInputError, match=f"correction = {correction!r}, expected"):
            tiltvp.train_correction(estimator, *draws())
        raw = estimator.with_options(correction=None)
        assert tiltvp.train_correction(raw, *draws()).method == method


@pytest.mark.parametrize("kind", tiltvp.corrections.CORRECTION_KINDS)
def test_numbers_that_make_no_sense_train_nothing(camera: tiltvp.Camera, kind: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=None)
    shift, alpha = draws()
    for measured, leans in (
        (shift, alpha[1:]), (shift[:, None], alpha[:, None]), (["a"] * 400, alpha), (shift, [*alpha[1:], math.nan]),
        (shift, -alpha), ([*shift[1:], math.inf], alpha),
    ):  # fmt: skip
        with pytest.raises(InvalidInputError, match="expected"):
            tiltvp.train_correction(estimator, measured, leans, kind=kind)
    trained = tiltvp.train_correction(estimator, [*shift, 1.0], [*alpha, 0.0], kind=kind)
    assert trained.images == (400 if kind == "factor" else 401)


def test_a_factor_of_any_number_is_written(camera: tiltvp.Camera, tmp_path: Path) -> None:
    trained = tiltvp.TrainedCorrection(250, "image-space-ransac", {}, camera.to_dict())
    trained.save(tmp_path / "correction.toml")
    assert tiltvp.TrainedCorrection.load(tmp_path / "correction.toml") == trained


def test_what_could_not_be_read_again_is_not_written(camera: tiltvp.Camera, tmp_path: Path) -> None:
    path, own = tmp_path / "correction.toml", camera.to_dict()
    for values, told in (
        ({"method": "shift"}, "found 'shift', expected one of"),
        ({"camera": {}}, "at camera, options or robot_from_camera"),
        ({"options": {"threshold_px": -1.0}}, "threshold_px = -1"),
        ({"options": {"threshold_px": None}}, "expected plain numbers"),
        ({"images": "many"}, "images"),
        ({"correction": "strong"}, "correction = 'strong', expected a number"),
        ({"correction": -3.0}, "correction = -3"),
        ({"robot_from_camera": np.ones((3, 3))}, "robot_from_camera"),
        ({"robot_from_camera": "up"}, "robot_from_camera: no array of numbers"),
    ):
        whole: dict[str, Any] = {"correction": 250.0, "method": "image-space-ransac", "camera": own} | values
        with pytest.raises((CalibrationError, InvalidInputError), match=told):
            tiltvp.TrainedCorrection(**whole).save(path)
    assert not list(tmp_path.iterdir())
    mounted = tiltvp.TrainedCorrection(250, "image-space-ransac", {}, own, robot_from_camera=np.eye(3))  # type: ignore[arg-type]
    mounted.save(path)
    assert tiltvp.TrainedCorrection.load(path) == mounted


def test_a_correction_is_for_the_mounting_of_its_training(
    camera: tiltvp.Camera, room: RoomImage, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    leaning = tilted(40.0)
    estimator = tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=None, robot_from_camera=leaning)
    path, old = tmp_path / "correction.toml", tmp_path / "old.toml"
    tiltvp.train_correction(estimator, *draws(), kind="factor").save(path)
    trained = tiltvp.TrainedCorrection.load(path)
    options = trained.estimator_options(camera, {}, None)
    assert np.allclose(tiltvp.TiltEstimator(camera, **options).robot_from_camera, leaning)
    trained.estimator_options(camera, {"robot_from_camera": about_vertical(2.0) @ tilted(40.5)}, None)
    with pytest.raises(InvalidInputError, match=r"mounted 38\.0 degrees otherwise"):
        trained.estimator_options(camera, {"robot_from_camera": tilted(2.0)}, None)
    image, calibration = tmp_path / "a.png", tmp_path / "camera.toml"
    tiltvp.write_image(image, room.gray)
    camera.save(calibration)
    told = ["tilt", str(image), "--camera", str(calibration), "--robot-from-camera", "up"]
    assert main([*told, "--correction", str(path)]) == 2
    assert f"{path}: robot_from_camera: a correction of a camera mounted 40.0" in " ".join(
        capsys.readouterr().err.split()
    )
    dataclasses.replace(trained, robot_from_camera=None).save(old)
    assert main([*told, "--correction", str(old)]) == 0


def tilted(angle_deg: float) -> np.ndarray:
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def test_what_is_wrong_with_a_correction_names_its_file(
    camera: tiltvp.Camera, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    estimator = tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=None)
    path = tmp_path / "correction.toml"
    tiltvp.train_correction(estimator, *draws(), kind="factor").save(path)
    camera.scaled(0.5).save(tmp_path / "half.toml")
    assert main(["tilt", "a.png", "--camera", str(tmp_path / "half.toml"), "--correction", str(path)]) == 2
    assert "correction.toml: a correction of another camera" in " ".join(capsys.readouterr().err.split())
    text = path.read_text()
    for old, new in (("threshold_px", "treshold_px"), ("width = 256", "width = 0")):
        assert old in text
        path.write_text(text.replace(old, new))
        with pytest.raises(CalibrationError, match=str(path)):
            tiltvp.TrainedCorrection.load(path)


@pytest.mark.slow
def test_a_correction_is_trained_and_read_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, out = tmp_path / "set", tmp_path / "correction.toml"
    size = ["--rooms", "1", "--locations-per-room", "2", "--samples", "1"]
    assert main(["dataset", "synth", *size, "--out", str(data)]) == 0
    assert main(["lab", "train", str(data), "--out", str(out), "--kind", "affine"]) == 0
    assert "trained on" in capsys.readouterr().out
    camera, image = str(data / "camera.toml"), str(next(data.rglob("*.png")))
    assert main(["tilt", image, "--camera", camera, "--correction", str(out), "--out", str(tmp_path / "a.json")]) == 0
    trained = tiltvp.TrainedCorrection.load(out)
    estimator = tiltvp.TiltEstimator(trained_camera := tiltvp.Camera.load(camera), **trained.estimator_options(
        trained_camera, {}, None))  # fmt: skip
    (row,) = json.loads((tmp_path / "a.json").read_text())
    assert row["alpha_rad"] == pytest.approx(estimator(tiltvp.read_image(image)).alpha_rad, abs=1e-12)
    assert main(["tilt", image, "--camera", camera, "--correction", str(out), "--method", "vector-consensus"]) == 2
    assert "expected image-space-ransac" in capsys.readouterr().err


@pytest.mark.slow
def test_a_dataset_that_is_too_small_to_train_on_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "small"
    size = ["--rooms", "1", "--locations-per-room", "1", "--samples", "1"]
    assert main(["dataset", "synth", *size, "--out", str(data)]) == 0
    capsys.readouterr()
    assert main(["lab", "train", str(data), "--out", str(tmp_path / "correction.toml")]) == 2
    assert "small, 7 images: alpha_rad: got 7" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "correction.toml").exists()

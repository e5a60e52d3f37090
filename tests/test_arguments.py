"""Numbers that functions take: what is none is refused before it is taken for one."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp import corner, lines
from tiltvp.arguments import array_from, number_from
from tiltvp.colmap import gravity_from, image_gravities
from tiltvp.corner_tables import corner_rows, pose_rows, roll_pitch_yaw, write_trajectory
from tiltvp.errors import InvalidInputError, TiltvpError
from tiltvp.field_of_view import field_of_view, looks_like_a_mirror
from tiltvp.formats import CameraSpec
from tiltvp.line_calibration import calibrate_lines, place_of_longest_tracks
from tiltvp.line_logs import bearing_log, believed_leans, displacements, follow_lines, see_lines
from tiltvp.rotations import about_vertical, levelling, quaternion
from tiltvp.selfcalib import convergence_table
from tiltvp.stereo_rigs import StereoRig
from tiltvp.streams import (
    Frames,
    InertialSamples,
    LiveCamera,
    Motion,
    Odometry,
    Wheels,
    frame_motions,
    outputs,
    read_odometry,
    recorded_camera,
)
from tiltvp.streams.outputs.transforms import StaticTransform
from tiltvp.synth import Drive, Room, StereoSequence, simulate_drive, zed_cameras
from tiltvp.tilt import normal_of

CAMERA = tiltvp.Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
NONE = {
    "texts": ["0.1", "0.2"],
    "bytes": np.array([b"1", b"2"]),
    "complex": np.array([0.1 + 2j, 0.2]),
    "bools": [True, False],
    "dates": np.array(["2020-01-01", "2020-01-02"], "datetime64[ns]"),
    "times": np.array([1, 2], "timedelta64[ns]"),
    "masked": np.ma.masked_array([0.1, 0.2], mask=[True, False]),
    "huge": [10**400, 1],
    "ragged": [[1.0], [2.0, 3.0]],
}


@pytest.mark.parametrize("values", NONE.values(), ids=NONE)
def test_what_are_no_numbers(values: Any) -> None:
    with pytest.raises(InvalidInputError, match="x: no array of numbers"):
        array_from(values, "x")
    with pytest.raises(InvalidInputError, match="tilt = "):
        normal_of(values)
    # Nanoseconds of a table would be seconds.
    with pytest.raises(InvalidInputError, match="times_s: no array of numbers"):
        Odometry.from_wheels(values, np.zeros((2, 2)))


def test_numbers_of_any_kind_are_numbers() -> None:
    for values in ([1, 0.5], np.array([1, 0.5], np.float16), [Decimal(1), 0.5], np.ma.masked_array([1.0, 0.5])):
        np.testing.assert_array_equal(array_from(values, "x"), [1.0, 0.5])
    assert np.isnan(array_from([np.nan], "x"))
    for one in (2, np.float32(2), np.int8(2), np.array(2.0), Decimal(2)):
        assert number_from(one, "x") == 2.0


@pytest.mark.parametrize("value", ["2", b"2", 2 + 0j, np.complex64(2), np.array("2"), np.ma.masked, None, 10**400])
def test_what_is_no_number(value: Any) -> None:
    with pytest.raises(InvalidInputError, match=r"x = .*, expected a number"):
        number_from(value, "x")
    with pytest.raises(InvalidInputError, match=r"u = .*, expected a number"):
        CAMERA.cropped(value, 0, 10, 10)


@pytest.mark.parametrize("value", [True, np.True_, np.array(True)], ids=["True", "numpy", "array"])
@pytest.mark.parametrize(
    "call",
    [
        lambda value: tiltvp.Camera.equidistant(width=value, height=48, focal_px=20.0, cx=31.5, cy=23.5),
        lambda value: tiltvp.Camera.equidistant(width=64, height=48, focal_px=value, cx=31.5, cy=23.5),
        lambda value: tiltvp.Camera("equidistant", width=64, height=48, focal_px=20, cx=31, cy=23, max_theta_rad=value),
        lambda value: ESTIMATOR.estimate_many([IMAGE], threads=value),
        lambda value: tiltvp.SelfCalibrator(wheel_base_m=value),
        lambda value: tiltvp.TiltFilter().predict(value),
        lambda value: Room("office", value),
        lambda value: corner.attitudes(FEATURE, gamma_rad=value),
        lambda value: SEGMENTS.pixels(value),
        lambda value: tiltvp.TiltEstimator(CAMERA, smoothing_px=value),
    ],
)
def test_truth_values_are_no_numbers_of_the_core(call: Any, value: Any) -> None:
    with pytest.raises(TiltvpError, match=r"True.*expected"):
        call(value)


@pytest.mark.parametrize(
    "call",
    [
        lambda: tiltvp.SelfCalibrator(wheel_base_m=400.0),
        lambda: tiltvp.calibrate(np.zeros((3, 2)), np.zeros((0, 3)), wheel_base_m=400.0),
        lambda: tiltvp.wheel_displacements([0.1], [0.1], wheel_base_m=400.0),
        lambda: Odometry.from_wheels(TIMES, np.stack([TIMES, TIMES], axis=1), wheel_base_m=400.0),
        lambda: simulate_drive(wheel_base_m=400.0),
    ],
)
def test_millimetres_are_no_wheel_base(call: Any) -> None:
    with pytest.raises(InvalidInputError, match=r"wheel_base_m = 400.*metres, at most 200"):
        call()


MASKED = np.ma.masked_array(np.eye(3), mask=np.eye(3) > 0.0)
HIDDEN = np.ma.masked_array(np.ones((48, 64), bool), mask=np.eye(48, 64) > 0.0)
DESCRIPTORS = np.ma.masked_array(np.eye(3, 192, dtype=np.float32), mask=np.eye(3, 192) > 0.0)


@pytest.mark.parametrize(
    "call",
    [
        lambda: CAMERA.project(MASKED),
        lambda: CAMERA.unproject(MASKED[:, :2]),
        lambda: tiltvp.common_direction(MASKED),
        lambda: tiltvp.TiltEstimator(CAMERA, robot_from_camera=MASKED),
        lambda: tiltvp.TiltEstimator(CAMERA, mask=HIDDEN),
        lambda: tiltvp.tilt_error_rad(MASKED[0], np.ones(3)),
        lambda: EXTRACTOR.lines_at(MASKED[0]),
        lambda: lines.match(DESCRIPTORS, DESCRIPTORS),
        lambda: lines.ssd_matrix(DESCRIPTORS, np.zeros((3, 192), np.float32)),
        lambda: tiltvp.SelfCalibrator(wheel_base_m=0.4, start=MASKED[0]),
    ],
)
def test_arrays_with_masked_values_are_refused_in_the_core(call: Any) -> None:
    with pytest.raises(InvalidInputError, match="masked"):
        call()


def test_arrays_without_masked_values_are_arrays() -> None:
    plain = np.ma.masked_array(np.eye(3))
    np.testing.assert_array_equal(CAMERA.project(plain), CAMERA.project(np.eye(3)))
    assert tiltvp.TiltEstimator(CAMERA, robot_from_camera=plain) == tiltvp.TiltEstimator(CAMERA)


@pytest.mark.parametrize("value", [10**400, -(10**400), 10**5000, -(10**39)], ids=["400", "-400", "5000", "-39"])
def test_whole_numbers_that_no_option_can_hold_are_refused(value: int) -> None:
    for option in ("gradient_min", "seed"):
        with pytest.raises(InvalidInputError, match=f"option {option} = "):
            tiltvp.TiltEstimator(CAMERA, **{option: value})


def test_a_large_whole_number_is_that_number() -> None:
    assert tiltvp.TiltEstimator(CAMERA, gradient_min=10**39).options["gradient_min"] == 1e39


def test_a_buffer_that_is_filled_anew_does_not_change_what_was_made_of_it() -> None:
    times = np.array([0.0, 0.1, 0.2])
    odometry = Odometry.from_wheels(times, np.stack([times, times], axis=1), wheel_base_m=1.0)
    times += 7.0
    np.testing.assert_array_equal(odometry.times_s, [0.0, 0.1, 0.2])


IMAGE = np.random.default_rng(0).integers(0, 255, (48, 64), dtype=np.uint8)
EXTRACTOR, ESTIMATOR = lines.LineExtractor(CAMERA), tiltvp.TiltEstimator(CAMERA)
ESTIMATE, EDGES = ESTIMATOR.with_edges(IMAGE)
SEGMENTS = tiltvp.SegmentDetector(CAMERA)(IMAGE)
TIMES = np.linspace(0.0, 1.0, 11)
ODOMETRY = Odometry.from_wheels(TIMES, np.stack([TIMES, TIMES], axis=1), wheel_base_m=1.0)


def delay(odometry: Any = ODOMETRY, reach_s: Any = 0.1) -> Any:
    return tiltvp.frame_delay([IMAGE] * 11, TIMES, odometry, CAMERA, np.eye(3), reach_s=reach_s)


def poses(**words: Any) -> Odometry:
    """Of a way to the side, which a note tells."""
    return Odometry.from_poses(TIMES, TIMES, 10.0 * TIMES, 0.0 * TIMES, **words)


def transform(**parts: Any) -> StaticTransform:
    return StaticTransform("base", "camera", np.zeros(3), np.eye(3), **parts)


CORNERS = corner.solve_many([[0, 0, 1]], [[0.1, 0, 1]], [[0, 0.1, 1]], [[-0.1, 0, 1]])
LINES, FEW, VIEW = EXTRACTOR.lines_at([]), np.zeros((0, 190), np.float32), field_of_view(CAMERA)
FRAMES = Frames()
FRAMES.names = []
LOGS = tiltvp.JoinedLogs(np.zeros(3), np.eye(3), logs=1, distance=0.0, limit=1.0)
ALONG = np.linspace(0.02, 0.3, 20)[:, None]
FEATURE = corner.fit(
    *(
        ray / np.linalg.norm(ray, axis=1, keepdims=True)
        for ray in [0.5, 0.0, 2.0] + ALONG * np.array([[[0.7, 0.1, 0.7]], [[0.0, 1.0, 0.2]], [[-0.7, 0.1, 0.7]]])
    ),
    sigma_rad=1e-3,
)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: EXTRACTOR.believes(IMAGE, (0.1, 0.2)), "tilt: tuple, expected an estimate"),
        (lambda: EXTRACTOR.believes(IMAGE, ESTIMATE, confidence_min="a"), "confidence_min = 'a', expected a number"),
        (lambda: EXTRACTOR.describe(IMAGE, None), "lines: NoneType, expected Lines"),
        (lambda: EXTRACTOR.patches(IMAGE, IMAGE), "lines: ndarray, expected Lines"),
        (lambda: lines.describe(IMAGE, CAMERA, []), "lines: list, expected Lines"),
        (lambda: tiltvp.draw_edges(IMAGE, ESTIMATOR.detect(IMAGE)), "edges: ImageEdges, expected EdgeElements"),
        (lambda: tiltvp.draw_edges(IMAGE, EDGES, offset_max_px="a"), "offset_max_px = 'a', expected a number"),
        (lambda: tiltvp.draw_edges(IMAGE, EDGES, only=["all"]), "only = .'all'., expected one of"),
        (lambda: tiltvp.draw_segments(IMAGE, SEGMENTS, CAMERA), "camera: Segments, expected a tiltvp.Camera"),
        (lambda: tiltvp.draw_segments(IMAGE, CAMERA, CAMERA), "segments: Camera, expected Segments"),
        (lambda: corner.attitudes("a"), "feature: str, expected a CornerFeature"),
        (lambda: corner.screen(None), "feature: NoneType, expected a CornerFeature"),
        (lambda: corner.included_angle(1, [0.0, 1.0, 0.0]), "feature: int, expected a CornerFeature"),
        (lambda: corner.resolve(FEATURE), "features: CornerFeature, expected several CornerFeature"),
        (lambda: corner.resolve([FEATURE], gamma_rad="a"), "gamma_rad = 'a', expected a number"),
        (lambda: corner.resolve([FEATURE], gamma_sigma_rad=[]), "gamma_sigma_rad = .., expected a number"),
        (lambda: Odometry(TIMES, None, None), r"odometry: distance_m \(\), expected \(11,\)"),
        (lambda: Odometry([[0.0], [1.0, 2.0]], TIMES, None), "odometry: times_s: no array of numbers"),
        (lambda: Odometry(TIMES, TIMES, TIMES, gap_max_s="a"), "gap_max_s = 'a', expected a number"),
        (lambda: Odometry.from_velocities(TIMES, TIMES, TIMES, gap_max_s=[]), "gap_max_s = .., expected a number"),
        (lambda: ODOMETRY.at("a"), "times_s: no array of numbers"),
        (lambda: ODOMETRY.at(np.zeros((2, 2))), r"times_s: shape \(2, 2\), expected \(M,\)"),
        (lambda: ODOMETRY.between(0.1, [[0.2], [0.1, 0.3]]), "times_s: no array of numbers"),
        (lambda: InertialSamples(TIMES, None, None), r"inertial sensor: rates_rad_s \(\), expected"),
        (lambda: Wheels(joints=3), "joints = 3, expected names of two"),
        (lambda: Wheels(joints=(1, 2)), r"joints = \(1, 2\), expected names of two"),
        (lambda: Wheels(joints=("a", "a")), r"joints = \('a', 'a'\), expected names of two"),
        (lambda: tiltvp.Robot(CAMERA, np.eye(3), wheels=None), "wheels: NoneType, expected tiltvp.streams.Wheels"),
        (lambda: tiltvp.Robot(CAMERA, np.eye(3), topics="/image"), "topics: str, expected a dict"),
        (lambda: delay(odometry="drive.mcap"), "odometry: str, expected a tiltvp.streams.Odometry"),
        (lambda: delay(reach_s=-1.0), "reach_s = -1.0, expected seconds above 0, at most 60"),
        (lambda: delay(reach_s=1e30), r"reach_s = 1e\+30, expected seconds above 0, at most 60"),
        (lambda: delay(reach_s="a"), "reach_s = 'a', expected a number"),
        (
            lambda: tiltvp.mounting_tilt([None], [Motion()], np.eye(3), level_floor="no"),
            "level_floor = 'no', expected True",
        ),
        (
            lambda: tiltvp.mounting_tilt([None], [Motion()], np.eye(3)).within("a"),
            "tolerance_rad = 'a', expected a number",
        ),
        (lambda: StereoRig("left.yaml", CAMERA, np.eye(4)), "left: str, expected a tiltvp.Camera"),
        (lambda: read_odometry("odometry.csv", wheels=0.4), "wheels: float, expected tiltvp.streams.Wheels"),
        (lambda: frame_motions([IMAGE], "odometry.csv"), "frames: list, expected what tiltvp.streams.open_frames"),
        (lambda: StaticTransform("base", 3, np.zeros(3), np.eye(3)), "child = 3, expected the name of a frame"),
        (lambda: tiltvp.join_logs([], start="a"), "start: no array of numbers"),
        (lambda: corner.poses(FEATURE, None, np.eye(4)), "feature: NoneType, expected a CornerFeature"),
        (lambda: tiltvp.join_logs(3), "logs: int, expected several LogCalibration"),
        (lambda: tiltvp.join_logs("ab"), r"logs\[0\]: str, expected a LogCalibration"),
        (lambda: tiltvp.join_tilts([None]), r"tilts\[0\]: NoneType, expected a MountingTilt"),
        (lambda: tiltvp.Extrinsics.of(3), "place: int, expected a LogCalibration or JoinedLogs"),
        (lambda: tiltvp.surround_mask(np.array(1), CAMERA), "images: an array without dimensions, expected several"),
        (lambda: tiltvp.mounting_tilt([None], [3], np.eye(3)), r"motions\[0\]: int, expected a Motion or None"),
        (lambda: corner.join_boxes(FEATURE), "corners: CornerFeature, expected several BelievedCorner"),
        (lambda: corner.triangulate("a", [], []), "bearings: no array of numbers"),
        (
            lambda: corner.triangulate(np.eye(3)[:2], [np.eye(2)], []),
            r"covariances_rad2: shape \(1, 2, 2\), expected \(2, 2, 2\)",
        ),
        (lambda: roll_pitch_yaw(3), r"object_from_camera: shape \(\), expected \(3, 3\)"),
        (lambda: about_vertical("a"), "angle_rad = 'a', expected a number"),
        (lambda: levelling([0.0, 1.0]), r"normal: shape \(2,\), expected \(3,\)"),
        (lambda: quaternion([[]] * 2 + [[1]]), "rotation: no array of numbers"),
        (lambda: quaternion(np.full((3, 3), np.nan)), "rotation: numbers that are not finite, expected a rotation"),
        (lambda: field_of_view("a.yaml"), "camera: str, expected a tiltvp.Camera"),
        (lambda: ODOMETRY.gaps("a"), "times_s: no array of numbers"),
        (lambda: recorded_camera("drive.mcap"), "recording: str, expected a tiltvp.streams.Recording"),
        (lambda: outputs.attitude((0.1, 0.2)), "tilt: tuple, expected an estimate of a tilt"),
        (lambda: outputs.write_tilts("a.tum", ["a"], [ESTIMATE]), "times_s: no array of numbers"),
        (lambda: outputs.write_tilts("a.tum", [0.0], ESTIMATE), "tilts: TiltEstimate, expected several tilt or None"),
        (lambda: outputs.write_tum("a.tum", 3, [], [], ""), r"times_s: shape \(\), expected \(N,\)"),
        (lambda: bearing_log([SEGMENTS]), r"frames\[0\]: Segments, expected a FollowedFrame"),
        (lambda: displacements([0.1], wheel_base_m=0.4), r"motions\[0\]: float, expected a Motion"),
        (lambda: place_of_longest_tracks([], 3), r"start: shape \(\), expected \(3,\)"),
        (lambda: gravity_from(ESTIMATE, "up"), "robot_from_camera: no array of numbers"),
        (lambda: gravity_from(None, np.eye(3)), "estimate: NoneType, expected a TiltEstimate"),
        (lambda: image_gravities(None, ".", None, confidence_min=0.5), "database: NoneType, expected a ColmapDatabase"),
        (lambda: pose_rows(None), "estimates: NoneType, expected several"),
        (lambda: pose_rows([(0.0, "a", None)]), r"estimates\[0\]\[2\]: NoneType, expected the last of"),
        (lambda: corner_rows([3]), r"estimates\[0\] = 3, expected .time_s, file, CornerEstimate"),
        (lambda: write_trajectory([3], "a.tum"), r"rows\[0\]: int, expected a row of pose_rows"),
        (lambda: write_trajectory([{"time_s": 0.0}], "a.tum"), r"rows\[0\]: no x_m, expected a row of pose_rows"),
        (lambda: list(see_lines(None, EXTRACTOR)), "images: NoneType, expected several images"),
        (lambda: list(see_lines([IMAGE], None)), "extractor: NoneType, expected a LineExtractor"),
        (lambda: list(see_lines([IMAGE], EXTRACTOR, tilt=3)), "tilt: int, expected what tells the lean"),
        (lambda: list(follow_lines([IMAGE], EXTRACTOR, None)), "tracker: NoneType, expected a LineTracker"),
        (lambda: bearing_log([], frames_min="a"), "frames_min = 'a', expected a number"),
        (lambda: believed_leans(None, EXTRACTOR), "estimator: NoneType, expected a TiltEstimator"),
        (lambda: believed_leans(ESTIMATOR, "a"), "extractor: str, expected a LineExtractor"),
        (lambda: calibrate_lines([], None), "solve: NoneType, expected what makes a LogCalibration"),
        (lambda: calibrate_lines([], tiltvp.LogCalibration), "solve: the class LogCalibration, expected what makes"),
        (lambda: list(see_lines([IMAGE], EXTRACTOR, tilt=tiltvp.TiltEstimator)), "tilt: the class TiltEstimator"),
        (lambda: poses(notes=None), "notes = None, expected a tuple of texts"),
        (lambda: poses(notes="late"), "notes = 'late', expected a tuple of texts"),
        (lambda: poses(source=None), "source: NoneType, expected a text"),
        (lambda: Odometry(TIMES, TIMES, TIMES, notes=[3]), r"notes = \[3\], expected a tuple of texts"),
        (lambda: InertialSamples(TIMES, np.zeros((11, 3)), None, notes=3), "notes = 3, expected a tuple of texts"),
        (lambda: InertialSamples(TIMES, np.zeros((11, 3)), None, frame=3), "frame: int, expected a text"),
        (lambda: CameraSpec("equidistant", 8, 8, {}, notes=3).check(), "notes = 3, expected a tuple of texts"),
        (lambda: CameraSpec("equidistant", 8, 8, {}, name=3).check(), "name: int, expected a text"),
        (lambda: looks_like_a_mirror("a.yaml", VIEW), "camera: str, expected a tiltvp.Camera"),
        (lambda: looks_like_a_mirror(CAMERA, 2.0), "view: float, expected what field_of_view measures"),
        (lambda: about_vertical(np.inf), "angle_rad = inf, expected radians"),
        (lambda: tiltvp.find_setup(FRAMES, CAMERA, 3), "motions: int, expected several Motion or None"),
        (lambda: tiltvp.find_setup(FRAMES, CAMERA, wheels=[]), "wheels: list, expected tiltvp.streams.Wheels"),
        (lambda: tiltvp.find_setup(FRAMES, CAMERA, topics=[]), "topics: list, expected a dict"),
        (lambda: next(FRAMES.sample(3)), "numbers: int, expected several numbers of frames"),
        (lambda: next(FRAMES.sample([-1])), "numbers: -1, expected whole numbers from 0 below 0"),
        (lambda: convergence_table(3), "estimates: int, expected several MountingEstimate"),
        (lambda: tiltvp.Extrinsics.of(LOGS, 3), "tilt: int, expected a JoinedTilts, MountingTilt or Robot"),
        (lambda: tiltvp.Extrinsics.of(LOGS).robot(CAMERA), "robot: Camera, expected a tiltvp.Robot"),
        (lambda: tiltvp.Extrinsics.of(LOGS).transform(child=""), "child = '', expected the name of a frame"),
        (lambda: transform(sigmas=3), "sigmas: int, expected several pair"),
        (lambda: transform(missing="z"), "missing = 'z', expected a tuple of x, y, z"),
        (lambda: transform(covariance=np.eye(3)), r"covariance: shape \(3, 3\), expected \(5, 5\)"),
        (lambda: outputs.write_tilts("a.mcap", [0.0], [ESTIMATE], frame=3), "frame: int, expected the name of a frame"),
        (lambda: outputs.write_tilts("a.tum", [0.0], [ESTIMATE], topic=None), "topic: NoneType, expected the name"),
        (lambda: read_odometry("odometry.csv", read_as=None), "read_as: NoneType, expected names of conventions"),
        (lambda: CameraSpec("equidistant", 8, 8, None).check(), "parameters: NoneType, expected a dict"),
        (lambda: CameraSpec("equidistant", 8, 8, {}, mirror="no").check(), "mirror = 'no', expected True or False"),
        (lambda: StereoRig.load("a.toml", image_size="x"), "image_size = 'x', expected .width, height. in pixels"),
        (lambda: LiveCamera(True), "number = True, expected the number of a camera"),
        (lambda: tiltvp.Camera("equidistant", width=8, height=8, mirror=None), "mirror = None, expected True or False"),
        (lambda: zed_cameras([1280]), r"width = \[1280\], expected a number"),
        (lambda: Drive(None, camera=CAMERA), "room: NoneType, expected a tiltvp.synth.Room"),
        (lambda: Drive(Room("office", 1), camera=3), "camera: int, expected a tiltvp.Camera"),
        (lambda: StereoSequence(Room("office", 1), left=CAMERA, right=3), "right: int, expected a tiltvp.Camera"),
        (
            lambda: Room("office", 1).straight_edges(None, pose=np.zeros(3)),
            "camera: NoneType, expected a tiltvp.Camera",
        ),
        (lambda: Room("office", 1).free_poses(2**31, 1), "count: got 2147483648, expected at most 1000000 places"),
        (lambda: lines.match_wide(LINES, FEW, 3, FEW), "lines_b: int, expected Lines"),
        (lambda: lines.LineTracker().update(None, FEW), "lines: NoneType, expected Lines"),
        (lambda: SEGMENTS.pixels(1.5), "index = 1.5, expected a whole number"),
        (lambda: CORNERS.of(-1), "corner = -1, expected a number below 1"),
        (lambda: corner.resolve([FEATURE], alignment=3), "alignment: got 3, expected one of same, manhattan, vertical"),
        (
            lambda: corner.resolve([FEATURE], common_from_camera=3),
            "common_from_camera: int, expected several rotations",
        ),
        (lambda: corner.poses(FEATURE, FEATURE, np.eye(4), fuse=1), "fuse = 1, expected True or False"),
    ],
)
def test_what_is_of_another_kind_is_named(call: Any, told: str) -> None:
    with pytest.raises(InvalidInputError, match=f"^{told}"):
        call()


def test_times_far_beyond_a_record_are_outside() -> None:
    assert ODOMETRY.at([-1e308, 0.5, 1e308, np.nan]).outside.tolist() == [True, False, True, True]


@pytest.mark.parametrize("word", [None, 3, b"refined", "", object])
@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda word: tiltvp.TiltEstimator(CAMERA, method=word), '"refined", "image-space-ransac"'),
        (lambda word: lines.LineExtractor(CAMERA, method=word), '"great-circle" or "radial"'),
        (lambda word: corner.CornerDetector(CAMERA, method=word), '"coloured", "general" or "paper"'),
        (lambda word: corner.CornerPoseEstimator(CAMERA, method=word or ""), '"coloured", "general" or "paper"'),
        (lambda word: tiltvp.Camera(word, width=3, height=3), "expected one of: .*equidistant"),
        (lambda word: Room(word, 1), "office"),
        (lambda word: simulate_drive(word), "paper"),
    ],
)
def test_what_is_no_word_is_told_the_words(call: Any, expected: str, word: Any) -> None:
    with pytest.raises(TiltvpError, match=expected):
        call(word)


@pytest.mark.parametrize("value", ["a", 3, None, []])
def test_what_is_no_dict_is_named(value: Any) -> None:
    for made in (tiltvp.Camera, lines.Lines):
        with pytest.raises(InvalidInputError, match=rf"values: {type(value).__name__}, expected a dict"):
            made.from_dict(value)


def test_descriptors_of_another_kind_are_told_which() -> None:
    with pytest.raises(
        InvalidInputError, match=r"a: shape \[2, 192\] of float64, expected an \(N, K\) array of float32"
    ):
        lines.match(np.zeros((2, 192)), np.zeros((2, 192)))  # type: ignore[arg-type]


def test_numbers_between_other_bytes_are_numbers() -> None:
    """As fields of a table of records are, which no address is a multiple of their size."""
    records = np.zeros(3, np.dtype([("name", "u1"), ("ray", "f8", 3), ("bearing", "f8"), ("values", "f4", 192)]))
    rng = np.random.default_rng(1)
    for name in ("ray", "bearing", "values"):
        records[name] = rng.uniform(0.1, 1.0, records[name].shape)
        assert not records[name].flags.aligned
    plain = {name: records[name].copy() for name in ("ray", "bearing", "values")}
    np.testing.assert_array_equal(CAMERA.project(records["ray"]), CAMERA.project(plain["ray"]))
    assert EXTRACTOR.lines_at(records["bearing"]) == EXTRACTOR.lines_at(plain["bearing"])
    np.testing.assert_array_equal(lines.match(records["values"], plain["values"])[:, 0], range(3))

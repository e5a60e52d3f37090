"""Pictures of the guides, of rooms that the package renders: `just pictures` writes them into docs/images."""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

import tiltvp
import tiltvp.cli
from tiltvp.corner import CornerPoseEstimator
from tiltvp.lab.datasets.driving import drive_room
from tiltvp.lab.datasets.recording import WHEEL_RADIUS_M, RecordedDrive
from tiltvp.lines import LineExtractor, match_wide
from tiltvp.overlays.corners import EDGE_COLOURS, draw_box, draw_corners
from tiltvp.overlays.lines import draw_lines, line_pixels, track_colour
from tiltvp.overlays.offsets import error_chart
from tiltvp.overlays.tilt import draw_words, tilt_overlay
from tiltvp.rotations import levelling as levelling_rotation
from tiltvp.segments import SegmentDetector
from tiltvp.streams import Wheels, frame_motions, open_frames
from tiltvp.synth import MIRROR_BLIND_RAD, Laboratory, Room, StereoSequence, mirror_camera, zed_cameras

IMAGES = Path(__file__).parent / "images"


def fisheye(cx: float, cy: float) -> tiltvp.Camera:
    """A lens that sees somewhat more than a half of all directions."""
    return tiltvp.Camera.equidistant(
        width=360, height=360, focal_px=110.0, cx=cx, cy=cy, max_theta_rad=math.radians(92.5)
    )


ALPHA_RAD, BETA_RAD = math.radians(12.0), math.radians(40.0)
FISHEYE = fisheye(179.5, 179.5)
PINHOLE = tiltvp.Camera.pinhole(width=480, height=360, fx=240.0, fy=240.0, cx=239.5, cy=179.5)
FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def main(names: Sequence[str]) -> None:
    """Those of these names, all without any."""
    room = Room("living-room", 5)
    pose = room.free_poses(1, 5)[0]
    makers = {
        "lenses": lambda: lenses(room, pose),
        "level": lambda: levelling(room, pose),
        "lens": lambda: checked_lens(room),
        "corner": corners,
        "facade": facades,
        "colmap": lambda: gravity(room, pose),
        "datasets": lambda: known_leans(room, pose),
        "recordings": recording,
        "lines": found_lines,
        "wide": matched_wide,
        "many": many_images,
    }
    for name in names or makers:
        makers[name]()


def lenses(room: Room, pose: np.ndarray) -> None:
    """One place through four lenses."""
    mirror = room.render(mirror_camera(), pose=pose, camera_height_m=1.2, samples=2).bgr
    rows, columns = np.mgrid[0 : mirror.shape[0], 0 : mirror.shape[1]]
    away = mirror_camera().unproject(np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float))[:, 2]
    mirror[np.reshape(np.abs(away) > math.cos(MIRROR_BLIND_RAD), rows.shape)] = 0
    pictures = {
        "pinhole": room.render(PINHOLE, pose=pose, robot_from_camera=FORWARD, camera_height_m=1.2, samples=2).bgr,
        "equidistant": room.render(FISHEYE, pose=pose, camera_height_m=1.2, samples=2).bgr,
        "unified, in a mirror": cv2.resize(mirror, (480, 360), interpolation=cv2.INTER_AREA),
        "equirectangular": room.render_panorama(pose=pose, height=360, camera_height_m=1.2, samples=2).bgr,
    }
    write("lenses.jpg", [draw_words(picture, name) for name, picture in pictures.items()])


def levelling(room: Room, pose: np.ndarray) -> None:
    """A leaning view, and what two levellers make of it."""
    estimator = tiltvp.TiltEstimator(FISHEYE, method="segments")
    image = room.render(FISHEYE, pose=pose, alpha_rad=ALPHA_RAD, beta_rad=BETA_RAD, samples=2).bgr
    estimate = estimator(image)
    assert tiltvp.tilt_error_rad(estimate.normal, tiltvp.normal_from_alpha_beta(ALPHA_RAD, BETA_RAD)) < 0.01
    panorama = tiltvp.Leveller(FISHEYE, to="panorama", size=(720, 360))
    pictures = {
        "leaning by 12 degrees": image,
        'level, to="same"': tiltvp.Leveller(FISHEYE)(image, estimate),
        'level, to="panorama"': panorama(image, estimate),
    }
    write("level.jpg", [draw_words(picture, name) for name, picture in pictures.items()])


def checked_lens(room: Room) -> None:
    """An image as a panorama by a lens whose centre is told wrong, and by the one that `check_lens` makes of it."""
    images = [room.render(FISHEYE, pose=pose, samples=2).bgr for pose in room.free_poses(5, 5)]
    told = fisheye(189.5, 172.5)
    found = tiltvp.check_lens([cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images], told)
    assert not found
    du, dv = found.centre_off_px
    cameras = {"centre as told": told, f"moved by {du:.1f}, {dv:.1f} px": fisheye(189.5 + du, 172.5 + dv)}
    rows = []
    for name, camera in cameras.items():
        panorama = tiltvp.Leveller(camera, to="panorama", size=(1080, 540))(images[0], (0.0, 0.0, 1.0))
        rows.append(draw_words(panorama[70:280], name))
    write("lens.jpg", [np.vstack(rows)])


def corners() -> None:
    """The coloured cuboid before a pair of cameras, as the left one sees it, with the rays and the imaginary box."""
    left, right = zed_cameras()
    sequence = StereoSequence(Laboratory(3), left=left, right=right, frames=6, seed=3)
    pictures = sequence.render(0)
    estimate = CornerPoseEstimator(left, right, sequence.left_from_right)(*pictures)
    assert estimate.pose is not None
    canvas = draw_corners(pictures[0], left, estimate.features_left, estimate.chosen_left)
    draw_box(canvas, left, estimate.pose.vertex_m, estimate.pose.edges)
    u, v = (round(place) for place in left.project(estimate.pose.vertex_m))
    part = (slice(max(v - 160, 0), v + 160), slice(max(u - 240, 0), u + 240))
    write("corner.jpg", [pictures[0][part], canvas[part]])


def facades() -> None:
    """Fronts of houses, and what one camera that knows a vertical makes of them: a corner, and edges by their axis."""
    room = Room("yard", 1)
    camera = tiltvp.Camera.pinhole(width=1280, height=720, fx=700.0, fy=700.0, cx=639.5, cy=359.5)
    up = np.array([0.0, -math.cos(0.25), math.sin(0.25)])
    mounting = levelling_rotation(FORWARD @ up) @ FORWARD
    place = room.free_poses(2, 1)[1]
    image = room.render(camera, pose=place, robot_from_camera=mounting, camera_height_m=1.6, samples=3).bgr
    estimate = CornerPoseEstimator(camera, method="general")(image, gravity=(-up, 0.01))
    assert estimate.pose is not None
    canvas = image.copy()
    segments = SegmentDetector(camera)(image)
    sines = np.abs(segments.normal @ estimate.pose.camera_from_object)
    for ends, sine in zip(segments.ends, sines, strict=True):
        if sine.min() < math.sin(math.radians(2.0)):
            pixels = [tuple(round(place) for place in camera.project(end)) for end in ends]
            cv2.line(canvas, *pixels, EDGE_COLOURS[int(sine.argmin())], 2, cv2.LINE_AA)
    u, v = (round(place) for place in camera.project(estimate.features_left[estimate.chosen_left[0]].vertex))
    cv2.circle(canvas, (u, v), 14, (0, 255, 255), 3, cv2.LINE_AA)
    write("facade.jpg", [cv2.resize(picture, (640, 360), interpolation=cv2.INTER_AREA) for picture in (image, canvas)])


def gravity(room: Room, pose: np.ndarray) -> None:
    """A photograph that leans, with the edges and the horizon that its gravity is known by, and level."""
    estimator = tiltvp.TiltEstimator(PINHOLE, method="segments", robot_from_camera=FORWARD)
    view = {"pose": pose, "robot_from_camera": FORWARD, "camera_height_m": 1.2, "samples": 2}
    image = room.render(PINHOLE, alpha_rad=ALPHA_RAD, beta_rad=BETA_RAD, **view).bgr
    estimate, edges = estimator.with_edges(image)
    assert estimate
    assert tiltvp.tilt_error_rad(estimate.normal, tiltvp.normal_from_alpha_beta(ALPHA_RAD, BETA_RAD)) < 0.01
    pictures = {
        "a photograph": image,
        "vertical edges and horizon": tilt_overlay(image, estimator, estimate, edges),
        "level": tiltvp.level(image, estimator, estimate),
    }
    write("colmap.jpg", [draw_words(picture, name) for name, picture in pictures.items()])


def found_lines() -> None:
    """What `tilt.c` prints of an image, drawn over it: the tilt, then the lines that are vertical by it."""
    room = drive_room("corridor", 0)
    pose = room.free_poses(1, 5)[0]
    image = room.render(FISHEYE, pose=pose, alpha_rad=ALPHA_RAD, beta_rad=BETA_RAD, samples=2).bgr
    estimator = tiltvp.TiltEstimator(FISHEYE, method="segments")
    estimate, edges = estimator.with_edges(image)
    assert estimate
    lines = LineExtractor(FISHEYE)(image, estimate)
    pictures = {
        "a leaning image": image,
        "its tilt": tilt_overlay(image, estimator, estimate, edges),
        "its vertical lines": draw_lines(image, FISHEYE, lines),
    }
    write("c.jpg", [draw_words(picture, name) for name, picture in pictures.items()])


def matched_wide() -> None:
    """The lines that two images a metre and a half apart have in common, one colour and number for each."""
    room = drive_room("corridor", 8301)
    camera = FISHEYE.scaled(4.0 / 3.0)
    places = room.free_poses(12, 5)[:, :2]
    apart = np.linalg.norm(places[:, None] - places, axis=-1)
    first, second = np.unravel_index(np.argmin(np.abs(apart - 1.5)), apart.shape)
    extractor = LineExtractor(camera, descriptor_kind="profile")
    images = [room.render(camera, pose=(*places[k], 0.0), samples=2).bgr for k in (first, second)]
    lines = [extractor(image) for image in images]
    described = [extractor.describe(image, seen) for image, seen in zip(images, lines, strict=True)]
    pairs, confidences = match_wide(lines[0], described[0], lines[1], described[1])
    words = f"{len(pairs)} lines in common, confidence {confidences.min():.2f} or more"
    pictures = []
    for side, (image, seen) in enumerate(zip(images, lines, strict=True)):
        picture = np.array(image // 2)
        pixels = line_pixels(camera, seen)
        for name, pair in enumerate(pairs):
            curve = pixels[pair[side]][np.isfinite(pixels[pair[side]]).all(axis=1)]
            points = np.rint(curve * 16.0).astype(np.int32).reshape(-1, 1, 2)
            cv2.polylines(picture, [points], False, track_colour(name), 2, cv2.LINE_AA, shift=4)
            at = (round(float(curve[-1, 0])), round(float(curve[-1, 1])))
            cv2.putText(picture, str(name), at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, track_colour(name), 1, cv2.LINE_AA)
        pictures.append(draw_words(picture, words if side == 0 else f"{apart[first, second]:.1f} m from there"))
    write("lines-wide.jpg", pictures)


def many_images() -> None:
    """Views of several places, each with a lean of its own, above; and the same made level, below."""
    camera = FISHEYE.scaled(1.0 / 3.0)
    estimator, leveller = tiltvp.TiltEstimator(camera, method="segments"), tiltvp.Leveller(camera)
    rng = np.random.default_rng(0)
    columns = []
    for kind in ("office", "living-room", "corridor"):
        room = Room(kind, 2)
        for pose in room.free_poses(4, 2):
            lean = {"alpha_rad": math.radians(rng.uniform(5.0, 15.0)), "beta_rad": rng.uniform(-math.pi, math.pi)}
            image = room.render(camera, pose=pose, samples=3, **lean).bgr
            columns.append(np.vstack([image, leveller(image, estimator(image))]))
    write("many.jpg", columns)


def known_leans(room: Room, pose: np.ndarray) -> None:
    """One place at four leans, and how far each method is off in the median of them, as bars."""
    leans_deg = ((0.0, 0.0), (4.0, 0.0), (8.0, 90.0), (12.0, 200.0))
    camera = FISHEYE.scaled(2.0 / 3.0)
    images, errors = [], {method: [] for method in tiltvp.METHODS}
    for alpha_deg, beta_deg in leans_deg:
        lean = math.radians(alpha_deg), math.radians(beta_deg)
        image = room.render(camera, pose=pose, alpha_rad=lean[0], beta_rad=lean[1], samples=2).bgr
        images.append(draw_words(image, f"alpha {alpha_deg:g}, beta {beta_deg:g} deg"))
        for method, found in errors.items():
            estimate = tiltvp.TiltEstimator(camera, method=method)(image)
            found.append(math.degrees(tiltvp.tilt_error_rad(estimate.normal, tiltvp.normal_from_alpha_beta(*lean))))
    write("datasets.jpg", images)
    bars = [(method, float(np.median(found))) for method, found in errors.items()]
    write("evaluation.png", [error_chart((260, 600), bars)])


def recording() -> None:
    """Frames of a recording with what its wheels tell, and the filtered tilt of its frames beside that of each."""
    camera = FISHEYE.scaled(2.0 / 3.0)
    with tempfile.TemporaryDirectory() as folder:
        path, known, answers = (Path(folder) / name for name in ("drive.mcap", "camera.toml", "tilts.mcap"))
        legs, bumps = ((0.0, math.pi), (0.6, 0.5)), math.radians(3.0)
        RecordedDrive(drive_room("office", 0), camera, legs=legs, bumps_max_rad=bumps, samples=1).write(path)
        camera.save(known)
        frames = open_frames(path)
        motions = frame_motions(frames, path, wheels=Wheels(wheel_base_m=0.35, wheel_radius_m=WHEEL_RADIUS_M)).motions
        shown = [round(share * (len(motions) - 1)) for share in (0.1, 0.35, 0.6, 0.95)]
        images = []
        for number, frame in zip(shown, frames.sample(shown), strict=True):
            yaw = math.degrees(sum(motion.yaw_rad for motion in motions[: number + 1]))
            way = sum(motion.distance_m for motion in motions[: number + 1])
            seconds = frame.time_s - frames.times_s[0]
            images.append(draw_words(bgr_from(frame.read()), f"{seconds:.1f} s: {yaw:.0f} deg, {way:z.2f} m"))
        write("recordings.jpg", images)
        wheels = ["--wheel-base", "0.35", "--wheel-radius", f"{WHEEL_RADIUS_M:g}"]
        plot = ["--filter-plot", str(IMAGES / "outputs.png"), "--out", str(answers), "--overwrite"]
        words = ["tilt", str(path), "--camera", str(known), "--method", "segments", "--filter", *wheels, *plot]
        assert tiltvp.cli.main(words) == 0


def bgr_from(image: np.ndarray) -> np.ndarray:
    """(H, W, 3) of a gray image."""
    return image if image.ndim == 3 else np.dstack([image] * 3)


def write(name: str, pictures: list[np.ndarray]) -> None:
    """Pictures side by side."""
    IMAGES.mkdir(exist_ok=True)
    cv2.imwrite(str(IMAGES / name), np.hstack(pictures), [cv2.IMWRITE_JPEG_QUALITY, 75])


if __name__ == "__main__":
    main(sys.argv[1:])

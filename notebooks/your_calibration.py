# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Your calibration
#
# A calibration file is read as it is, measured, and asked whether it fits the pictures: the wrong mounting and a
# mirror that nobody told of are the mistakes that no single estimate can see.

# %%
import math
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import tiltvp
from tiltvp.field_of_view import field_of_view, looks_like_a_mirror
from tiltvp.synth import Room, mirror_camera

# %% [markdown]
# ## Load it
#
# This is a file of OpenCV's fisheye calibration; `tiltvp camera formats` lists the others. A number that cannot be is
# refused, with the place.

# %%
text = """%YAML:1.0
image_width: 640
image_height: 480
distortion_model: fisheye
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 139.7, 0., 319.5, 0., 139.7, 239.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ -0.002, 0.0004, 0., 0. ]
"""
folder = Path(tempfile.mkdtemp())
(folder / "calibration.yaml").write_text(text)
camera = tiltvp.Camera.load(folder / "calibration.yaml", format="opencv-fisheye")
print(camera)

(folder / "broken.yaml").write_text(text.replace("139.7, 0., 319.5", "-139.7, 0., 319.5"))
try:
    tiltvp.Camera.load(folder / "broken.yaml", format="opencv-fisheye")
except tiltvp.errors.TiltvpError as error:
    print(error)
else:
    raise AssertionError("a negative focal length was taken")

# %% [markdown]
# ## How much it sees

# %%
view = field_of_view(camera)
wide_deg, high_deg = math.degrees(view.horizontal_rad), math.degrees(view.vertical_rad)
print(f"{wide_deg:.0f} x {high_deg:.0f} degrees, axis at {view.axis_px}")
assert 250.0 < wide_deg < 275.0, f"{wide_deg:.0f} degrees wide"
assert view.valid_share > 0.9, f"a share of {view.valid_share:.2f} of the pixels sees something"

pixels = np.column_stack([np.linspace(0.0, 639.0, 200), np.full(200, 239.5)])
bearings = camera.unproject(pixels)
figure, axis = plt.subplots(figsize=(6, 3), layout="constrained")
axis.plot(pixels[:, 0], np.degrees(np.arctan2(bearings[:, 0], bearings[:, 2])))
axis.set(xlabel="column, pixels", ylabel="angle from the axis, degrees", title="one row of the image")
axis.grid(alpha=0.3)
round_trip_px = float(np.abs(camera.project(bearings) - pixels).max())
assert round_trip_px < 1e-9, f"pixels come back {round_trip_px:.1e} px off"

# %% [markdown]
# ## Does the camera sit as it is said to?
#
# Five pictures of different places are rendered through a camera that looks *ahead*. Told that it looks up,
# `check_setup` says no.

# %%
AHEAD = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
UP = np.eye(3)
pinhole = tiltvp.Camera.pinhole(width=640, height=480, fx=320.0, fy=320.0, cx=319.5, cy=239.5)
kinds = ["office", "corridor", "living-room", "l-shaped", "narrow"]
rooms = [Room(kind, seed, light_spacing_m=1.0) for seed, kind in enumerate(kinds)]
view = {"robot_from_camera": AHEAD, "camera_height_m": 1.2, "samples": 2}
pictures = [room.render(pinhole, pose=room.free_poses(1, 0)[0], **view).bgr for room in rooms]
told_right = tiltvp.check_setup(pictures, pinhole, AHEAD)
told_wrong = tiltvp.check_setup(pictures, pinhole, UP)
print(told_right.reason)
print(told_wrong.reason)
assert told_right, told_right.reason
assert not told_wrong, "a wrong mounting is believed"
assert told_wrong.best == "-y", f"the camera is said to see up along {told_wrong.best}"

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.2), layout="constrained")
left.imshow(pictures[2][:, :, ::-1])
left.set(title="one of the pictures", xticks=[], yticks=[])
right.bar(list(told_right.probabilities), list(told_right.probabilities.values()))
_ = right.set(title="which direction of the camera is up", ylabel="probability", ylim=(0, 1))

# %% [markdown]
# ## A mirror
#
# A camera that looks into a mirror sees the world reflected, and no rotation replaces that: `mirror=True` does. A
# calibration cannot say so itself, but its field of view gives it away.

# %%
mirror = mirror_camera()
unsaid = tiltvp.Camera.unified(
    width=640, height=480, xi=0.95, fx=136.0, fy=136.0, cx=319.5, cy=239.5, max_theta_rad=math.radians(115.0)
)
for name, one in {"the pinhole": pinhole, "the mirror, as it is": mirror, "the mirror, unsaid": unsaid}.items():
    sees = field_of_view(one)
    told = looks_like_a_mirror(one, sees)
    print(f"{name}: {math.degrees(sees.horizontal_rad):.0f} degrees, looks like a mirror that is not said: {told}")
    assert told == (one is unsaid), f"{name}: {told}"

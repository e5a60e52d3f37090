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
# # Level a 360-degree photo
#
# A 360-degree camera held askew makes a panorama with a wavy horizon. Its straight edges tell where up is, and the
# panorama is turned level. The equirectangular lens needs no calibration: its size says all.

# %%
import math

import cv2
import matplotlib.pyplot as plt
import numpy as np

import tiltvp
from tiltvp.synth import Room

AHEAD = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
camera = tiltvp.Camera.equirectangular(width=1024, height=512)
room = Room("living-room", 5, light_spacing_m=0.5)
pose = room.free_poses(1, 2)[0]
upright = room.render_panorama(pose=pose, height=camera.height, camera_height_m=1.4, noise_sigma=2.0, samples=2, seed=1)

# %% [markdown]
# The panorama is turned by a known lean of 20 degrees. `level` turns the other way round if it is given the lean of
# the other side, so here it stands in for the hand that holds the camera.

# %%
lean = math.radians(20.0), math.radians(35.0)
askew = tiltvp.level(upright.bgr, camera, (lean[0], lean[1] - math.pi), AHEAD)

# %% [markdown]
# ## Find up
#
# With `tilt_max_rad` above 20 degrees the method `segments` looks for the vertical anywhere, and says how probable
# each direction is.

# %%
estimator = tiltvp.TiltEstimator(camera, method="segments", robot_from_camera=AHEAD, tilt_max_rad=math.radians(60.0))
estimate = estimator(askew)
truth = tiltvp.normal_from_alpha_beta(*lean)
error_deg = math.degrees(tiltvp.tilt_error_rad(estimate.normal, truth))
alpha_deg = math.degrees(estimate.alpha_rad)
print(f"leans by {alpha_deg:.1f} degrees, confidence {estimate.confidence:.2f}: {estimate.reason}")
print(f"the error is {error_deg:.2f} degrees")
assert estimate, estimate.reason
assert error_deg < 1.0, f"the lean is {error_deg:.2f} degrees off"

# %% [markdown]
# ## Turn it level

# %%
level = tiltvp.level(askew, estimator, estimate)
figure, axes = plt.subplots(2, 1, figsize=(9, 9.2), layout="constrained")
for axis, picture, title in zip(axes, (askew, level), ("as it was taken", "level"), strict=True):
    axis.imshow(picture[:, :, ::-1])
    axis.axhline(0.5 * (camera.height - 1), color="white", linewidth=0.6)
    axis.set(title=title, xticks=[], yticks=[])

again = estimator(level)
left_deg = math.degrees(again.alpha_rad)
print(f"{left_deg:.2f} degrees are left")
assert left_deg < 1.0, f"the level photo leans by {left_deg:.2f} degrees"

# %% [markdown]
# The level panorama is the one that was rendered, but for what two resamplings have blurred:

# %%
small = [cv2.GaussianBlur(picture, None, 3.0).astype(float) for picture in (upright.bgr, level, askew)]
inside = np.s_[60:-60, 20:-20]
levelled, crooked = (float(np.abs(other[inside] - small[0][inside]).mean()) for other in small[1:])
print(f"mean difference: {levelled:.1f} grey levels, before {crooked:.1f}")
assert levelled < 0.3 * crooked, "the level photo is not like the upright one"

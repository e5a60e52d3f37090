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
# # Five minutes
#
# A rendered room, the lean of the robot that sees it, the picture made level, and a picture that tells nothing.

# %%
import math

import matplotlib.pyplot as plt

import tiltvp

camera = tiltvp.Camera.equidistant(width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5)
room = tiltvp.synth.render_room(camera, kind="office", seed=1, alpha_rad=math.radians(4.0), beta_rad=0.5)

# %% [markdown]
# An upward fisheye sees doors, shelves and walls as lines that run to one point, the vertical. Estimating makes the
# tables of the camera once; each image then takes less than a millisecond.

# %%
estimator = tiltvp.TiltEstimator(camera)
estimate = estimator(room.gray)
sigma_deg = [math.degrees(math.sqrt(variance)) for variance in estimate.covariance_rad2.diagonal()]
print(f"leans by {math.degrees(estimate.alpha_rad):.2f} degrees towards {math.degrees(estimate.beta_rad):.0f} degrees,")
print(f"known to {max(sigma_deg):.2f} degrees, confidence {estimate.confidence:.2f}: {estimate.reason}")

truth = tiltvp.normal_from_alpha_beta(room.alpha_rad, room.beta_rad)
error_deg = math.degrees(tiltvp.tilt_error_rad(estimate.normal, truth))
print(f"the error is {error_deg:.2f} degrees")
assert estimate, estimate.reason
assert error_deg < 0.5, f"the tilt is {error_deg:.2f} degrees off"

# %% [markdown]
# ## What it saw, and the picture made level

# %%
_, edges = estimator.with_edges(room.gray)
level = tiltvp.level(room.bgr, estimator, estimate)
pictures = {
    "the robot's view": room.bgr,
    "edge pixels that agree": tiltvp.draw_edges(room.gray, edges, only="inlier"),
    "made level": level,
}
figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), layout="constrained")
for axis, (title, picture) in zip(axes, pictures.items(), strict=True):
    axis.imshow(picture[:, :, ::-1])
    axis.set(title=title, xticks=[], yticks=[])

# %% [markdown]
# The level picture leans no more:

# %%
again = estimator(level)
print(f"{math.degrees(again.alpha_rad):.2f} degrees are left")
assert math.degrees(again.alpha_rad) < 0.5, f"the level picture leans by {math.degrees(again.alpha_rad):.2f} degrees"

# %% [markdown]
# ## An image that tells nothing
#
# A picture without edges has an estimate that is false and says why. Nothing is returned in its place.

# %%
wall = estimator(room.gray * 0 + 128)
print(bool(wall), wall.reason)
assert not wall, "a picture without edges has a tilt"
assert math.isnan(wall.alpha_rad), "an estimate that is false has an angle"
assert wall.confidence == 0.0, "an estimate that is false is confident"

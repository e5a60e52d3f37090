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
# # A leaning drive
#
# A robot drives in circles over a floor that slopes by two degrees, and its camera sits one degree askew. Each image
# tells its lean, a filter fuses them with the odometry, and what belongs to the floor is told apart from what belongs
# to the robot.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np

import tiltvp
from tiltvp.synth import Room

FRAMES, TURN_RAD, STEP_M = 48, math.radians(15.0), 0.1
RADIUS_M = STEP_M / TURN_RAD
floor_in_world = tiltvp.normal_from_alpha_beta(math.radians(2.0), 0.8)
mounting = tiltvp.normal_from_alpha_beta(math.radians(1.0), -2.0)

camera = tiltvp.Camera.equidistant(width=320, height=320, focal_px=97.0, cx=159.5, cy=159.5, max_theta_rad=1.61)
room = Room("office", 3, light_spacing_m=0.5)
x_m, y_m, yaw_rad = room.free_poses(1, 8)[0]


# %%
def smallest_turn(direction):
    """(3, 3): the smallest rotation that takes z to a unit vector."""
    x, y, z = direction
    return np.array(
        [[1 - x * x / (1 + z), -x * y / (1 + z), x], [-x * y / (1 + z), 1 - y * y / (1 + z), y], [-x, -y, z]]
    )


truth, floors, pictures = [], [], []
for frame in range(FRAMES):
    heading = yaw_rad + frame * TURN_RAD
    c, s = math.cos(heading), math.sin(heading)
    floor = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ floor_in_world
    normal = smallest_turn(mounting) @ floor
    lean = math.acos(normal[2]), math.atan2(-normal[1], -normal[0])
    place = x_m + RADIUS_M * s, y_m - RADIUS_M * c, heading
    view = room.render(camera, pose=place, alpha_rad=lean[0], beta_rad=lean[1], samples=1, seed=frame)
    truth.append(normal)
    floors.append(floor)
    pictures.append(view)

# %% [markdown]
# ## Image by image, and filtered

# %%
estimator = tiltvp.TiltEstimator(camera, method="segments")
tilt_filter = tiltvp.TiltFilter(estimate_mounting=True)


def degrees_between(answer, true):
    """NaN where there is no answer."""
    return math.degrees(tiltvp.tilt_error_rad(answer.normal, true)) if answer else math.nan


rows = []
for frame, view in enumerate(pictures):
    estimate = estimator(view.gray)
    step = tilt_filter.step(estimate, yaw_rad=TURN_RAD if frame else 0.0, distance_m=STEP_M if frame else 0.0)
    rows.append(
        (
            degrees_between(estimate, truth[frame]),
            degrees_between(tilt_filter.estimate, truth[frame]),
            degrees_between(tilt_filter.floor, floors[frame]),
            degrees_between(tilt_filter.mounting, mounting),
        )
    )
alone, filtered, floor, own = np.array(rows).T
print(f"median error, degrees: images {np.nanmedian(alone):.2f}, filtered {np.nanmedian(filtered):.2f}")
print(f"at the end: floor {floor[-1]:.2f}, mounting {own[-1]:.2f}")
print(tilt_filter.mounting.reason)

figure, axis = plt.subplots(figsize=(8, 3.4), layout="constrained")
for name, errors in {"each image": alone, "filtered": filtered, "floor alone": floor, "mounting alone": own}.items():
    axis.plot(errors, label=name)
axis.set(xlabel="frame, each a turn of 15 degrees", ylabel="error, degrees", ylim=(0, None))
axis.grid(alpha=0.3)
axis.legend()

assert np.isfinite(alone).mean() > 0.9, "more than one frame in ten has no tilt"
assert np.nanmedian(filtered) < np.nanmedian(alone), "the filter is no better than single images"
assert floor[-1] < 0.7, f"the floor is {floor[-1]:.2f} degrees off at the end"
assert own[-1] < 0.7, f"the mounting is {own[-1]:.2f} degrees off at the end"

# %% [markdown]
# Before the robot has turned nothing tells floor and mounting apart, and neither is answered:

# %%
standing = tiltvp.TiltFilter(estimate_mounting=True)
for view in pictures[:1] * 5:
    standing.step(estimator(view.gray))
print(bool(standing.estimate), bool(standing.floor), bool(standing.mounting))
assert standing.estimate, "the filter tells no tilt"
assert not standing.floor, "floor and mounting were told apart without a turn"
assert not standing.mounting, "floor and mounting were told apart without a turn"

# %% [markdown]
# ## Level pictures

# %%
chosen = [0, 6, 12, 18]
figure, axes = plt.subplots(2, len(chosen), figsize=(12, 4.8), layout="constrained")
for column, frame in zip(axes.T, chosen, strict=True):
    view = pictures[frame]
    level = tiltvp.level(view.bgr, estimator, estimator(view.gray))
    for axis, picture, title in zip(column, (view.bgr, level), (f"frame {frame}", "made level"), strict=True):
        axis.imshow(picture[:, :, ::-1])
        axis.set(title=title, xticks=[], yticks=[])
    left = estimator(level)
    assert left, f"frame {frame} made level: {left.reason}"
    assert math.degrees(left.alpha_rad) < 1.0, (
        f"frame {frame} made level still leans by {math.degrees(left.alpha_rad):.2f} degrees"
    )

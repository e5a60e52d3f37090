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
# # Where is my camera?
#
# Wheels and bearings of vertical edges tell where a camera sits on its robot, if the robot moves so that they can.
# First on simulated logs, then from pictures.

# %%
import math
from functools import partial

import matplotlib.pyplot as plt
import numpy as np

import tiltvp
from tiltvp.line_calibration import calibrate_lines
from tiltvp.line_logs import see_lines
from tiltvp.lines import LineExtractor
from tiltvp.streams import Motion
from tiltvp.synth import Drive, Room, drive_legs, simulate_drive

WHEEL_BASE_M = 0.4
mounting = (0.22, -0.08, -0.01)

# %% [markdown]
# ## A motion that does not tell
#
# Straight on alone leaves the distance from the axle open. The answer is false, and says which motion is missing.

# %%
straight = simulate_drive("straight", seed=1, mounting=mounting)
found = tiltvp.calibrate(straight.odometry, straight.bearings, wheel_base_m=WHEEL_BASE_M).mounting
print(bool(found), "-", found.reason)
print("determined:", found.determined)
print("advice:", found.advice)
assert not found, "a straight drive has told the mounting"
assert "rho" not in found.determined, "a straight drive has told rho"

# %% [markdown]
# ## Straight on, then turning

# %%
drive = simulate_drive("paper", seed=1, mounting=mounting)
calibrator = tiltvp.SelfCalibrator(wheel_base_m=WHEEL_BASE_M, start=(0.1, 0.0, 0.0), start_sigma=(0.2, 0.2, 0.6))
told = []
for step, (left_m, right_m) in enumerate(drive.odometry):
    seen = drive.bearings[drive.bearings[:, 0] == step]
    calibrator.step(left_m, right_m, seen[:, 1].astype(int), seen[:, 2])
    now = calibrator.estimate
    sigma = np.sqrt(now.covariance_xy_yaw.diagonal())
    told.append((now.x_m, now.y_m, now.yaw_rad, *sigma, bool(now)))
told = np.array(told, dtype=float)
first = int(np.argmax(told[:, 6] > 0.0))
print(f"to be relied upon from step {first} of {len(told)} on")

figure, axes = plt.subplots(3, 1, figsize=(8, 6), sharex=True, layout="constrained")
for k, (axis, name) in enumerate(zip(axes, ("x, m", "y, m", "yaw, rad"), strict=True)):
    axis.fill_between(range(len(told)), told[:, k] - 3 * told[:, k + 3], told[:, k] + 3 * told[:, k + 3], alpha=0.25)
    axis.plot(told[:, k])
    axis.axhline(mounting[k], color="black", linewidth=0.8)
    axis.axvline(first, color="grey", linestyle=":")
    axis.set(ylabel=name, ylim=(mounting[k] - 0.3, mounting[k] + 0.3))
axes[0].set_title("estimate, three standard deviations, truth; dotted: from here on it can be relied upon")
axes[-1].set_xlabel("step")

final = calibrator.estimate
errors = np.array([final.x_m, final.y_m, final.yaw_rad]) - mounting
print(f"errors: {1e3 * errors[0]:.1f} mm, {1e3 * errors[1]:.1f} mm, {math.degrees(errors[2]):.2f} degrees")
assert final, final.reason
assert 0 < first < len(told) - 1, f"relied upon from step {first} on"
assert (np.abs(errors) < 4 * told[-1, 3:6]).all(), "errors are beyond four standard deviations"

# %% [markdown]
# ## A wheel base that is wrong
#
# The bearings contradict the odometry. The answer is false, and names the cause with a number that would suit.

# %%
wrong = tiltvp.calibrate(drive.odometry, drive.bearings, wheel_base_m=1.3 * WHEEL_BASE_M).mounting
print(wrong.reason)
assert not wrong, "a wrong wheel base is relied upon"
assert wrong.suspect == "wheel_base_m", f"the cause is said to be {wrong.suspect}"
assert abs(wrong.suspect_value / WHEEL_BASE_M - 1.0) < 0.03, f"the base is said to be {wrong.suspect_value:.3f} m"

# %% [markdown]
# ## From pictures
#
# The same from what a camera sees: lean and vertical lines of each image of a rendered drive, and which line is which,
# found together with the mounting. Edges that are points err by 0.02 degrees (docs/calibration.md); tracks of
# fewer than six images are left out.

# %%
camera = tiltvp.Camera.equidistant(width=480, height=480, focal_px=140.0, cx=239.5, cy=239.5, max_theta_rad=1.6)
way = Drive(
    Room("corridor", 5, light_spacing_m=0.5), camera=camera, legs=drive_legs("paper"), seed=2,
    mount=(0.15, -0.1, 0.15, 0.4), samples=1,
)  # fmt: skip
motions = [Motion(yaw_rad=turn, distance_m=metres) for metres, turn in way.motions.tolist()]
estimator = tiltvp.TiltEstimator(camera)
seen = list(
    see_lines(
        (way.render(frame).gray for frame in range(len(way))), LineExtractor(camera), tilt=estimator, motions=motions
    )
)
options = {"wheel_base_m": way.wheel_base_m, "bearing_sigma_rad": math.radians(0.02)}
found = calibrate_lines(seen, partial(tiltvp.calibrate, way.odometry, **options), frames_min=6)
log, whole = found.bearings, found.whole
print(f"{len(way)} images, {len(np.unique(log[:, 1]))} tracks")
print(whole.reason)
errors = np.array([whole.mounting.x_m, whole.mounting.y_m, whole.mounting.yaw_rad]) - way.mount[:3]
print(f"errors: {1e3 * errors[0]:.1f} mm, {1e3 * errors[1]:.1f} mm, {math.degrees(errors[2]):.2f} degrees")
assert whole, whole.reason
assert found.settled, "lines and mounting do not settle"
assert np.abs(errors[:2]).max() < 0.03, f"the place is off by {errors[:2]} m"
assert abs(math.degrees(errors[2])) < 1.0, f"the yaw is {math.degrees(errors[2]):.2f} degrees off"

figure, axis = plt.subplots(figsize=(8, 3.6), layout="constrained")
for track in np.unique(log[:, 1]):
    rows = log[log[:, 1] == track]
    axis.plot(rows[:, 0], np.degrees(rows[:, 2]), ".", markersize=2)
_ = axis.set(xlabel="frame", ylabel="bearing, degrees", title="tracks of vertical lines: straight on, then half a turn")

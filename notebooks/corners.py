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
# # Corners
#
# One corner of a box, one vertical and two horizontal edges, tells the attitude of a camera in closed form, and a
# pair of cameras also the place.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np

from tiltvp import corner
from tiltvp.overlays.corners import draw_box, draw_corners
from tiltvp.synth import Laboratory, StereoSequence, zed_cameras

# %% [markdown]
# ## In closed form
#
# Three rays admit two attitudes of the corner of a box, the outer and the inner corner: the same picture, and both
# are returned.


# %%
def rotation_about(axis, angle):
    """Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


truth = rotation_about((1.0, 0.3, 0.2), 0.9)
vertex = np.array([0.1, -0.05, 1.5])
rays = [vertex + 0.2 * truth[:, k] for k in range(3)]
found = corner.solve(vertex, *rays)
for attitude in found:
    print("mirrored" if attitude.mirrored else "plain", "right-handed" if attitude.right_handed else "left-handed")
nearest = min(np.linalg.norm(attitude.camera_from_object - truth) for attitude in found)
print(f"the nearest is {nearest:.1e} from the truth")
assert nearest < 1e-9, "no hypothesis is the truth"

# %% [markdown]
# ## In images, by a pair of cameras

# %%
left, right = zed_cameras()
sequence = StereoSequence(Laboratory(3), left=left, right=right, frames=6, seed=3)
estimator = corner.CornerPoseEstimator(left, right, sequence.left_from_right)
estimates, angles_deg, places_mm, squares = [], [], [], []
for frame in range(len(sequence)):
    pictures = sequence.render(frame)
    estimate = estimator(*pictures)
    estimates.append(estimate)
    if not estimate:
        print(frame, estimate.reason)
        continue
    true = sequence.left_from_object(frame)
    turn = estimate.pose.camera_from_object @ true[:3, :3].T
    # Of the small rotation from the estimate to the truth.
    off = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    error = np.concatenate([-off, true[:3, 3] - estimate.pose.vertex_m])
    squares.append(error @ np.linalg.solve(estimate.pose.covariance, error))
    angles_deg.append(math.degrees(np.linalg.norm(off)))
    places_mm.append(1e3 * np.linalg.norm(error[3:]))
angle_deg, place_mm = np.median(angles_deg), np.median(places_mm)
print(f"{len(angles_deg)} of {len(sequence)} frames, {angle_deg:.3f} degrees, {place_mm:.2f} mm")
assert len(angles_deg) == len(sequence), "frames without a pose"
assert max(angles_deg) < 0.5, f"an attitude is {max(angles_deg):.2f} degrees off"
assert max(places_mm) < 15.0, f"a place is {max(places_mm):.1f} mm off"

# %%
canvas = draw_corners(pictures[0], left, estimate.features_left, estimate.chosen_left)
draw_box(canvas, left, estimate.pose.vertex_m, estimate.pose.edges)
figure, axis = plt.subplots(figsize=(9, 5.2), layout="constrained")
axis.imshow(canvas[:, :, ::-1])
u, v = left.project(estimate.pose.vertex_m)
axis.set(xlim=(u - 240, u + 240), ylim=(v + 140, v - 140))
_ = axis.set(title="the last left picture: rays x red, y green, z blue, and the imaginary box", xticks=[], yticks=[])

# %% [markdown]
# ## Is the covariance true?
#
# The squared error over the covariance has the mean 6 for six numbers. Six frames of one motion are few, so the
# bounds are wide.

# %%
print(f"mean squared error over covariance: {np.mean(squares):.1f} of 6")
assert 1.0 < np.mean(squares) < 15.0, "the covariance is not that of the errors"

# %% [markdown]
# ## One camera and gravity
#
# One camera has the attitude alone, and an accelerometer tells which of the interpretations it is.

# %%
world_from_left = sequence.poses_at(sequence.times_s)[:, :3, :3]
single = corner.CornerPoseEstimator(left, down=-world_from_left[0][2])
alone = single(sequence.render(0)[0])
print(bool(alone), alone.reason)
assert alone, alone.reason
assert alone.pose.vertex_m is None, "one camera has told a place"
turn = alone.pose.camera_from_object @ sequence.left_from_object(0)[:3, :3].T
error_deg = math.degrees(math.acos(min(1.0, 0.5 * (np.trace(turn) - 1.0))))
print(f"the attitude is off by {error_deg:.2f} degrees, the place is not told")
assert error_deg < 1.0, f"the attitude of one camera is {error_deg:.2f} degrees off"

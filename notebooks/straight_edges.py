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
# # Straight edges
#
# What is straight in the world is an arc of a great circle in every central image. The detector finds these arcs
# through a fisheye, a pinhole and in a panorama, beside OpenCV's LSD, which looks for straight lines in the image.

# %%
import math

import cv2
import matplotlib.pyplot as plt
import numpy as np

import tiltvp
from tiltvp.synth import Room

AHEAD = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
cameras = {
    "fisheye": (
        tiltvp.Camera.equidistant(width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5, max_theta_rad=1.61),
        np.eye(3),
    ),
    "pinhole": (tiltvp.Camera.pinhole(width=640, height=480, fx=320.0, fy=320.0, cx=319.5, cy=239.5), AHEAD),
    "panorama": (tiltvp.Camera.equirectangular(width=1280, height=640), AHEAD),
}
room = Room("office", 9, light_spacing_m=0.5)
pose = room.free_poses(1, 4)[0]


def lsd(gray):
    """(N, 2, 2): ends in pixels of OpenCV's segments of at least 12 pixels."""
    found = cv2.createLineSegmentDetector().detect(gray)[0].reshape(-1, 2, 2)
    return found[np.linalg.norm(found[:, 1] - found[:, 0], axis=1) >= 12.0]


# %% [markdown]
# How long is what is found of the room's true edges? A sample of a true edge is found if an arc passes within 0.6
# degrees of it, along the same great circle within 6 degrees.


# %%
def share_found(edges, normals, ends):
    """Of the length of the true edges (N, 2, 3), by great circles with `normals` between `ends` (M, 2, 3)."""
    found, total = 0.0, 0.0
    for a, b in edges:
        angle = math.atan2(np.linalg.norm(np.cross(a, b)), a @ b)
        share = (np.arange(40) + 0.5) / 40.0
        points = (np.sin((1 - share) * angle)[:, None] * a + np.sin(share * angle)[:, None] * b) / math.sin(angle)
        normal = np.cross(a, b) / math.sin(angle)
        alike = np.abs(normals @ normal) > math.cos(math.radians(6.0))
        near = np.abs(points @ normals.T) < math.sin(math.radians(0.6))
        along = (points @ np.cross(normals, ends[:, 0]).T > -0.01) & (points @ np.cross(normals, ends[:, 1]).T < 0.01)
        found += angle * (near & along & alike).any(axis=1).mean()
        total += angle
    return found / total


figure, axes = plt.subplots(3, 2, figsize=(11, 11), layout="constrained")
shares = {}
for (name, (camera, mounting)), (left, right) in zip(cameras.items(), axes, strict=True):
    view = {"pose": pose, "robot_from_camera": mounting, "camera_height_m": 1.0}
    picture = room.render(camera, seed=4, samples=2, **view)
    true, _ = room.straight_edges(camera, **view)
    true = true[[math.atan2(np.linalg.norm(np.cross(a, b)), a @ b) > math.radians(5.0) for a, b in true]]

    ours = tiltvp.SegmentDetector(camera)(picture.gray)
    theirs_px = lsd(picture.gray)
    theirs = camera.unproject(theirs_px.reshape(-1, 2)).reshape(-1, 2, 3)
    theirs = theirs[np.isfinite(theirs).all(axis=(1, 2))]
    normals = np.cross(theirs[:, 0], theirs[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shares[name] = share_found(true, ours.normal, ours.ends), share_found(true, normals, theirs)
    print(f"{name}: {len(ours)} edges find {shares[name][0]:.0%}, LSD's {len(theirs_px)} find {shares[name][1]:.0%}")

    canvas = picture.bgr.copy()
    for (u, v), (s, t) in theirs_px.round().astype(int):
        cv2.line(canvas, (u, v), (s, t), (0, 200, 0), 1, cv2.LINE_AA)
    left.imshow(canvas[:, :, ::-1])
    left.set(title=f"{name}: LSD, {len(theirs_px)} pieces", xticks=[], yticks=[])
    right.imshow(tiltvp.draw_segments(picture.bgr, camera, ours)[:, :, ::-1])
    right.set(title=f"SegmentDetector, {len(ours)} edges", xticks=[], yticks=[])

assert all(own > 0.5 for own, _ in shares.values()), f"less than half of the edges are found: {shares}"
assert all(own > lsd_share for own, lsd_share in shares.values()), f"LSD finds more: {shares}"

# %% [markdown]
# Each edge comes with its error: `covariance` of the normal, sideways and turned about the middle.

# %%
camera, mounting = cameras["fisheye"]
edges = tiltvp.SegmentDetector(camera)(room.render(camera, pose=pose, camera_height_m=1.0, seed=4, samples=2).gray)
sideways, turned = np.degrees(np.sqrt(np.asarray(edges.variances_rad2))).T
figure, axis = plt.subplots(figsize=(6, 3.2), layout="constrained")
axis.loglog(np.degrees(edges.length_rad), sideways, ".", label="sideways")
axis.loglog(np.degrees(edges.length_rad), turned, ".", label="turned")
axis.set(xlabel="length, degrees", ylabel="standard deviation, degrees", title="long edges are known better")
axis.legend()
longest = np.argsort(edges.length_rad)
assert np.median(turned[longest[-20:]]) < 0.5 * np.median(turned[longest[:20]]), "long edges are not known better"

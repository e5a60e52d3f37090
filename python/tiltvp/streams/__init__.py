"""Where frames, odometry and inertial data come from, with their times: images, videos, bags of ROS, tables."""

from __future__ import annotations

from tiltvp.streams.bag_images import image_from_message
from tiltvp.streams.bag_motion import inertial_samples
from tiltvp.streams.bag_setup import camera_from_message, recorded_camera, robot_from_camera
from tiltvp.streams.bags import Recording, Topic, is_recording
from tiltvp.streams.frames import Frame, Frames
from tiltvp.streams.inertial import InertialSamples
from tiltvp.streams.live import LiveCamera, NamedImages, RawImages
from tiltvp.streams.motions import FrameMotions, frame_motions, read_odometry
from tiltvp.streams.odometry import Motion, Odometry, Travelled
from tiltvp.streams.sources import open_frames
from tiltvp.streams.wheels import Wheels

__all__ = [
    "Frame",
    "FrameMotions",
    "Frames",
    "InertialSamples",
    "LiveCamera",
    "Motion",
    "NamedImages",
    "Odometry",
    "RawImages",
    "Recording",
    "Topic",
    "Travelled",
    "Wheels",
    "camera_from_message",
    "frame_motions",
    "image_from_message",
    "inertial_samples",
    "is_recording",
    "open_frames",
    "read_odometry",
    "recorded_camera",
    "robot_from_camera",
]

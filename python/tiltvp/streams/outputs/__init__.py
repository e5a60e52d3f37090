"""Where answers go: MCAP files for ROS 2, trajectories of TUM's format, static transforms."""

from tiltvp.streams.outputs.mcap import Message, NewRecording, new_recording
from tiltvp.streams.outputs.tilts import attitude, write_tilts
from tiltvp.streams.outputs.transforms import StaticTransform
from tiltvp.streams.outputs.tum import write_tum

__all__ = [
    "Message",
    "NewRecording",
    "StaticTransform",
    "attitude",
    "new_recording",
    "write_tilts",
    "write_tum",
]

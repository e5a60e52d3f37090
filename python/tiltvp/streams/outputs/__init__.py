"""Where answers go: MCAP files for ROS 2, trajectories of TUM's format, static transforms, the viewer of Rerun."""

from tiltvp.streams.outputs.mcap import Message, NewRecording, new_recording
from tiltvp.streams.outputs.tilts import attitude, write_tilts
from tiltvp.streams.outputs.transforms import StaticTransform
from tiltvp.streams.outputs.tum import write_tum
from tiltvp.streams.outputs.viewer import Viewer, open_viewer

__all__ = [
    "Message",
    "NewRecording",
    "StaticTransform",
    "Viewer",
    "attitude",
    "new_recording",
    "open_viewer",
    "write_tilts",
    "write_tum",
]

"""MCAP files of ROS 2 messages, written whole or not at all (`pip install 'tiltvp[bags]'`)."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from tiltvp.arguments import path_from
from tiltvp.errors import InvalidInputError, MissingExtraError
from tiltvp.files import check_output, scratch_folder, whole_file

if TYPE_CHECKING:
    from rosbags.interfaces import Connection, Qos
    from rosbags.rosbag2 import Writer
    from rosbags.typesys.store import Typestore

__all__ = ["Message", "NewRecording", "check_recording", "new_recording"]

_ENDING: Final = ".mcap"
_NAME: Final = "recording"
"""What the file is called within itself, so that its bytes do not depend on where it goes."""


class Message(NamedTuple):
    """A ROS 2 message: its type, such as "sensor_msgs/msg/Imu", and its fields; dicts stand for messages within it."""

    kind: str
    fields: Mapping[str, Any]


class NewRecording:
    """Takes the messages of an MCAP file that is being written."""

    def __init__(self, writer: Writer, types: Typestore) -> None:
        """As `new_recording` makes it."""
        self._writer, self._types = writer, types
        self._topics: dict[str, Connection] = {}

    def write(self, topic: str, time_ns: int, message: Message, *, latched: bool = False) -> None:
        """One more message of a topic; fields that are not given are zero or empty, as in ROS.

        `latched` says of a topic's first message that those who come later are to be told, as of static transforms.
        """
        if topic not in self._topics:
            qos = [_latched()] if latched else []
            self._topics[topic] = self._writer.add_connection(
                topic, message.kind, typestore=self._types, offered_qos_profiles=qos
            )
        made = self._made(message.kind, message.fields)
        self._writer.write(self._topics[topic], time_ns, self._types.serialize_cdr(made, message.kind))

    def _made(self, kind: str, fields: Mapping[str, Any]) -> Any:
        """The library's object of a message."""
        declared = self._types.fielddefs[kind][1]
        cells = {name: self._value(definition, fields.get(name)) for name, definition in declared}
        return self._types.types[kind](**cells)

    def _value(self, definition: Any, value: Any) -> Any:
        node, about = definition
        match node.name:
            case "BASE":
                return value if value is not None else "" if about[0] == "string" else 0
            case "NAME":
                return self._made(about, value or {})
        (inner, what), length = about
        if inner.name == "BASE" and what[0] != "string":
            cells = np.zeros(length) if value is None else np.asarray(value)
            return cells.astype(what[0], copy=False).ravel()
        return [self._value((inner, what), cell) for cell in value or []]


@contextmanager
def new_recording(path: str | os.PathLike[str]) -> Iterator[NewRecording]:
    """An MCAP file of ROS 2 messages that appears when the block ends, unless an exception leaves it.

    Raises as `check_recording` does.
    """
    check_recording(path)
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    with scratch_folder(path) as folder:
        with Writer(folder / _NAME, version=Writer.VERSION_LATEST, storage_plugin=StoragePlugin.MCAP) as writer:
            yield NewRecording(writer, get_typestore(Stores.ROS2_JAZZY))
        with whole_file(path) as part:
            shutil.copyfile(folder / _NAME / f"{_NAME}{_ENDING}", part)


def check_recording(path: str | os.PathLike[str]) -> None:
    """Refuses what no recording can be written to, before any work is done.

    Raises `InvalidInputError` for another ending than .mcap, `MissingExtraError` without the packages of the extra
    `bags`, and as `check_output` does.
    """
    name = str(path_from(path))
    if not name.lower().endswith(_ENDING):
        raise InvalidInputError(f"{name}: expected a name that ends in {_ENDING}")
    try:
        import rosbags.rosbag2  # noqa: F401
    except ImportError as error:
        raise MissingExtraError.of(f"{name}: a recording of ROS", "bags", error) from None
    check_output(path)


def _latched() -> Qos:
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    never = QosTime(0, 0)
    return Qos(
        QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, never, never,
        QosLiveliness.SYSTEM_DEFAULT, never, False,
    )  # fmt: skip

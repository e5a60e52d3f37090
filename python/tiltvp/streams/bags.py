"""Recordings of ROS, as topics of messages: bags of ROS 1 and 2, and MCAP."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

from tiltvp.arguments import path_from
from tiltvp.errors import InvalidInputError, MissingExtraError, TiltvpError
from tiltvp.images import LARGEST_IMAGE_BYTES
from tiltvp.streams.odometry import GAP_MAX_S

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

__all__ = ["BAG_ENDINGS", "Message", "Recording", "Topic", "is_recording"]

BAG_ENDINGS: Final = (".bag", ".mcap", ".db3")
_METADATA: Final = "metadata.yaml"
_MAGIC: Final = b"#ROSBAG V2.0\n"
"""The first line of a ROS 1 bag, which rosbags looks for in all of a file that has no lines."""
MOST_METADATA_BYTES: Final = 16 << 20
"""Of a ROS 2 bag's metadata: some 300 bytes a topic and file, so that 10,000 topics of 1,000 files take 4 MB."""

_AT_ZERO: Final = 20
"""Messages of a topic that a simulation may have sent at its time 0: one, or some that it waited with."""


def is_recording(path: str | os.PathLike[str]) -> bool:
    """Whether it looks like a bag: a file with such an ending, or a folder with a bag's metadata."""
    file = path_from(path)
    # As `Path` does not, these say of names that no file can have that there is none.
    return (file.suffix.lower() in BAG_ENDINGS and not os.path.isdir(file)) or os.path.isfile(file / _METADATA)


@dataclass(frozen=True)
class Topic:
    """One topic of a recording."""

    name: str
    kind: str
    """Type of its messages, such as `sensor_msgs/Image`."""
    count: int
    """How many messages it has."""


@dataclass(frozen=True)
class Message:
    """One message as it was recorded."""

    time_s: float
    """When it was written down, seconds: by the clock of the recorder."""
    raw: bytes
    kind: str
    _decode: Callable[[bytes, str], Any]

    def decode(self) -> Any:
        """Its content, with the fields of its definition. Raises `InvalidInputError` for a damaged one."""
        if len(self.raw) > LARGEST_IMAGE_BYTES:
            raise InvalidInputError(f"a message of {len(self.raw)} bytes, expected at most {LARGEST_IMAGE_BYTES}")
        try:
            return self._decode(self.raw, self.kind)
        except Exception as error:
            raise InvalidInputError(f"a message that is no {_short(self.kind)} ({error})") from error

    def taken_s(self, content: Any, *, from_zero: bool) -> float:
        """When it was taken, by its header; when it was written down where it has none, or 0 in it, but that of a clock
        `from_zero`."""
        seconds = _stamp_s(content)
        if seconds is None or seconds < 0.0 or (seconds == 0.0 and not from_zero):
            return self.time_s
        return seconds


class Recording:
    """A recording that is there, with its topics. Each reading opens it anew, so that several may go on at a time."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Reads what topics there are.

        Raises `InvalidInputError` with the path for what is no recording, `MissingExtraError` without rosbags.
        """
        self.path = path_from(path)
        with self._opened() as reader:
            found = [
                Topic(name, _short(info.msgtype or "of several types"), info.msgcount)
                for name, info in reader.topics.items()
            ]
        self.topics: tuple[Topic, ...] = tuple(found)
        """By name."""

    def choose(self, kinds: Sequence[str], option: str, name: str | None = None) -> Topic:
        """The topic of that name, or, without one, the only one of these kinds that has messages.

        Raises `InvalidInputError` that lists the topics and how many messages each has; `option` is how to name one.
        """
        fitting = [topic for topic in self.topics if topic.kind in kinds]
        if name is not None:
            fitting = [topic for topic in fitting if topic.name == name]
            problem = f"no topic {name!r} of {' or '.join(kinds)}"
        else:
            fitting = [topic for topic in fitting if topic.count > 0]
            problem = f"{len(fitting) or 'no'} topics of {' or '.join(kinds)}"
        if len(fitting) == 1:
            return fitting[0]
        told = ", ".join(f"{topic.name} ({topic.kind}, {topic.count})" for topic in self.topics) or "none"
        expected = f"one, by {option}" if len(fitting) > 1 else f"one of them; topics and messages: {told}"
        listed = f" ({', '.join(f'{topic.name}: {topic.count}' for topic in fitting)})" if len(fitting) > 1 else ""
        raise InvalidInputError(f"{self.path}: {problem}{listed}, expected {expected}")

    def messages(self, topic: Topic) -> Iterator[Message]:
        """The messages of a topic, in the order in which they were written down.

        Raises `InvalidInputError` with the path where the file is damaged.
        """
        with self._opened() as reader:
            connections = [one for one in reader.connections if one.topic == topic.name]
            types = reader.typestore
            decode = types.deserialize_cdr if reader.is2 else types.deserialize_ros1
            for connection, time_ns, raw in reader.messages(connections):
                yield Message(1e-9 * time_ns, raw, connection.msgtype, decode)

    def is_from_zero(self, topic: Topic) -> bool:
        """Whether its stamps begin at 0, as a simulation's: they go on before the time at which those of 0 were written
        down. Else a stamp of 0 is none."""
        written_s = -math.inf
        for message in islice(self.messages(topic), _AT_ZERO):
            try:
                seconds = _stamp_s(message.decode())
            except InvalidInputError:
                continue
            if seconds != 0.0:
                return seconds is not None and seconds + GAP_MAX_S < written_s
            written_s = message.time_s
        return False

    def unread(self, topic: Topic, read: int) -> tuple[str, ...]:
        """A sentence where fewer messages of a topic were read than it has, as of a file that is damaged within."""
        told = f"{self.path}: {topic.name}: {topic.count - read} of {topic.count} messages cannot be read (damaged?)"
        return (told,) if read < topic.count else ()

    def decoded(self, topic: Topic) -> Iterator[tuple[float, Any]]:
        """The time and the content of each message of a topic, which has no damaged ones."""
        from_zero = self.is_from_zero(topic)
        for number, message in enumerate(self.messages(topic)):
            try:
                content = message.decode()
            except InvalidInputError as error:
                raise InvalidInputError(f"{self.path}: {topic.name}, message {number}: {error}") from error
            yield message.taken_s(content, from_zero=from_zero), content

    @contextmanager
    def _opened(self) -> Iterator[AnyReader]:
        try:
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise MissingExtraError.of(f"{self.path}: a recording of ROS", "bags", error) from error
        self._check()
        try:
            # Before Iron the bags of ROS 2 do not say what their types are.
            with AnyReader([self.path], default_typestore=get_typestore(Stores.LATEST)) as reader:
                yield reader
        except (TiltvpError, MemoryError):
            raise
        except Exception as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise InvalidInputError(f"{self.path}: not a bag that can be read ({why}), expected a whole one") from error

    def _check(self) -> None:
        """Refuses what is no regular file, and metadata that nobody would write."""
        try:
            if self.path.is_dir():
                size = (self.path / _METADATA).stat().st_size
                if size > MOST_METADATA_BYTES:
                    raise InvalidInputError(
                        f"{self.path}: {_METADATA} of {size} bytes, expected at most {MOST_METADATA_BYTES}"
                    )
            elif not self.path.is_file():
                what = "is no regular file" if self.path.exists() else "no such file"
                raise InvalidInputError(f"{self.path}: {what}, expected a bag")
            elif self.path.suffix.lower() == ".bag":
                with open(self.path, "rb") as stream:
                    if stream.read(len(_MAGIC)) != _MAGIC:
                        raise InvalidInputError(
                            f"{self.path}: not a bag that can be read, expected {_MAGIC!r} in front"
                        )
        except InvalidInputError:
            raise
        except (OSError, ValueError) as error:
            raise InvalidInputError(f"{str(self.path)!r}: cannot be read ({error}), expected a bag") from error


def _stamp_s(content: Any) -> float | None:
    """What a header tells, seconds; None where there is none."""
    stamp = getattr(getattr(content, "header", None), "stamp", None)
    return None if stamp is None else float(stamp.sec + 1e-9 * stamp.nanosec)


def _short(kind: str) -> str:
    """`sensor_msgs/msg/Image` as people write it: without `msg`."""
    return kind.replace("/msg/", "/")

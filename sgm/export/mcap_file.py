"""A file of MCAP with messages of Foxglove's schemas as protocol buffers."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import Any, BinaryIO, cast

from sgm.export.scene_messages import Message
from sgm.messages import needed_to

_KEPT_BYTES = 1 << 20  # that are compressed together, where the file need not be whole before


class _Target:
    """Where a file is written to, which may change."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file

    def write(self, content: bytes) -> int:
        return self.file.write(content)

    def tell(self) -> int:
        return self.file.tell()

    def flush(self) -> None:
        self.file.flush()


class McapFile:
    """Writes messages by topic.

    Source: the format MCAP, by the package mcap; schemas by foxglove-schemas-protobuf.
    """

    def __init__(self, file: BinaryIO, about: Mapping[str, str], *, at_once: bool = False) -> None:
        """Begin a file.

        Args:
            file: to write to.
            about: what the file says of itself.
            at_once: whether each message is on its way to the disk when it was written, so that a
                file that was not ended can be read, too.

        Raises:
            ModuleNotFoundError: if the packages of the extra mcap are not installed.
        """
        with needed_to("write MCAP", extra="mcap"):
            from foxglove_schemas_protobuf import (
                FrameTransform_pb2,
                PoseInFrame_pb2,
                SceneUpdate_pb2,
            )
            from google.protobuf.descriptor_pb2 import FileDescriptorSet
            from google.protobuf.json_format import ParseDict
            from mcap.writer import Writer
        self._classes: dict[str, Any] = {
            "SceneUpdate": SceneUpdate_pb2.SceneUpdate,
            "FrameTransform": FrameTransform_pb2.FrameTransform,
            "PoseInFrame": PoseInFrame_pb2.PoseInFrame,
        }
        self._parse, self._set = ParseDict, FileDescriptorSet
        self._target, self._at_once = _Target(file), at_once
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._time = 0
        self.num_messages = 0
        self._writer = Writer(
            cast("BinaryIO", self._target), chunk_size=1 if at_once else _KEPT_BYTES
        )
        self._writer.start(library="scene-graph-memory")
        self._writer.add_metadata("scene graph memory", dict(about))

    def write(self, topic: str, schema: str, time: int, message: Message) -> None:
        """Write a message.

        Args:
            topic: such as "/things".
            schema: "SceneUpdate", "FrameTransform" or "PoseInFrame".
            time: nanoseconds since 1970, never before that of the message before.
            message: by the schema, in the JSON form of protocol buffers.
        """
        assert time >= self._time, "messages must be written in the order of their times"
        made = self._parse(message, self._classes[schema]())
        content = made.SerializeToString(deterministic=True)
        if topic not in self._channels:
            number = self._find_schema(schema)
            self._channels[topic] = self._writer.register_channel(topic, "protobuf", number)
        self._writer.add_message(self._channels[topic], time, content, time, self.num_messages)
        self.num_messages += 1
        self._time = time
        if self._at_once:
            self._target.flush()

    def move(self, before: BytesIO, file: BinaryIO) -> None:
        """Go on in another file, which gets what was written to memory before."""
        file.write(before.getvalue())
        file.flush()
        self._target.file = file

    @property
    def num_topics(self) -> int:
        """How many topics have messages."""
        return len(self._channels)

    def finish(self) -> None:
        """Write the index, with which the file ends."""
        self._writer.finish()
        self._target.flush()

    def _find_schema(self, name: str) -> int:
        """Return the number of a schema in the file, with all that its definition names."""
        if name not in self._schemas:
            descriptor = self._classes[name].DESCRIPTOR
            files, waiting = self._set(), [descriptor.file]
            known: set[str] = set()
            while waiting:
                part = waiting.pop()
                if part.name not in known:
                    known.add(part.name)
                    part.CopyToProto(files.file.add())
                    waiting += part.dependencies
            self._schemas[name] = self._writer.register_schema(
                descriptor.full_name, "protobuf", files.SerializeToString()
            )
        return self._schemas[name]

"""The files of a recording of ROS 2: a bag, or storages without metadata, as one reader."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from sgm.messages import needed_to, shorten
from simulator.yaml_text import read_yaml

MOST_METADATA_BYTES = 1 << 24
_MOST_FILES = 1000
_STORAGES = (".mcap", ".db3")
_MUCH = 1 << 16  # bytes that are read without asking how many there are
MOST_CHUNK_BYTES = 1 << 28  # of a chunk of MCAP when it is unpacked: one of ROS 2 has a few MB


class _BoundedReader(io.BufferedReader):
    """Takes no more memory for what is read than there is of the file, whatever a record says."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > _MUCH:
            size = min(size, max(os.fstat(self.fileno()).st_size - self.tell(), 0))
        return super().read(size)


class _BoundedPath(type(Path())):  # type: ignore[misc]  # the class of paths of this system
    """A path whose file is read by `_BoundedReader`, if it is read in bytes."""

    def open(self, mode: str = "r", *more: Any, **named: Any) -> Any:
        if mode == "rb":
            return _BoundedReader(io.FileIO(self))
        return super().open(mode, *more, **named)


def _bound_chunks() -> None:
    """Have rosbags unpack no more of a chunk of MCAP than the chunk says, and not too much."""
    from lz4.frame import LZ4FrameDecompressor
    from rosbags.rosbag2.storage_mcap import DECOMPRESSORS, zstd

    def unpack(make: Callable[[], Any], data: bytes, size: int) -> bytes:
        if not 0 <= size <= MOST_CHUNK_BYTES:
            raise ValueError(f"a chunk must have at most {MOST_CHUNK_BYTES} bytes, got {size}")
        unpacked: bytes = make().decompress(data, size + 1)  # one that is longer is refused
        return unpacked

    for name, make in (("zstd", zstd.ZstdDecompressor), ("lz4", LZ4FrameDecompressor)):
        DECOMPRESSORS[name] = partial(unpack, make)


class StorageFiles:
    """Files of messages that are read one after the other, as those of one bag.

    Attributes:
        connections: of all files; one topic may be there once a file.
    """

    def __init__(self, readers: Sequence[Any]) -> None:
        """Take over readers of rosbags, which are open."""
        self._readers = readers
        self.connections = [connection for reader in readers for connection in reader.connections]

    def messages(self, connections: Collection[Any]) -> Iterator[tuple[Any, int, bytes]]:
        """Yield connection, nanoseconds and bytes of every message, as rosbags does."""
        topics = {connection.topic for connection in connections}
        for reader in self._readers:
            wanted = [connection for connection in reader.connections if connection.topic in topics]
            if wanted:
                yield from reader.messages(connections=wanted)

    def close(self) -> None:
        """Close all files."""
        for reader in self._readers:
            reader.close()


def open_bag(path: Path) -> StorageFiles:
    """Open a folder that `ros2 bag record` made, a file of it, or a folder of such files.

    Raises:
        ModuleNotFoundError: if rosbags is not installed.
        ValueError: if it is none, or was compressed as a whole by rosbag2.
    """
    with needed_to("read bags", extra="bag"):
        from rosbags.rosbag2 import Reader, ReaderError
    _bound_chunks()
    has_metadata = (path / "metadata.yaml").is_file()
    files = [path] if has_metadata else _list_storages(path)
    if has_metadata:
        _check_metadata(path)
        _check_storages(path)
    readers: list[Any] = []
    for file in files:
        try:
            reader: Any = Reader(_BoundedPath(file))
            reader.open()
        except Exception as error:  # of sqlite, MCAP, zstd: whatever a file holds that was altered
            StorageFiles(readers).close()
            rule = "one of ROS 2" if isinstance(error, ReaderError) else "whole, and of ROS 2"
            # What was being recorded when the power failed has no end: `ros2` opens it no more.
            mend = "`mcap recover`" if file.suffix == ".mcap" else "`ros2 bag reindex`"
            raise ValueError(
                f"bag must be {rule} that rosbags reads, got {shorten(str(error)[:200])} for "
                f"{file}. Run `ros2 bag info`, or {mend}."
            ) from None
        readers.append(reader)
    return StorageFiles(readers)


def _list_storages(path: Path) -> list[Path]:
    """Return the files of messages at a path without metadata, by their names."""
    files = [path] if path.is_file() else sorted(path.iterdir()) if path.is_dir() else []
    found = [file for file in files if file.suffix in _STORAGES and file.is_file()]
    if not 0 < len(found) <= _MOST_FILES:
        got = "none" if not found else f"{len(found)} files"
        raise ValueError(
            "bag must be a folder with metadata.yaml, or files of messages ending in .mcap or "
            f".db3, got {got} at {path}. Give what `ros2 bag record` has made."
        )
    return found


def _check_storages(path: Path) -> None:
    """Check that no storage of a bag is a pipe or the like, for which one would wait."""
    for file in sorted(path.iterdir()):
        if file.suffix in _STORAGES and not file.is_file():
            raise ValueError(
                f"storage of a bag must be a file that can be read, got none at {file}. Copy it "
                "again."
            )


def _check_metadata(path: Path) -> None:
    """Check what a bag says of itself, before anything is unpacked."""
    file = path / "metadata.yaml"
    if os.path.getsize(file) > MOST_METADATA_BYTES:
        raise ValueError(
            f"metadata.yaml of a bag must have at most {MOST_METADATA_BYTES} bytes, got more in "
            f"{path}. Record fewer topics."
        )
    try:
        data = read_yaml(file)
    except ValueError as error:
        raise ValueError(
            f"metadata.yaml of a bag must be YAML, got {shorten(str(error)[:200])} in {path}. Run "
            "`ros2 bag reindex`."
        ) from None
    about = data.get("rosbag2_bagfile_information") if isinstance(data, dict) else None
    mode = about.get("compression_mode") if isinstance(about, dict) else None
    if mode and str(mode).lower() != "none":
        raise ValueError(
            f"bag must not be compressed by rosbag2, got compression of each {shorten(mode)} in "
            f"{path}. Convert it with `ros2 bag convert`; MCAP's own compression of chunks will do."
        )

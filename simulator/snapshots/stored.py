"""Snapshots on disk, any of which is found without a search."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from sgm.arrays.grouped import compute_starts, concatenate_ranges, number_keys
from sgm.schema import COUNTERS, FIXED
from simulator.snapshots.mapped_table import MappedTable
from simulator.snapshots.shards import (
    EXTRA,
    PREFIXES,
    QUESTION_EXTRA,
    check_manifest,
    check_shard,
    load_manifest,
    load_shard,
)
from simulator.snapshots.snapshots import Snapshots, make_counters

VERSIONED = tuple(PREFIXES[table] for table, names in COUNTERS.items() if names)
_PER_FRAME = 8  # snapshots, one bit of a byte each
# An array of a shard belongs to the first table whose name its own begins with, else to `home`.
_PER_FURNITURE = "snapshot_furniture"
_TABLES = (
    *(f"{table}_version" for table in VERSIONED),
    _PER_FURNITURE,
    "snapshot",
    *PREFIXES.values(),
)
_NO_CLOCK = np.full((1, 2), np.nan)
_MAX_MAPPED = 1 << 28  # bytes of homes that were read, before their pages are given back


class StoredSnapshots:
    """The snapshots of collections, from which any are taken as `Snapshots`.

    All arrays of all homes lie in tables, one for each kind of row, one home after the other.
    A row of `snapshot` is one snapshot, of `home` one home, of `snapshot_furniture` one furniture
    node as it was asked about in one snapshot, of `edge_version` one version of an edge, and so on;
    docs/data.md lists their columns. So homes may have any number of rooms and furniture nodes.
    Every frame of 8 successive snapshots of a home lists the versions that are valid somewhere in
    it, so that reading a snapshot looks through these, and not through all versions that its home
    ever had.

    The tables lie in temporary files that are mapped into memory, so that the memory of the process
    does not grow with the number of snapshots, and batches are shuffled over all of them.

    Attributes:
        labels: text of every label index.
        starts: first row of each home in each table, and the number of rows at the end, (H + 1,).
    """

    def __init__(
        self, shards: Iterable[Mapping[str, np.ndarray]], labels: Sequence[str], folder: Path
    ) -> None:
        """Write the tables into a folder, if it can be written to; one home is held at a time.

        Raises:
            OSError: if the disk does not take them.
        """
        self.labels = tuple(labels)
        lists = [f"{table}_list" for table in VERSIONED]
        names = ("home", "frame", *_TABLES, *lists)
        starts: dict[str, list[int]] = {name: [] for name in names}
        with ExitStack() as stack:
            tables = {name: stack.enter_context(MappedTable(folder)) for name in names}
            for shard in shards:
                for name, table in tables.items():
                    starts[name].append(len(table))
                for name, columns in _make_rows(shard).items():
                    if name == "frame":  # where its lists begin, over all homes
                        columns = {key: len(tables[key]) + first for key, first in columns.items()}
                    tables[name].append(columns)
            for name, table in tables.items():
                starts[name].append(len(table))
            tables["frame"].append({name: np.array([len(tables[name])]) for name in lists})
            for table in tables.values():
                table.finish()
        self._tables = tables
        self.starts = {name: np.array(rows, dtype=np.int64) for name, rows in starts.items()}
        self._num_bytes = sum(table.num_bytes for table in self._tables.values())
        self._num_mapped = 0

    @classmethod
    def open(cls, folder: Path, *more: Path) -> StoredSnapshots:
        """Read and check every shard of collections once.

        Args:
            folder: written by `simulator.collect`.
            more: further collections of homes with the same labels and the same extras.

        Raises:
            ValueError: if a collection is unfinished, its manifest or a shard is missing, cut
                short, altered or none that was collected (the file is named), or the labels differ.
            OSError: if the disk does not take a copy of the collections.
        """
        manifests = {path: load_manifest(path) for path in (folder, *more)}
        for path, manifest in manifests.items():
            check_manifest(manifest, path)
        labels = manifests[folder]["settings"]["labels"]
        for path, manifest in manifests.items():
            num_homes = manifest["settings"]["num_homes"]
            if len(manifest["shards"]) != num_homes:
                raise ValueError(
                    f"collection must be finished, got {len(manifest['shards'])} of {num_homes} "
                    f"homes in {path}. Run the same `python -m simulator.collect` again."
                )
            if manifest["settings"]["labels"] != labels:
                raise ValueError(
                    f"collections must have the same labels, got others in {path} than in "
                    f"{folder}. Collect both from homes of one source and prior."
                )

        def load_all() -> Iterator[dict[str, np.ndarray]]:
            for path, manifest in manifests.items():
                for name, checksum in manifest["shards"].items():
                    shard = load_shard(path / name, checksum)
                    check_shard(shard, len(labels), path / name)
                    yield shard

        return cls(load_all(), labels, folder)

    def __len__(self) -> int:
        """Return the number of snapshots."""
        return int(self.starts["snapshot"][-1])

    def take(self, indices: np.ndarray) -> Snapshots:
        """Read snapshots by number, (B,)."""
        batch = np.arange(len(indices))
        home = self.find_home(indices)
        number = indices - self.starts["snapshot"][home]  # within the home
        asked = self.take_rows("snapshot", indices)
        clock = self.take_rows("home", home)["home_clock"]
        first_room, rooms = self._take_layout("rooms", home)
        first_furniture, furniture = self._take_layout("furniture", home)
        furniture["room"] = furniture["room"] + first_room[furniture["snapshot"]]
        furniture |= make_counters("furniture", len(furniture["room"]))
        of_furniture = self.take_rows(_PER_FURNITURE, self.find_furniture_rows(home, number))
        sample, version = self.take_versions("furniture", home, number)
        looked = first_furniture[sample] + version["of"]
        for name in COUNTERS["furniture"]:
            furniture[name][looked] = version[name]

        # Nodes: objects with a version, and the query object; one key per (snapshot, object).
        sample, version = self.take_versions("object", home, number)
        width = int(np.diff(self.starts["object"]).max())
        object_key = sample * width + version["of"]
        query_key = batch * width + asked["query"]
        node_keys, node_of_key = number_keys(len(indices) * width, object_key, query_key)
        object_snapshot, local = np.divmod(node_keys, width)
        thing = self.starts["object"][home][object_snapshot] + local
        objects = {
            "snapshot": object_snapshot,
            **_take_columns(self.take_rows("object", thing), FIXED["objects"]),
            **make_counters("objects", len(thing)),
        }
        for name in COUNTERS["objects"]:
            objects[name][node_of_key[object_key]] = version[name]

        sample, version = self.take_versions("edge", home, number)
        edge = self.take_rows("edge", self.starts["edge"][home][sample] + version["of"])
        edges = {
            "snapshot": sample,
            **_take_columns(edge, FIXED["edges"]),
            **_take_columns(version, COUNTERS["edges"]),
            "object": node_of_key[sample * width + edge["object"]],
            "furniture": edge["furniture"] + first_furniture[sample],
        }
        self.release(len(indices))
        return Snapshots(
            labels=self.labels,
            time=asked["time"],
            clock=None if np.isnan(clock).all() else clock,
            rooms=rooms,
            furniture=furniture,
            objects=objects,
            edges=edges,
            query_object=node_of_key[query_key],
            query_prior=of_furniture["prior"],
            answers=of_furniture["answers"].astype(bool),
            extras=_get_extras(of_furniture, EXTRA),
            question_extras=_get_extras(asked, QUESTION_EXTRA),
        )

    def take_rows(self, name: str, rows: np.ndarray) -> np.ndarray:
        """Return rows of a table, (n,) -> records (n,)."""
        return self._tables[name].take(rows)

    def find_home(self, snapshots: np.ndarray) -> np.ndarray:
        """Return the home of each snapshot, (B,) -> (B,)."""
        return self.starts["snapshot"].searchsorted(snapshots, side="right") - 1

    def _take_layout(
        self, table: str, home: np.ndarray
    ) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Take what the homes of snapshots, (B,), have in a table of rooms or furniture.

        Returns:
            The first row of each snapshot and, last, their number, (B + 1,); and the columns.
        """
        name = PREFIXES[table]
        starts = self.starts[name]
        counts = starts[home + 1] - starts[home]
        records = self.take_rows(name, concatenate_ranges(starts[home], counts))
        columns = _take_columns(records, FIXED[table])
        columns["snapshot"] = np.repeat(np.arange(len(home)), counts)
        return compute_starts(counts), columns

    def find_furniture_rows(self, home: np.ndarray, number: np.ndarray) -> np.ndarray:
        """Find the rows of `snapshot_furniture` of snapshots; arguments as for `take_versions`."""
        starts = self.starts["furniture"]
        counts = starts[home + 1] - starts[home]
        return concatenate_ranges(self.starts[_PER_FURNITURE][home] + number * counts, counts)

    def take_versions(
        self, table: str, home: np.ndarray, number: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the versions that are valid in each snapshot.

        Args:
            table: one of `VERSIONED`.
            home: of each snapshot, (B,).
            number: of each snapshot within its home, (B,).

        Returns:
            (n,) position in the batch and (n,) records of the versions, in the order of nodes or
            edges within each snapshot.
        """
        frame, place = np.divmod(number, _PER_FRAME)
        frame += self.starts["frame"][home]
        starts = self.take_rows("frame", frame)[f"{table}_list"]
        counts = self.take_rows("frame", frame + 1)[f"{table}_list"] - starts
        listed = self.take_rows(f"{table}_list", concatenate_ranges(starts, counts))
        bit = np.repeat(np.left_shift(1, place).astype(np.uint8), counts)
        valid = np.flatnonzero(listed["valid_in"] & bit)
        sample = np.repeat(np.arange(len(home)), counts).take(valid)
        rows = self.starts[f"{table}_version"][home].take(sample) + listed["row"].take(valid)
        return sample, self.take_rows(f"{table}_version", rows)

    def release(self, num_snapshots: int) -> None:
        """Say that so many snapshots were read; gives memory back when it may have become much."""
        num_homes = len(self.starts["home"]) - 1
        self._num_mapped += num_snapshots * (self._num_bytes // num_homes)  # at most
        if min(self._num_mapped, self._num_bytes) > _MAX_MAPPED:
            self._num_mapped = 0
            for table in self._tables.values():
                table.release()


def _make_rows(shard: Mapping[str, np.ndarray]) -> dict[str, dict[str, np.ndarray]]:
    """Share the arrays of a home out to the tables, and list the versions of its frames."""
    tables: dict[str, dict[str, np.ndarray]] = {name: {} for name in ("home", *_TABLES, "frame")}
    for name, array in shard.items():
        owner = next((table for table in _TABLES if name.startswith(f"{table}_")), None)
        if owner is None:
            tables["home"][name] = array[np.newaxis]  # one row, whatever its shape
            continue
        if owner == _PER_FURNITURE:  # (S, F, ...) in a shard
            array = array.reshape(-1, *array.shape[2:])
        tables[owner][name.removeprefix(f"{owner}_")] = array
    tables["home"].setdefault("home_clock", _NO_CLOCK)
    num_frames = -(-len(tables["snapshot"]["time"]) // _PER_FRAME)
    for table in VERSIONED:
        versions = tables[f"{table}_version"]
        tables[f"{table}_list"], tables["frame"][f"{table}_list"] = _list_frames(
            versions.pop("valid_from"), versions.pop("valid_to"), num_frames
        )
    # The lists of a frame begin where the tables of the lists end: before they grow.
    return {"frame": tables.pop("frame"), **tables}


def _list_frames(
    valid_from: np.ndarray, valid_to: np.ndarray, num_frames: int
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """List the versions (V,), from one snapshot to before another, of each frame of a home.

    Returns:
        Columns of the list, (n,): `row`, the number of the version, ascending within each frame,
        and `valid_in`, whose bit i says whether it is valid in the i-th snapshot of the frame;
        and the first entry of each frame, (num_frames,).
    """
    first = valid_from // _PER_FRAME
    count = np.where(valid_to > valid_from, (valid_to - 1) // _PER_FRAME - first + 1, 0)
    frame = concatenate_ranges(first, count)
    order = np.argsort(frame, kind="stable")
    frame = frame[order]
    version = np.repeat(np.arange(len(count), dtype=np.int32), count)[order]
    begin = np.maximum(valid_from[version] - frame * _PER_FRAME, 0)
    end = np.minimum(valid_to[version] - frame * _PER_FRAME, _PER_FRAME)
    valid_in = (1 << end) - (1 << begin)  # bits begin, ..., end - 1
    columns = {"row": version, "valid_in": valid_in.astype(np.uint8)}
    return columns, np.searchsorted(frame, np.arange(num_frames))


def _take_columns(records: np.ndarray, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Return some columns of records, by name."""
    return {name: records[name] for name in names}


def _get_extras(rows: np.ndarray, prefix: str) -> dict[str, np.ndarray]:
    """Return the columns of records whose names begin with a prefix, without it."""
    names = rows.dtype.names or ()
    return {name.removeprefix(prefix): rows[name] for name in names if name.startswith(prefix)}

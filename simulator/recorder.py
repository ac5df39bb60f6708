"""Records every snapshot of a rollout as versions: a row for each time a counter changes."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from simulator.memory.memory_batch import Change, MemoryBatch, Queries
from simulator.memory.snapshots import EDGE_COUNTERS, FURNITURE_COUNTERS, OBJECT_COUNTERS

Arrays = dict[str, np.ndarray]


class Recorder:
    """Follows one `MemoryBatch` and turns it into one set of arrays per home.

    A snapshot is not copied: each node and edge leaves a *version* whenever a look changes it,
    valid for the snapshots `valid_from <= s < valid_to`. A step changes some twenty of the
    three hundred edges of a home, so this takes a twentieth of the space of copies, and snapshot
    s is one mask over the versions.
    """

    def __init__(self, memory: MemoryBatch) -> None:
        """Start with no snapshot."""
        self._memory = memory
        self._num_snapshots = np.zeros(memory.num_homes, dtype=np.int64)  # so far, (H,)
        self._snapshots: list[Arrays] = []
        self._versions: dict[str, list[Arrays]] = defaultdict(list)

    def add_snapshot(
        self, queries: Queries, answers: np.ndarray, belief: np.ndarray | None = None
    ) -> None:
        """Record the memories at queries; a home may have several, or none.

        Args:
            queries: what is asked, (Q,); one snapshot each.
            answers: furniture that truly holds the object asked for, bool (Q, F).
            belief: what `HomeFilter` believes about them, (Q, F, 4); given always or never.
        """
        self._snapshots.append(
            {
                "home": queries.home,
                "time": np.full(len(queries.home), self._memory.time, dtype=np.int32),
                "query_row": queries.object,
                "query_prior": queries.prior,
                "answers": answers,
            }
            | ({} if belief is None else {"belief": belief})
        )
        self._num_snapshots += np.bincount(queries.home, minlength=self._memory.num_homes)

    def add_change(self, change: Change) -> None:
        """Record what a look has changed; valid from the next snapshot on."""
        memory = self._memory
        objects, edges = change.objects, change.edges
        self._add_versions(
            "object",
            memory.objects["home"][objects],
            objects,
            {name: memory.objects[name][objects] for name in OBJECT_COUNTERS},
        )
        self._add_versions(
            "edge",
            memory.edges["home"][edges],
            edges,
            {name: memory.edges[name][edges] for name in EDGE_COUNTERS},
        )
        place = (change.home, change.furniture)
        self._add_versions(
            "furniture",
            change.home,
            change.furniture,
            {name: getattr(memory, f"furniture_{name}")[place] for name in FURNITURE_COUNTERS},
        )

    def finish(self) -> list[Arrays]:
        """Return the arrays of every home; docs/data.md lists them with their shapes."""
        memory = self._memory
        snapshots = {
            name: np.concatenate([row[name] for row in self._snapshots])
            for name in self._snapshots[0]
        }  # (snapshots of all homes, ...)
        versions = {kind: self._sort_versions(kind) for kind in ("object", "edge", "furniture")}
        shards = []
        for home in range(memory.num_homes):
            objects = np.flatnonzero(memory.objects["home"] == home)
            edges = np.flatnonzero(memory.edges["home"] == home)
            number = np.full(len(memory.objects), -1, dtype=np.int32)
            number[objects] = np.arange(len(objects))
            edge_number = np.full(len(memory.edges), -1, dtype=np.int32)
            edge_number[edges] = np.arange(len(edges))
            asked = np.flatnonzero(snapshots["home"] == home)
            arrays = {
                "room_label": memory.room_label[home],
                "furniture_label": memory.furniture_label[home],
                "furniture_room": memory.furniture_room[home],
                "furniture_prob": memory.place_prior.furniture_prob[home],
                "object_label": memory.objects["label"][objects],
                "object_key": memory.objects["key"][objects],
                "edge_object": number[memory.edges["object"][edges]],
                "edge_furniture": memory.edges["furniture"][edges],
                "edge_relation": memory.edges["relation"][edges],
                "edge_prior": memory.edges["prior"][edges],
                "snapshot_time": snapshots["time"][asked],
                "snapshot_query": number[snapshots["query_row"][asked]],
                "snapshot_prior": snapshots["query_prior"][asked],
                "snapshot_answers": snapshots["answers"][asked],
            }
            if "belief" in snapshots:
                arrays["snapshot_belief"] = snapshots["belief"][asked]
            numbers: Arrays = {
                "object": number,
                "edge": edge_number,
                "furniture": np.arange(memory.num_furniture),
            }
            for kind, columns in versions.items():
                own = columns["home"] == home
                for name, column in columns.items():
                    if name == "row":
                        arrays[f"{kind}_version_of"] = numbers[kind][column[own]]
                    elif name != "home":
                        arrays[f"{kind}_version_{name}"] = column[own]
            shards.append({name: _compact(array) for name, array in arrays.items()})
        return shards

    def _add_versions(self, kind: str, home: np.ndarray, rows: np.ndarray, values: Arrays) -> None:
        valid_from = self._num_snapshots[home]
        self._versions[kind].append({"home": home, "row": rows, "valid_from": valid_from, **values})

    def _sort_versions(self, kind: str) -> Arrays:
        """Order the versions by home and row, and end each where the next one begins."""
        parts = self._versions[kind]
        columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        order = np.lexsort((columns["valid_from"], columns["row"], columns["home"]))
        columns = {name: column[order] for name, column in columns.items()}
        is_last = np.ones(len(order), dtype=bool)
        is_last[:-1] = (columns["row"][1:] != columns["row"][:-1]) | (
            columns["home"][1:] != columns["home"][:-1]
        )
        following = np.append(columns["valid_from"][1:], 0)
        columns["valid_to"] = np.where(is_last, self._num_snapshots[columns["home"]], following)
        return columns


def _compact(array: np.ndarray) -> np.ndarray:
    """Give an array its type on disk: int32, float32 or uint8, in C order."""
    if array.dtype == np.bool_:
        return np.ascontiguousarray(array, dtype=np.uint8)
    if array.dtype.kind == "f":
        return np.ascontiguousarray(array, dtype=np.float32)
    return np.ascontiguousarray(array, dtype=np.int32)

"""The prior as an agent can use it: where things tend to be among the furniture it knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from simulator.priors.prior_graph import PriorGraph


class PlacePrior:
    """Prior weight of each place of known homes for each object type.

    Built from the prior graph and the layout alone (room and furniture labels); a home's noise
    never enters. Furniture in a room where the prior does not have it takes the mean over the
    rooms where it does; unknown furniture, unknown objects and what is beyond the furniture of a
    home have weight zero.

    Attributes:
        weights: float32 (H, O, F, 2), the last axis "in", "onTop"; for an object type it sums to
            one over the home, or to zero where the home has no place for it.
        furniture_prob: P(furniture | room) of each furniture node, float32 (H, F).
        objects: index into the prior's object types by label.
    """

    def __init__(
        self,
        prior: PriorGraph,
        room_labels: Sequence[Sequence[str]],
        furniture_labels: Sequence[Sequence[str]],
        furniture_rooms: np.ndarray,
    ) -> None:
        """Look up every furniture node of H homes.

        Args:
            prior: the prior graph.
            room_labels: (H, R).
            furniture_labels: (H, F).
            furniture_rooms: room index of each furniture node within its home, -1 beyond the
                furniture of a home, (H, F).
        """
        self.objects: Mapping[str, int] = {row.label: i for i, row in enumerate(prior.objects)}
        nodes: dict[tuple[str | None, str], int] = {
            (row.room, row.label): i for i, row in enumerate(prior.furniture)
        }
        # One more column per label for "in a room the prior does not know it in".
        same_label: dict[str, list[int]] = {}
        for index, row in enumerate(prior.furniture):
            same_label.setdefault(row.label, []).append(index)
        columns = [prior.weights]
        room_prob = np.array([row.prob for row in prior.furniture])
        total = {
            room: sum(row.prob for row in prior.furniture if row.room == room)
            for room in prior.rooms
        }
        node_prob = [room_prob / np.array([total[row.room] or 1.0 for row in prior.furniture])]
        for label, members in same_label.items():
            nodes[None, label] = len(prior.furniture) + len(columns) - 1
            columns.append(prior.weights[:, members].mean(axis=1, keepdims=True))
            node_prob.append(node_prob[0][members].mean(keepdims=True))
        columns.append(np.zeros_like(prior.weights[:, :1]))
        node_prob.append(np.zeros(1))
        table, prob = np.concatenate(columns, axis=1), np.concatenate(node_prob)
        unknown = table.shape[1] - 1
        node = np.array(
            [
                [
                    unknown
                    if room < 0
                    else nodes.get((rooms[room], label), nodes.get((None, label), unknown))
                    for label, room in zip(labels, home_rooms, strict=True)
                ]
                for rooms, labels, home_rooms in zip(
                    room_labels, furniture_labels, furniture_rooms, strict=True
                )
            ],
            dtype=np.int64,
        )
        weights = np.moveaxis(table[:, node], 0, 1)  # (H, O, F, 2)
        sums = np.empty((*weights.shape[:2], 1, 1))
        sizes = np.count_nonzero(np.asarray(furniture_rooms) >= 0, axis=1)
        for size in np.unique(sizes):  # a row of another length is summed up in another order
            own = np.flatnonzero(sizes == size)
            alike = np.moveaxis(table[:, node[own, :size]], 0, 1)
            sums[own] = alike.sum(axis=(2, 3), keepdims=True)
        self.weights = np.divide(weights, sums, out=np.zeros(weights.shape), where=sums > 0).astype(
            np.float32
        )
        self.furniture_prob = prob[node].astype(np.float32)

    def rows(self, home: np.ndarray, object_type: np.ndarray) -> np.ndarray:
        """Return the prior over places, (n,), (n,) -> (n, F, 2); type -1 is unknown: zeros."""
        rows = self.weights[home, np.maximum(object_type, 0)]
        return np.where((object_type >= 0)[:, None, None], rows, 0)

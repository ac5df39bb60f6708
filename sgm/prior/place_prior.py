"""The prior as an agent can use it: where things tend to be among the furniture it knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from sgm.arrays.grouped import sum_relations
from sgm.arrays.kept_rows import KeptRows
from sgm.prior.prior_graph import PriorGraph
from sgm.text.vectors import Alike, weigh

_MOST_FOUND = 20_000  # homes and labels whose shares by words are kept: 20 MB of 100 places


class PlacePrior:
    """Prior weight of each place of known homes for each object type.

    Built from the prior graph and the layout alone (room and furniture labels); a home's noise
    never enters. Furniture in a room where the prior does not have it takes the mean over the
    rooms where it does; unknown furniture, unknown objects and what is beyond the furniture of a
    home have weight zero.

    Attributes:
        weights: float32 (H, O, F, relations); for an object type it sums to one over the home, or
            to zero where the home has no place for it.
        furniture_prob: P(furniture | room) of each furniture node, float32 (H, F).
        objects: index into the prior's object types by label.
    """

    def __init__(
        self,
        prior: PriorGraph,
        room_labels: Sequence[Sequence[str]],
        furniture_labels: Sequence[Sequence[str]],
        furniture_rooms: np.ndarray,
        view: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> None:
        """Look up every furniture node of H homes.

        Args:
            prior: the prior graph.
            room_labels: (H, R).
            furniture_labels: (H, F).
            furniture_rooms: room index of each furniture node within its home, -1 beyond the
                furniture of a home, (H, F).
            view: what the agents of these homes make of the true prior, `Homes.view_prior`.
        """
        self.objects: Mapping[str, int] = {
            object_type.label: i for i, object_type in enumerate(prior.objects)
        }
        self._view = view
        self._columns = columns = _Columns.make(prior)
        self._labels = list(map(list, furniture_labels))
        # The label of each furniture node's room, none where there is no furniture.
        self._rooms = [
            [None if room < 0 else rooms[room] for room in home_rooms]
            for rooms, home_rooms in zip(room_labels, furniture_rooms, strict=True)
        ]
        self._is_place = np.asarray(furniture_rooms) >= 0
        # By words, as the same is asked again.
        self._found = KeptRows[tuple[int, str]](_MOST_FOUND)
        self._node = np.array(
            [
                [
                    columns.unknown if room is None else columns.find(room, label)
                    for room, label in zip(rooms, labels, strict=True)
                ]
                for rooms, labels in zip(self._rooms, self._labels, strict=True)
            ],
            dtype=np.int64,
        )
        self.weights = self._share(np.moveaxis(columns.weights.take(self._node, axis=1), 0, 1))
        self.furniture_prob = columns.prob[self._node].astype(np.float32)

    def rows(self, home: np.ndarray, object_type: np.ndarray) -> np.ndarray:
        """Return the prior over places, (n,), (n,) -> (n, F, relations); zeros for type -1."""
        rows = self.weights[home, np.maximum(object_type, 0)]
        return np.where((object_type >= 0)[:, None, None], rows, 0)

    @cached_property
    def furniture_cosine(self) -> np.ndarray:
        """Cosine of unknown furniture to the known label it is most like, (H, F), 1 for known."""
        cosine = np.ones(self._is_place.shape)
        for home, place in self._list_unknown():
            cosine[home, place] = self._columns.words.cosines([self._labels[home][place]]).max()
        return cosine

    @cached_property
    def weights_by_words(self) -> np.ndarray:
        """The weights with unknown furniture taken for what it is called like, float32 (H, O, F).

        An object type's weights sum to one over the home, or to zero.
        """
        unknown = self._list_unknown()
        if not unknown:
            return sum_relations(self.weights)
        # (H, O, F, relations)
        weights = np.moveaxis(self._columns.weights.take(self._node, axis=1), 0, 1)
        for home, place in unknown:
            room, label = self._rooms[home][place], self._labels[home][place]
            weights[home, :, place] = self._columns.blend(str(room), label)
        return sum_relations(self._share(weights))

    @cached_property
    def crowding(self) -> np.ndarray:
        """What all object types together weigh at each place, (H, F): where all is kept."""
        return self.weights_by_words.sum(axis=1)

    def find_by_words(
        self, home: np.ndarray, labels: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return where things are kept that are called like each of n objects, itself left out.

        Returns:
            A share of each place, (n, F), zeros where nothing is known, and the cosine to the
            object type it is most like of those that are known in the home, (n,), 0 for none.
        """
        keys = list(zip(home.tolist(), labels, strict=True))
        rows = np.array(self._found.take(keys, self._weigh_words)).reshape(
            len(keys), self.weights.shape[2] + 1
        )
        return rows[:, :-1], rows[:, -1]

    def _weigh_words(self, keys: Sequence[tuple[int, str]]) -> np.ndarray:
        """Return shares of places and the cosine, of objects by home and label, (n, F + 1)."""
        homes = np.array([home for home, _ in keys])
        is_present = self._has_place[homes]
        cosines = self._object_words.cosines([label for _, label in keys])
        weights = weigh(cosines, is_present)
        share = np.einsum("no,nof->nf", weights, self.weights_by_words[homes])
        most = np.where(is_present, cosines, 0).max(axis=1, keepdims=True, initial=0)
        return np.append(share, most, axis=1)

    @cached_property
    def _has_place(self) -> np.ndarray:
        return self.weights_by_words.sum(axis=2) > 0

    @cached_property
    def _object_words(self) -> Alike:
        return Alike(list(self.objects))

    def _list_unknown(self) -> list[tuple[int, int]]:
        """Home and index of all furniture whose label the prior does not have."""
        is_unknown = self._is_place & (self._node == self._columns.unknown)
        return [(int(home), int(place)) for home, place in np.argwhere(is_unknown)]

    def _share(self, weights: np.ndarray) -> np.ndarray:
        """Scale weights of places, (H, O, F, relations), to a sum of one a type, as agents see."""
        sums = np.empty((*weights.shape[:2], 1, 1))
        sizes = np.count_nonzero(self._is_place, axis=1)
        for size in np.unique(sizes):  # a row of another length is summed up in another order
            homes = np.flatnonzero(sizes == size)
            is_all = len(homes) == len(sizes) and size == weights.shape[2]
            alike = weights if is_all else weights[homes, :, :size]
            # Object types first, as the prior has them: the order in memory is that of adding up.
            alike = np.ascontiguousarray(np.moveaxis(alike, 1, 0))
            sums[homes] = np.moveaxis(alike, 0, 1).sum(axis=(2, 3), keepdims=True)
        shares = np.zeros(weights.shape, dtype=np.float32)
        np.divide(weights, sums, out=shares, where=sums > 0, casting="same_kind")
        return shares if self._view is None else self._view(shares)


@dataclass(frozen=True)
class _Columns:
    """The prior's furniture nodes, then one per label for rooms where it has none, then unknown.

    Attributes:
        weights: (O, C, 2).
        prob: P(furniture | room), (C,).
        index: of each room and label; None for any other room.
        unknown: index of the last one.
    """

    weights: np.ndarray
    prob: np.ndarray
    index: Mapping[tuple[str | None, str], int]
    unknown: int

    @classmethod
    @lru_cache(maxsize=4)
    def make(cls, prior: PriorGraph) -> _Columns:
        index: dict[tuple[str | None, str], int] = {
            (furniture.room, furniture.label): i for i, furniture in enumerate(prior.furniture)
        }
        same_label: dict[str, list[int]] = {}
        for number, furniture in enumerate(prior.furniture):
            same_label.setdefault(furniture.label, []).append(number)
        columns = [prior.weights]
        room_prob = np.array([furniture.prob for furniture in prior.furniture])
        total = {
            room: sum(furniture.prob for furniture in prior.furniture if furniture.room == room)
            for room in prior.rooms
        }
        prob = [
            room_prob / np.array([total[furniture.room] or 1.0 for furniture in prior.furniture])
        ]
        for label, members in same_label.items():
            index[None, label] = len(prior.furniture) + len(columns) - 1
            columns.append(prior.weights[:, members].mean(axis=1, keepdims=True))
            prob.append(prob[0][members].mean(keepdims=True))
        columns.append(np.zeros_like(prior.weights[:, :1]))
        prob.append(np.zeros(1))
        weights = np.concatenate(columns, axis=1)
        return cls(weights, np.concatenate(prob), index, weights.shape[1] - 1)

    @cached_property
    def labels(self) -> list[str]:
        """The furniture labels that are known."""
        return [label for room, label in self.index if room is None]

    @cached_property
    def words(self) -> Alike:
        """Compares words with these labels."""
        return Alike(self.labels)

    def find(self, room: str, label: str) -> int:
        """Return the column of furniture in a room."""
        return self.index.get((room, label), self.index.get((None, label), self.unknown))

    def blend(self, room: str, label: str) -> np.ndarray:
        """Return weights, (O, relations), of furniture that is called like some that is known."""
        alike = [self.find(room, known) for known in self.labels]
        share = weigh(self.words.cosines([label]))[0]
        return np.einsum("okr,k->or", self.weights[:, alike], share)

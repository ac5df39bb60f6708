"""Recorded homes in lockstep: the same arrays as simulated ones, played from traces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.arrays.grouped import pad_rows
from sgm.memory.clock import make_clock_rows
from sgm.names.vocabulary import Vocabulary
from sgm.names.words import read_words
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import HOME_LABELS, PlaceCode
from simulator.trace.episode import Episode
from simulator.trace.trace import Trace, fill_row
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes
from simulator.world.streams import Streams


class RecordedTypes:
    """Numbers for every object type and description of some traces.

    A description is of the longest type of the prior that it ends with; if there is none, its
    last word is a type of its own, which the prior does not know.

    Attributes:
        prior: whose types come first.
        labels: house, floor, rooms, furniture and objects, each once.
        object_labels: text of every object type, those of the prior first, (T,).
        move_freq: of the prior's types; the mean of these for the others, (T,).
        num_descriptions: how many there are.
        type_of_code: object type of each description, (num_descriptions,).
        code_of: number of each description, by its words.
    """

    def __init__(self, prior: PriorGraph, traces: Sequence[Trace]) -> None:
        """Number everything that is named in the traces, in order of appearance."""
        self.prior = prior
        names = [furniture_type.label for furniture_type in prior.furniture]
        names += [object_type.label for object_type in prior.objects]
        vocabulary = Vocabulary(prior, list(dict.fromkeys([*HOME_LABELS, *prior.rooms, *names])))
        self._vocabulary = vocabulary
        self.object_labels = [object_type.label for object_type in prior.objects]
        type_of_label = {label: number for number, label in enumerate(self.object_labels)}
        texts: dict[str, str] = {}  # as first written, by their words
        for trace in traces:
            for label in (*trace.layout.room_labels, *trace.layout.furniture_labels):
                vocabulary.number(label)
            for event in trace.events:
                texts.setdefault(read_words("description", event.description), event.description)
        types = []
        for words in texts:
            label = vocabulary.labels[vocabulary.find_type(words)[0]]
            if label not in type_of_label:
                type_of_label[label] = len(self.object_labels)
                self.object_labels.append(label)
            types.append(type_of_label[label])
        self.labels = vocabulary.labels
        self.type_of_code = np.array(types, dtype=np.int32)
        self.num_descriptions = len(types)
        self._texts = list(texts.values())
        self.code_of = {words: code for code, words in enumerate(texts)}
        known = np.array([object_type.move_freq for object_type in prior.objects])
        unknown = np.full(len(self.object_labels) - len(known), known.mean())
        self.move_freq = np.concatenate([known, unknown])

    def spell(self, label: str) -> str:
        """Return a label of a room or of furniture as it stands in `labels`."""
        return self._vocabulary.get_text(label)

    def text(self, code: int) -> str:
        """Spell out one description."""
        return self._texts[code]


class RecordedHomes(Homes):
    """H recorded homes that are stepped together.

    Truth is what the traces say; asking, looking and missing draw from the same random streams
    as in simulated homes. What only a simulator can know is replaced:

    - the dynamics T of a recorded home are counted from its whole trace, the future included: how
      often an object of a description was put at each place (`Trace.arrivals`). `Oracle` and the
      NDCG of rankings read them;
    - class weights have no counterpart, so that `Ceiling` cannot play;
    - objects of types that the prior does not know are asked for as often as an average type.

    Attributes:
        time: steps so far.
        num_steps: steps that all homes were recorded for, T.
        names: of the recording of each home, (H,).
    """

    def __init__(
        self,
        episodes: Sequence[Episode],
        types: RecordedTypes,
        configs: Sequence[HomeConfig],
        streams: Streams,
    ) -> None:
        """Start at t = 0, with names of objects over all homes that are ever compared."""
        layouts = [episode.trace.layout for episode in episodes]
        spell = types.spell
        self.prior: PriorGraph = types.prior
        self.configs = tuple(configs)
        self.streams = streams
        self.num_homes = len(episodes)
        self.names = tuple(episode.trace.name for episode in episodes)
        self.room_labels = pad_rows(
            [list(map(spell, layout.room_labels)) for layout in layouts], "", object
        )
        self.furniture_labels = pad_rows(
            [list(map(spell, layout.furniture_labels)) for layout in layouts], "", object
        )
        self.furniture_room = pad_rows(
            [[furniture.room for furniture in layout.furniture.values()] for layout in layouts],
            -1,
            np.int64,
        )
        self.num_furniture = self.furniture_room.shape[1]
        self.home_num_slots = np.array([episode.trace.num_slots for episode in episodes])
        self.num_slots = int(self.home_num_slots.max())
        self.object_labels = types.object_labels
        self.object_descriptions = types
        self.move_freq = types.move_freq
        self.num_steps = min(episode.num_steps for episode in episodes)
        self.clock = make_clock_rows([episode.clock for episode in episodes])
        self.time = 0
        self._types = types
        shape = (self.num_homes, self.num_slots)
        self.object_type = np.zeros(shape, dtype=np.int32)
        self.object_code = np.zeros(shape, dtype=np.int32)
        self.object_place = np.full(shape, -1, dtype=np.int32)
        self.object_moved = np.zeros(shape, dtype=bool)
        self._columns, self._first_row = _merge(episodes, types, self.num_steps)
        traces = {id(episode.trace): episode.trace for episode in episodes}
        numbers = {key: number for number, key in enumerate(traces)}
        self._trace_of_home = np.array([numbers[id(episode.trace)] for episode in episodes])
        self._traces = list(traces.values())
        self._transitions = np.stack([self._count_transitions(trace) for trace in self._traces])
        self._apply(0)

    @property
    def labels(self) -> list[str]:
        """Every label of all homes that are compared, the same list for each of them."""
        return self._types.labels

    def evolve(self) -> None:
        """Let one recorded step pass.

        Raises:
            ValueError: if the recording has ended.
        """
        if self.time >= self.num_steps:
            raise ValueError(
                f"steps must be at most the {self.num_steps} that were recorded, got "
                f"{self.time + 1}. Play fewer, or take shorter steps."
            )
        self.time += 1
        self.object_moved[:] = False
        self._apply(self.time)

    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return the simulator's T, or the counted one, (n,), (n,) -> (n, P)."""
        return self._transitions[self._trace_of_home[homes], codes]

    def get_place_weights(self) -> np.ndarray:
        """Return the simulator's class weights, (H, T, P).

        Raises:
            ValueError: if a home was recorded, not simulated.
        """
        num_place_codes = PlaceCode.count(self.num_furniture)
        weights = np.zeros(
            (len(self._traces), len(self.object_labels), num_place_codes), np.float32
        )
        for number, trace in enumerate(self._traces):
            if trace.truth is None:
                raise ValueError(
                    f"ceiling must play in simulated homes, got the recorded home {trace.name}, "
                    "whose true dynamics are unknown. Leave it out."
                )
            for object_type, label in enumerate(self.object_labels):
                weights_of_type = trace.truth.place_weights.get(label, {})
                weights[number, object_type] = fill_row(weights_of_type, num_place_codes)
        return weights[self._trace_of_home]

    def _apply(self, step: int) -> None:
        rows = slice(self._first_row[step], self._first_row[step + 1])
        home, slot, place, code, is_move = (column[rows] for column in self._columns)
        self.object_place[home, slot] = place
        self.object_code[home, slot] = code
        self.object_type[home, slot] = self._types.type_of_code[code]
        self.object_moved[home, slot] = is_move

    def _count_transitions(self, trace: Trace) -> np.ndarray:
        """Return T of a home by description code, float32 (codes, P)."""
        num_place_codes = PlaceCode.count(self.num_furniture)
        rows = np.zeros((self._types.num_descriptions, num_place_codes), dtype=np.float32)
        if trace.truth is not None:
            for text, weights in trace.truth.transitions.items():
                code = self._types.code_of.get(read_words("description", text))
                if code is not None:
                    rows[code] = fill_row(weights, num_place_codes)
            return rows
        for words, arrivals in trace.arrivals.items():
            count = fill_row(arrivals, num_place_codes)
            rows[self._types.code_of[words]] = count / count.sum()
        return rows


def _merge(
    episodes: Sequence[Episode], types: RecordedTypes, num_steps: int
) -> tuple[list[np.ndarray], np.ndarray]:
    """Merge the changes of H episodes, and find the first row of each step, (T + 2,).

    Columns are home, slot, place, code and whether it moved: a row per slot that changes in a step,
    in order of step, (n,) each.
    """
    parts = []
    for home, episode in enumerate(episodes):
        words = [read_words("description", text) for text in episode.descriptions]
        codes = np.array([types.code_of[text] for text in words], dtype=np.int64)
        homes, code = np.full(len(episode.step), home), codes[episode.description]
        parts.append((homes, episode.slot, episode.place, code, episode.is_move, episode.step))
    *columns, step = map(np.concatenate, zip(*parts, strict=True))
    order = np.argsort(step, kind="stable")
    first = np.searchsorted(step[order], np.arange(num_steps + 2))
    return [column[order] for column in columns], first

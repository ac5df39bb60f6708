"""Names of what was recorded: object types, descriptions and labels over many homes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.names.vocabulary import Vocabulary
from sgm.names.words import read_words
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.trace import Trace


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
        names = [row.label for row in prior.furniture] + [row.label for row in prior.objects]
        vocabulary = Vocabulary(
            prior, list(dict.fromkeys(["house", "floor", *prior.rooms, *names]))
        )
        self._vocabulary = vocabulary
        self.object_labels = [row.label for row in prior.objects]
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
        known = np.array([row.move_freq for row in prior.objects])
        unknown = np.full(len(self.object_labels) - len(known), known.mean())
        self.move_freq = np.concatenate([known, unknown])

    def spell(self, label: str) -> str:
        """Return a label of a room or of furniture as it stands in `labels`."""
        return self._vocabulary.get_text(label)

    def text(self, code: int) -> str:
        """Spell out one description."""
        return self._texts[code]

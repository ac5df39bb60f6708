"""What a feature of a node, edge, place or question is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

Of = Literal[
    "node", "furniture", "object", "edge", "object edge", "query edge", "place", "question"
]
# The arrays of a batch that hold features, and what each of them holds features of.
TABLES: dict[str, tuple[Of, ...]] = {
    "node": ("node", "furniture", "object"),
    "edge": ("edge", "object edge", "query edge"),
    "place": ("place",),
    "question": ("question",),
}


@dataclass(frozen=True, slots=True)
class Feature:
    """One or more columns of a batch.

    Attributes:
        name: what it is.
        group: the switch of `FeatureConfig` that it belongs to.
        of: of what: "node", furniture and objects; "furniture"; "object"; "edge"; "object edge",
            between an object and furniture; "query edge"; "place", furniture nodes beside their own
            features, and "question", both for the embedding of evidence. It is 0 for other nodes or
            edges.
        compute: returns it for a `Selection` of them, (n,) or (n, width). Edges also have `cosine`,
            that of the text vectors of their two nodes.
        width: number of columns.
        layout: of an "edge" that joins no object; None for what is computed for these, too, of
            `cosine` and `prior` alone.
        recorded: the extra of a collection that it is computed from, if any.
        reads_others: whether it depends on what else is in a memory than the object asked for and
            its edges; if no feature does, a network without convolutions is given these alone.
    """

    name: str
    group: str
    of: Of
    compute: Callable[[Any], np.ndarray]
    width: int = 1
    layout: float | None = 0.0
    recorded: str | None = None
    reads_others: bool = False

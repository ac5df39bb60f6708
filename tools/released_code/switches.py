"""What the authors' released code does otherwise than this package, one switch each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from typing import Any
from unittest import mock

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from datamodules import feature_config
from datamodules.message_passing import ETYPE, NTYPE, make_graph
from datamodules.paper_features import EDGE_SCALE, Feature
from nep.paper import embedding
from nep.paper.encoders import heat
from sgm.schema import EDGE_TYPES, NEVER, NODE_TYPES

_EDGE_UNITS = 32
_ATTENTION_DROPOUT = 0.05
_SENDERS = ("object", "furniture")  # of messages to what they are in


@dataclass(frozen=True, slots=True)
class Switch:
    """One thing that the released code does otherwise.

    Attributes:
        title: what, in a table.
        options: of `nep.fit`.
        source: where homes come from, a name or an import path.
        change: changes our code as long as it is entered.
        networks: those it changes.
    """

    title: str
    options: tuple[str, ...] = ()
    source: str = "paper"
    change: Callable[[], AbstractContextManager[Any]] = field(default=nullcontext)
    networks: tuple[str, ...] = ("mlp", "heat")


@contextmanager
def _change_features(
    change: Callable[[Feature], Callable[[Any], np.ndarray] | None],
) -> Iterator[None]:
    """Compute some features otherwise: `change` returns how, or None."""
    changed = tuple(
        feature if (compute := change(feature)) is None else replace(feature, compute=compute)
        for feature in feature_config.FEATURES
    )
    with mock.patch.object(feature_config, "FEATURES", changed):
        yield


def _count_twice(feature: Feature) -> Callable[[Any], np.ndarray] | None:
    """Count an observed edge once more as true, and once more as false."""

    def is_seen(edges: Any) -> np.ndarray:
        seen: np.ndarray = edges["last_observed"] != NEVER
        return seen

    def count_true(edges: Any) -> np.ndarray:
        return np.asarray(edges["num_true"] + is_seen(edges))

    def count_observed(edges: Any) -> np.ndarray:
        return np.asarray(edges["num_observed"] + 2 * is_seen(edges))

    counted: dict[str, Callable[[Any], np.ndarray]] = {
        "times true, scaled": lambda edges: count_true(edges) * EDGE_SCALE,
        "times observed, scaled": lambda edges: count_observed(edges) * EDGE_SCALE,
        "share of observations in which it was true": lambda edges: (
            count_true(edges) / np.maximum(count_observed(edges), 1)
        ),
    }
    return counted.get(feature.name) if feature.of == "edge" else None


def _mark_never(feature: Feature) -> Callable[[Any], np.ndarray] | None:
    """Say -1 for the time since what has never been observed, and .1 for whether it was true."""
    marks = {
        ("node", "time since observed, scaled"): -1.0,
        ("edge", "time since observed, scaled"): -1.0,
        ("edge", "time since its state was seen to change, scaled"): -1.0,
        ("edge", "share of observations in which it was true"): 0.1,
        ("edge", "whether it was true when last observed"): 0.1,
    }
    mark = marks.get((feature.of, feature.name))
    if mark is None:
        return None
    return lambda rows: np.where(rows["last_observed"] == NEVER, mark, feature.compute(rows))


@contextmanager
def _embed_edges_narrowly() -> Iterator[None]:
    """Give edges embeddings of 32 numbers; zeros fill them up to the width of nodes."""
    make = embedding.EdgeEmbedding.__init__

    def make_narrow(self: nn.Module, units: int, *args: Any) -> None:
        make(self, units, *args)  # type: ignore[arg-type]
        *before, _ = self.second if isinstance(self.second, nn.Sequential) else [self.second]
        narrow = nn.Linear(units, _EDGE_UNITS), nn.ZeroPad1d((0, units - _EDGE_UNITS))
        self.second = nn.Sequential(*before, *narrow)

    with mock.patch.object(embedding.EdgeEmbedding, "__init__", make_narrow):
        yield


@contextmanager
def _embed_in_three_layers() -> Iterator[None]:
    """Give the embeddings of nodes and edges a third layer."""
    make = embedding.FeatureEmbedding.__init__

    def make_deep(self: nn.Module, num_features: int, units: int) -> None:
        make(self, num_features, units)  # type: ignore[arg-type]
        self.second = nn.Sequential(nn.Linear(units, units), nn.ReLU(), nn.Linear(units, units))

    with mock.patch.object(embedding.FeatureEmbedding, "__init__", make_deep):
        yield


@contextmanager
def _drop_attention() -> Iterator[None]:
    """Drop some of HEAT's attention while it is trained."""
    softmax = heat.edge_softmax

    def drop(graph: Any, logits: Tensor) -> Tensor:
        return F.dropout(softmax(graph, logits), _ATTENTION_DROPOUT, torch.is_grad_enabled())

    with mock.patch.object(heat, "edge_softmax", drop):
        yield


@contextmanager
def _send_up_alone() -> Iterator[None]:
    """Send messages from objects to furniture to rooms, and none back."""
    is_up = [
        source in _SENDERS and NODE_TYPES.index(target) < NODE_TYPES.index(source)
        for source, _, target in EDGE_TYPES
    ]
    forward = heat.HEATConv.forward

    def forward_up(self: heat.HEATConv, graph: Any, node: Tensor, edge: Tensor) -> Tensor:
        etype = graph.edata[ETYPE]
        kept = torch.tensor(is_up, device=etype.device)[etype.long()].nonzero()[:, 0]
        src, dst = (end.long().index_select(0, kept) for end in graph.edges())
        part = make_graph(src, dst, len(node))
        part.ndata[NTYPE], part.edata[ETYPE] = graph.ndata[NTYPE], etype.index_select(0, kept)
        return forward(self, part, node, edge.index_select(0, kept))

    with mock.patch.object(heat.HEATConv, "forward", forward_up):
        yield


def _join(title: str, switches: Sequence[Switch]) -> Switch:
    """Turn several switches at once; one of them at most says where homes come from."""

    @contextmanager
    def change() -> Iterator[None]:
        with ExitStack() as stack:
            for switch in switches:
                stack.enter_context(switch.change())
            yield

    options = tuple(option for switch in switches for option in switch.options)
    sources = [switch.source for switch in switches if switch.source != "paper"]
    return Switch(title, options, [*sources, "paper"][0], change)


# The first is this package as it is.
_ONE_AT_A_TIME: Mapping[str, Switch] = {
    "as_it_is": Switch("as it is"),
    "kept_starts": Switch(
        "noise never zeroes the place where an object begins",
        source="tools.released_code.kept_starts.KeptStarts",
    ),
    "counted_twice": Switch(
        "an observed edge is counted once more as true and once more as false",
        change=lambda: _change_features(_count_twice),
    ),
    "never_marked": Switch(
        "-1 and .1 for what was never observed", change=lambda: _change_features(_mark_never)
    ),
    "dropout": Switch("dropout .25", ("--model.attention.dropout=0.25",)),
    "three_layers": Switch("embeddings of three layers", change=_embed_in_three_layers),
    "batches": Switch("batches of 200", ("--data.batch_size=200",)),
    "feed_forward": Switch("feed-forward 96", ("--model.attention.feed_forward_units=96",)),
    "narrow_edges": Switch("edge embeddings of 32", change=_embed_edges_narrowly),
    "attention_dropout": Switch(
        "dropout .05 on HEAT's attention", change=_drop_attention, networks=("heat",)
    ),
    "up_alone": Switch(
        "HEAT's messages from object to furniture to room alone",
        change=_send_up_alone,
        networks=("heat",),
    ),
}
SWITCHES: Mapping[str, Switch] = {
    **_ONE_AT_A_TIME,
    "together": _join("all of these together", list(_ONE_AT_A_TIME.values())),
}

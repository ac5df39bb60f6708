"""The temporal networks by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nep.event_networks.dygformer import DyGFormer
from nep.event_networks.graph_mixer import GraphMixer
from nep.event_networks.network import TemporalNetwork
from nep.event_networks.recurrent import RecurrentPerThing
from nep.event_networks.tgn import TGN
from sgm.messages import shorten

NETWORKS: Mapping[str, type[TemporalNetwork]] = {
    "tgn": TGN,
    "graph_mixer": GraphMixer,
    "dygformer": DyGFormer,
    "recurrent": RecurrentPerThing,
}


def make_network(name: str, settings: Mapping[str, Any] | None = None) -> TemporalNetwork:
    """Make a network of random weights.

    Raises:
        ValueError: if there is no network of that name, or a setting is out of range.
        TypeError: if there is no such setting.
    """
    if name not in NETWORKS:
        raise ValueError(
            f"network must be one of {', '.join(NETWORKS)}, got {shorten(name)}. Choose one."
        )
    return NETWORKS[name](**(settings or {}))

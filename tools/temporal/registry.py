"""The temporal networks by name, and trained ones on disk: plain values and tensors alone."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from nep.tensor_file import read_tensors
from sgm.files import VERSION, VersionError, check_version, write_whole
from sgm.messages import shorten
from tools.temporal.dygformer import DyGFormer
from tools.temporal.graph_mixer import GraphMixer
from tools.temporal.network import TemporalNetwork
from tools.temporal.recurrent import RecurrentPerThing
from tools.temporal.tgn import TGN

NETWORKS: Mapping[str, type[TemporalNetwork]] = {
    "tgn": TGN,
    "graph_mixer": GraphMixer,
    "dygformer": DyGFormer,
    "recurrent": RecurrentPerThing,
}
FORMAT = "event network"
_MOST_UNITS = 4096  # of any setting: more is no network of ours


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


@dataclass(frozen=True, slots=True)
class TrainedNetwork:
    """A network, what it is called in `NETWORKS`, and what it was trained on, as JSON values.

    Whether with `sightings_alone`: it is not told that things were not seen.
    """

    name: str
    network: TemporalNetwork
    sightings_alone: bool
    training: dict[str, Any]

    def save(self, path: Path) -> None:
        """Write it, whole or not at all; the folder is made if needed."""
        content = io.BytesIO()
        parameters = {key: value.detach() for key, value in self.network.named_parameters()}
        torch.save(
            {
                "format": FORMAT,
                "version": VERSION,
                "name": self.name,
                "settings": dict(self.network.settings),
                "sightings_alone": self.sightings_alone,
                "training": self.training,
                "parameters": parameters,
            },
            content,
        )
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content.getvalue())

    @classmethod
    def load(cls, path: str | Path) -> TrainedNetwork:
        """Read what `save` wrote; nothing in the file is executed.

        Raises:
            ValueError: if it cannot be read, is damaged, or is another file.
        """
        try:
            content = read_tensors(path)
            if content["format"] != FORMAT:
                raise ValueError(f"{shorten(content['format'])}")
            check_version("network", content["version"], path)
            name, settings = content["name"], content["settings"]
            if name not in NETWORKS or any(
                isinstance(value, bool) or not 0 <= value <= _MOST_UNITS
                for value in settings.values()
            ):
                raise ValueError(f"{shorten(name)} with {shorten(settings)}")
            network = make_network(name, settings)
            load_parameters(network, content["parameters"])
            return cls(name, network, bool(content["sightings_alone"]), dict(content["training"]))
        except VersionError:
            raise
        except OSError as error:
            raise ValueError(
                f"network must be a file that can be read, got {shorten(error.strerror)} for "
                f"{path}. Train one with `python -m nep.bench temporal`, or check the path."
            ) from error
        except (ValueError, LookupError, TypeError, AttributeError, RuntimeError) as error:
            raise ValueError(
                "network must be one that nep.bench temporal wrote, got "
                f"{type(error).__name__}: {shorten(str(error))} for {path}. Train it again."
            ) from error


def load_parameters(network: TemporalNetwork, parameters: dict[str, torch.Tensor]) -> None:
    """Fill a network.

    Raises:
        ValueError: if they are those of another one, or not finite.
    """
    expected = dict(network.named_parameters())
    if expected.keys() != parameters.keys():
        raise ValueError("parameters of other names")
    for name, tensor in expected.items():
        value = parameters[name]
        if value.shape != tensor.shape or not value.isfinite().all():
            raise ValueError(f"{name} of another shape, or not finite")
        with torch.no_grad():
            tensor.copy_(value)

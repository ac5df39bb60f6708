"""What a node encoder of the Node Edge Predictor must offer."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.layers.alike import AlikeConv
from sgm.checks import check_at_least


class Encoder(nn.Module, ABC):
    """Passes messages over the graph, between the embedding of nodes and the fusion of query edges.

    A new encoder is a subclass in a file of its own and a config that names it by `class_path`.
    It keeps each argument of its constructor as an attribute of the same name, by which a
    checkpoint rebuilds it.

    Args:
        units: D, width of the node and edge embeddings, in and out.
        members: M, how many networks of their own weights answer together, side by side in
            embeddings of (N, M, D): an ensemble. An encoder that can be several offers it; those of
            a single network are (N, D).

    Attributes:
        num_hops: how many hops of in-neighbours a node's output depends on. The data module
            prunes the graph to this.
        uses_edges: whether `forward` reads the edge embeddings; if not, only query edges are
            embedded.
        has_equal_rows: whether it computes with `nep.layers.equal_rows` alone, so that its answers
            in float32 are the same to the last bit whatever else is in the batch. Any other
            encoder plays in float64, which takes longer.
        implied: arguments that files from before they existed do not say, and what they were then;
            only where that is not the default.
        joined: arguments that files of earlier versions have one by one, by the name of the one
            that holds them all.
    """

    num_hops: int
    uses_edges: bool
    has_equal_rows: ClassVar[bool] = False
    implied: ClassVar[Mapping[str, Any]] = {}
    joined: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    def __init__(self, units: int, members: int = 1) -> None:
        super().__init__()
        check_at_least(1, units=units, members=members)
        self.units = units
        self.members = members

    @abstractmethod
    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Encode the nodes.

        Args:
            batch: the batch.
            node: (N, D) or (N, M, D), embedded nodes: float32 while training, float64 when it is
                asked unless `has_equal_rows`; new tensors take its type (`node.new_zeros`).
            edge: (E, D) or (E, M, D), embedded edges, None unless `uses_edges`.

        Returns:
            As `node`; only the rows of the query edges' ends are read.
        """

    @classmethod
    def read_arguments(cls, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Return arguments of the constructor as a file has them, of this version or an earlier."""
        known = inspect.signature(cls).parameters
        found = {name: value for name, value in cls.implied.items() if name in known}
        found |= arguments
        for name, parts in cls.joined.items():
            if name in known and all(part in found for part in parts):
                found[name] = [found.pop(part) for part in parts]
        return {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in found.items()
        }

    def config(self) -> dict[str, Any]:
        """What builds this encoder again: its class path and arguments, plain data only.

        Raises:
            ValueError: if an argument of the constructor is no attribute of the same name.
        """
        cls = type(self)
        class_path = f"{cls.__module__}.{cls.__qualname__}"
        names = list(inspect.signature(cls).parameters)
        for name in names:
            if not hasattr(self, name):
                raise ValueError(
                    f"encoder must keep each argument of its constructor under its own name, got "
                    f"no attribute {name} in {class_path}. Write `self.{name} = {name}` in its "
                    "__init__: a checkpoint rebuilds the encoder from these."
                )
        return {
            "class_path": class_path,
            "init_args": {
                name: list(value) if isinstance(value := getattr(self, name), tuple) else value
                for name in names
            },
        }


class ConvolvingEncoder(Encoder):
    """Convolutions one after the other.

    Args:
        units: D, width of the node and edge embeddings, in and out.
        num_convolutions: how many.
        make: makes one: it gets the batch, nodes and, if `uses_edges`, edges.
        residual: whether a convolution's input is added to its output.
        alike: whether furniture of one label in one room then exchanges what it has, see
            `AlikeConv`.

    Attributes:
        has_relu: whether a ReLU follows each convolution.
    """

    has_relu = False

    @abstractmethod
    def __init__(
        self, units: int, num_convolutions: int, make: Callable[[], nn.Module],
        residual: bool = False, alike: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(units)
        check_num_convolutions(num_convolutions)
        self.num_convolutions = self.num_hops = num_convolutions
        self.residual, self.alike = residual, alike
        self.convolutions = nn.ModuleList(make() for _ in range(num_convolutions))
        self.exchange = AlikeConv(units) if alike else None

    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Convolve `num_convolutions` times: (N, D), (E, D) -> (N, D)."""
        more = (edge,) if self.uses_edges else ()
        for convolution in self.convolutions:
            convolved = convolution(batch, node, *more)
            if self.has_relu:
                convolved = torch.relu(convolved)
            node = node + convolved if self.residual else convolved
        return node if self.exchange is None else self.exchange(batch, node)


def check_num_convolutions(num_convolutions: int) -> None:
    """Raise ValueError unless there is at least one convolution."""
    if num_convolutions < 1:
        raise ValueError(
            f"num_convolutions must be at least 1, got {num_convolutions}. "
            "For none, use the encoder nep.encoders.MLP."
        )

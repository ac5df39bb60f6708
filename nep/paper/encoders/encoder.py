"""What a node encoder of the Node Edge Predictor must offer, and what several of them share."""

from __future__ import annotations

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from sgm.checks import check_at_least


class Encoder(nn.Module, ABC):
    """Passes messages over the graph, between the embedding of nodes and the fusion of query edges.

    A new encoder is a subclass in a file of its own and a config that names it by `class_path`.
    It keeps each argument of its constructor as an attribute of the same name, by which a
    checkpoint rebuilds it.

    Args:
        units: D, width of the node and edge embeddings, in and out.

    Attributes:
        num_hops: how many hops of in-neighbours a node's output depends on. The data module
            prunes the graph to this.
        uses_edges: whether `forward` reads the edge embeddings; if not, only query edges are
            embedded.
    """

    num_hops: int
    uses_edges: bool

    def __init__(self, units: int) -> None:
        super().__init__()
        check_at_least(1, units=units)
        self.units = units

    @abstractmethod
    def forward(self, graph: Any, node: Any, edge: Any) -> Any:
        """Encode the nodes, as a module of DGL; what is written to the graph is forgotten.

        Args:
            graph: `Batch.homogeneous`, a `dgl.DGLGraph` of all nodes and edges, type after type,
                with the ids of their types in `graph.ndata["_TYPE"]` and `graph.edata["_TYPE"]`.
            node: embedded nodes, (N, D): float32 while training, float64 when it is asked.
            edge: embedded edges, (E, D), None unless `uses_edges`.

        Returns:
            As `node`; only the rows of the query edges' ends are read.
        """

    def encode(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Run `forward` on the graph of a batch, in float32 at least: (N, D) -> (N, D)."""
        if node.dtype.itemsize < 4:  # DGL has no kernels for bfloat16 on a CPU
            node, edge = node.float(), None if edge is None else edge.float()
            precision: Any = torch.autocast(node.device.type, enabled=False)
        else:
            precision = nullcontext()
        with precision:
            return self._run(batch, node, edge)

    def _run(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        with batch.homogeneous.local_scope():
            encoded: Tensor = self(batch.homogeneous, node, edge)
        return encoded

    def config(self) -> dict[str, Any]:
        """What builds this encoder again: its class path and arguments, plain data only.

        Raises:
            ValueError: if an argument of the constructor is no attribute of the same name.
        """
        cls = type(self)
        class_path = f"{cls.__module__}.{cls.__qualname__}"
        arguments = {}
        for name in inspect.signature(cls).parameters:
            if not hasattr(self, name):
                raise ValueError(
                    f"encoder must keep each argument of its constructor under its own name, got "
                    f"no attribute {name} in {class_path}. Write `self.{name} = {name}` in its "
                    "__init__: a checkpoint rebuilds the encoder from these."
                )
            value = getattr(self, name)
            arguments[name] = list(value) if isinstance(value, tuple) else value
        return {"class_path": class_path, "init_args": arguments}


class ConvolvingEncoder(Encoder):
    """Convolutions one after the other.

    Args:
        units: D, width of the node and edge embeddings, in and out.
        num_convolutions: how many.
        make: makes one: it gets graph, nodes and, if `uses_edges`, edges.
        residual: whether a convolution's input is added to its output.

    Attributes:
        has_relu: whether a ReLU follows each convolution.
    """

    has_relu = False

    @abstractmethod
    def __init__(
        self, units: int, num_convolutions: int, make: Callable[[], nn.Module], residual: bool
    ) -> None:
        super().__init__(units)
        if num_convolutions < 1:
            raise ValueError(
                f"num_convolutions must be at least 1, got {num_convolutions}. "
                "For none, use the encoder MLP."
            )
        self.num_convolutions = self.num_hops = num_convolutions
        self.residual = residual
        self.convolutions = nn.ModuleList(make() for _ in range(num_convolutions))

    def forward(self, graph: Any, node: Tensor, edge: Tensor | None) -> Tensor:
        """Convolve `num_convolutions` times: (N, D), (E, D) -> (N, D)."""
        more = (edge,) if self.uses_edges else ()
        for convolution in self.convolutions:
            convolved = convolution(graph, node, *more)
            if self.has_relu:
                convolved = torch.relu(convolved)
            node = node + convolved if self.residual else convolved
        return node


def check_heads(owner: str, heads: int, units: int) -> None:
    """Raise ValueError unless the units of a layer can be shared out among its heads."""
    if heads < 1 or units % heads:
        raise ValueError(
            f"heads of {owner} must divide its units, got {heads} heads for {units} units. Choose "
            "for instance 1, 2 or 4 heads for 64 units."
        )


def make_glorot(fan_in: int, fan_out: int, *shapes: tuple[int, ...]) -> list[nn.Parameter]:
    """Draw matrices as if of one size (Glorot and Bengio 2010, equation 16)."""
    bound = math.sqrt(6.0 / (fan_in + fan_out))
    return [nn.Parameter(torch.empty(shape).uniform_(-bound, bound)) for shape in shapes]


def lie_by_type(types: Tensor) -> bool:
    """Tell whether rows lie type after type, by the type of each: (n,)."""
    return bool((types[1:] >= types[:-1]).all())


def multiply_by_type(rows: Tensor, types: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    """Multiply each row by the matrix of its type and add its vector.

    (n, C), (n,) int64, (T, C, D), (T, D) -> (n, D). Rows lie type after type, as in the
    homogeneous view of a graph; others are put in order, and back.
    """
    if not lie_by_type(types):
        order = types.argsort(stable=True)
        found = multiply_by_type(rows[order], types[order], weight, bias)
        return found[order.argsort()]
    blocks = rows.split(types.bincount(minlength=len(weight)).tolist())
    parts = zip(bias, blocks, weight, strict=True)
    return torch.cat([torch.addmm(vector, block, matrix) for vector, block, matrix in parts])

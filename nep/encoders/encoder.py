"""What a node encoder of the Node Edge Predictor must offer, and what several of them share."""

from __future__ import annotations

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from datamodules.heterograph import EdgeType, import_dgl
from nep.layers.equal_rows import Linear
from nep.layers.segment import segment_sum
from sgm.checks import check_at_least
from sgm.schema import NODE_TYPES

if TYPE_CHECKING:
    import dgl

_ROOM_EDGES = ("room", "contains", "furniture")
WITHOUT_DGL = "nep.encoders.HGT and the other encoders need none, and batch.to_pyg() is the graph."


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
    """

    num_hops: int
    uses_edges: bool
    has_equal_rows: ClassVar[bool] = False

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
        """Return arguments of the constructor, of which a file has tuples as lists."""
        return {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in arguments.items()
        }

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


class AlikeConv(nn.Module):
    r"""Each candidate place hears its like: the other candidates of its label in its room.

    .. math:: x'_i = x_i + \mathrm{ReLU}(W \mathrm{mean}_{j \in A(i)} x_j + b)

    Candidates are the furniture ends of query edges. Other nodes, and furniture without its like,
    stay as they are. After a convolution, x_j is what was seen at j: whether mugs were seen at the
    tables of this room, for a table where none was. The graph has no edges for this: with
    the rooms and labels a layer can make them, and no weight has another shape for it.

    Args:
        units: width of the nodes.

    Source: not in the paper (results/claims.md).
    """

    def __init__(self, units: int) -> None:
        super().__init__()
        self.weight = Linear(units, units)

    def forward(self, batch: Batch, node: Tensor) -> Tensor:
        """Add what the like of each candidate has: (N, units) -> (N, units)."""
        src, dst = (batch.split_edges(e)[_ROOM_EDGES] for e in (batch.edge_src, batch.edge_dst))
        room = torch.arange(batch.num_nodes, device=node.device)  # of its own, if it has no room
        room = room.index_copy(0, dst, src)
        place = batch.edge_dst.index_select(0, batch.query_edge).unique()  # (F,)
        room_label = room[place] * len(batch.text) + batch.label[place]
        kinds, group = room_label.unique(return_inverse=True)
        size = group.bincount(minlength=len(kinds))[group].unsqueeze(1)  # (F, 1)
        grouped = node.index_select(0, place)
        total = segment_sum(grouped, group, len(kinds)).index_select(0, group)
        heard = torch.relu(self.weight((total - grouped) / (size - 1).clamp(min=1)))
        return node.index_add(0, place, (heard * (size > 1)).to(node.dtype))


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
        self,
        units: int,
        num_convolutions: int,
        make: Callable[[], nn.Module],
        residual: bool = False,
        alike: bool = False,
    ) -> None:
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


class DGLEncoder(Encoder):
    """An encoder that gets the batch as a DGL heterograph, for `dgl.nn` and `update_all`.

    A subclass defines `forward_graph`, `num_hops` and `uses_edges`, and keeps each argument of its
    constructor as an attribute of the same name, as every encoder does (docs/research.md has an
    example). Where speed matters, write against the arrays of `Batch` instead:
    benchmarks/dgl_encoder.py compares the two.

    Args:
        units: D, width of the node and edge embeddings, in and out.

    Raises:
        ModuleNotFoundError: if DGL is not installed.
    """

    def __init__(self, units: int) -> None:
        super().__init__(units)
        import_dgl(type(self).__name__, WITHOUT_DGL)

    @abstractmethod
    def forward_graph(
        self, graph: dgl.DGLGraph, node: dict[str, Tensor], edge: dict[EdgeType, Tensor]
    ) -> dict[str, Tensor]:
        """Encode the nodes.

        Args:
            graph: `Batch.graph`, with its node and edge data; what is written to it is gone
                afterwards.
            node: embedded nodes of every node type, (N, D) each: float32 while training, float64
                when it is asked (`nep.players.policy`), as are the columns of the graph.
            edge: embedded edges of every edge type, (E, D) each; empty unless `uses_edges`.

        Returns:
            (N, D) for each node type; the nodes of a type that is left out stay as they are.
        """

    def forward(self, batch: Batch, node: Tensor, edge: Tensor | None) -> Tensor:
        """Hand the batch to `forward_graph`: (N, D), (E, D) -> (N, D)."""
        # DGL has no kernels for bfloat16 on a CPU.
        dtype = torch.float32 if node.dtype.itemsize < 4 else node.dtype
        heterograph = _take_graph(batch.to(batch.label.device, dtype), node.device)
        with heterograph.local_scope(), torch.autocast(node.device.type, enabled=False):
            nodes = batch.split_nodes(node.to(dtype))
            edges = {} if edge is None else batch.split_edges(edge.to(dtype))
            encoded = self.forward_graph(heterograph, nodes, edges)
        return torch.cat([encoded.get(ntype, nodes[ntype]) for ntype in NODE_TYPES])


def _take_graph(batch: Batch, device: torch.device) -> dgl.DGLGraph:
    """Return the graph of a batch on the device of the network."""
    import dgl

    try:
        return batch.graph.to(device)
    except (dgl.DGLError, LookupError, RuntimeError) as error:
        raise ValueError(
            f"device of an encoder written with DGL must be one that DGL was built for, got "
            f"{device}. Install such a build of DGL, or train with --trainer.accelerator cpu."
        ) from error


def check_num_convolutions(num_convolutions: int) -> None:
    """Raise ValueError unless there is at least one convolution."""
    if num_convolutions < 1:
        raise ValueError(
            f"num_convolutions must be at least 1, got {num_convolutions}. "
            "For none, use the encoder nep.encoders.MLP."
        )


def check_heads(owner: str, heads: int, units: int) -> None:
    """Raise ValueError unless the units of a layer can be shared out among its heads."""
    if heads < 1 or units % heads:
        raise ValueError(
            f"heads of {owner} must divide its units, got {heads} heads for {units} units. Choose "
            "for instance 1, 2 or 4 heads for 64 units."
        )


def draw_glorot(fan_in: int, fan_out: int, *weights: nn.Parameter) -> None:
    """Draw numbers of matrices as for one of these sizes (Glorot and Bengio 2010, equation 16)."""
    bound = math.sqrt(6.0 / (fan_in + fan_out))
    for weight in weights:
        nn.init.uniform_(weight, -bound, bound)

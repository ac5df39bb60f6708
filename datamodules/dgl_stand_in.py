"""The calls of DGL that encoders use, in plain torch: for where DGL does not install.

A graph and its functions have DGL's names and meanings. `GraphStandIn` also takes DGL's own
functions, as on a GPU for which DGL was not built.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple, NoReturn

from torch import Tensor

from sgm.messages import shorten

_OPERATORS: dict[str, Callable[..., Tensor]] = {"add": operator.add, "mul": operator.mul}
_FUNCTIONS = ("copy_u", "copy_e", "u_add_v", "u_mul_e", "sum")


class Unary(NamedTuple):
    """A message that is a column of the source or of the edge, or the sum of messages."""

    name: str
    in_field: str
    out_field: str


class Binary(NamedTuple):
    """A message that is made of two columns."""

    name: str
    lhs_field: str
    rhs_field: str
    out_field: str


copy_u, copy_e, sum = (partial(Unary, name) for name in ("copy_u", "copy_e", "sum"))
u_add_v, u_mul_e = (partial(Binary, name) for name in ("u_add_v", "u_mul_e"))


class GraphStandIn:
    """Edges from source to destination nodes, with columns of data: a `dgl.DGLGraph`.

    Args:
        src, dst: ids of the ends of every edge, (E,).
        num_src: how many nodes.
        num_dst: how many destinations, if they are other nodes than the sources (DGL: a block).
    """

    def __init__(self, src: Tensor, dst: Tensor, num_src: int, num_dst: int | None = None) -> None:
        self._ends, self.is_block = {"u": src, "v": dst}, num_dst is not None
        self._num_dst = num_src if num_dst is None else num_dst
        self.srcdata: dict[str, Tensor] = {}
        self.dstdata: dict[str, Tensor] = {} if self.is_block else self.srcdata
        self.edata: dict[str, Tensor] = {}
        self.ndata = self.srcdata

    def edges(self) -> tuple[Tensor, Tensor]:
        """Return source and destination of every edge."""
        return self._ends["u"], self._ends["v"]

    def in_degrees(self) -> Tensor:
        """Count the edges that enter each node."""
        return self._ends["v"].bincount(minlength=self._num_dst)

    @contextmanager
    def local_scope(self) -> Iterator[None]:
        """Forget at its end what was written to the columns within."""
        columns = [self.srcdata, self.dstdata, self.edata]
        before = [dict(data) for data in columns]
        try:
            yield
        finally:
            for data, kept in zip(columns, before, strict=True):
                data.clear()
                data.update(kept)

    def apply_edges(self, message: Any) -> None:
        """Write the messages to the edges."""
        self.edata[message.out_field] = self._send(message)

    def update_all(self, message: Any, reduce: Any) -> None:
        """Sum up the messages at their destinations; zero where no edge enters."""
        if reduce.name != "sum":
            _refuse(reduce.name)
        sent = self._send(message)
        total = sent.new_zeros(self._num_dst, *sent.shape[1:])
        self.dstdata[reduce.out_field] = total.index_add(0, self._ends["v"], sent)

    def softmax(self, logits: Tensor) -> Tensor:
        """Softmax over the edges that enter each node, each column on its own: (E, ...)."""
        dst = self._ends["v"]
        # The largest only keeps exp from overflowing; it cancels, so no gradient flows through it.
        largest = logits.new_zeros(self._num_dst, *logits.shape[1:])
        index = dst.view(-1, *[1] * (logits.ndim - 1)).expand_as(logits)
        largest = largest.scatter_reduce(0, index, logits.detach(), "amax", include_self=False)
        weight = (logits - largest.index_select(0, dst)).exp()
        total = weight.new_zeros(largest.shape).index_add(0, dst, weight)
        return weight / total.index_select(0, dst)

    def _send(self, message: Any) -> Tensor:
        if message.name.startswith("copy_"):
            return self._read(message.name[-1], message.in_field)
        lhs, name, rhs = message.name.split("_")
        if name not in _OPERATORS:
            _refuse(message.name)
        values = self._read(lhs, message.lhs_field), self._read(rhs, message.rhs_field)
        return _OPERATORS[name](*values)

    def _read(self, target: str, field: str) -> Tensor:
        if target == "e":
            return self.edata[field]
        data = self.srcdata if target == "u" else self.dstdata
        return data[field].index_select(0, self._ends[target])


def __getattr__(name: str) -> Any:
    """Say which functions there are, if another one of `dgl.function` is looked for."""
    _refuse(name)


def _refuse(name: str) -> NoReturn:
    raise AttributeError(
        f"function of messages without DGL must be one of {', '.join(_FUNCTIONS)}, got "
        f"{shorten(name)}. Write it with these, or install a DGL that was built for the device."
    )

"""Layers whose answers in float32 do not depend on what else is in the batch, to the last bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from datamodules.batch import Batch

ROWS = 32  # of every product, however many there are: BLAS chooses its kernel by their number
_COLUMNS = 16  # their number is a multiple: a product with a single one has a kernel of its own
_ALIGNMENT = 64  # of the first row, in bytes
_SUM_SCALE = 2.0**24  # sums are of multiples of one over this

_is_on: ContextVar[bool] = ContextVar("equal_rows", default=False)


@contextmanager
def equal_rows(on: bool = True) -> Iterator[None]:
    """Within it, what a network says of a home does not depend on the homes beside it.

    Products with weights are computed in blocks of 32 rows, sums of rows in whole numbers. It is
    for networks in float32 on a CPU that compute with the functions of this module.
    """
    token = _is_on.set(on)
    try:
        yield
    finally:
        _is_on.reset(token)


def needs_equal_rows() -> bool:
    """Tell whether this is within `equal_rows`."""
    return _is_on.get()


class Linear(nn.Linear):
    """`torch.nn.Linear`, within `equal_rows` in blocks of rows."""

    def forward(self, values: Tensor) -> Tensor:
        """Apply it: (N, in_features) -> (N, out_features)."""
        if not _is_on.get():
            return super().forward(values)
        return multiply(values, self.weight.t(), self.bias)


def multiply(rows: Tensor, weight: Tensor, bias: Tensor | None = None) -> Tensor:
    """Multiply rows by weights and add a bias, within `equal_rows` in blocks of rows.

    (N, C), (C, D), (D,) or (N, D) -> (N, D).
    """
    if not _is_on.get():
        return rows @ weight if bias is None else torch.addmm(bias, rows, weight)
    num_rows, width = rows.shape
    num_columns = weight.shape[1]
    num_blocks = -(-num_rows // ROWS)
    if num_columns % _COLUMNS:
        weight = functional.pad(weight, (0, -num_columns % _COLUMNS))
    is_whole = num_rows % ROWS == 0 and rows.is_contiguous()
    if not is_whole or rows.data_ptr() % _ALIGNMENT:
        padded = rows.new_empty(num_blocks * ROWS, width)
        padded[:num_rows] = rows
        padded[num_rows:] = 0
        rows = padded
    blocks = rows.view(num_blocks, ROWS, width)
    product = torch.bmm(blocks, weight.expand(num_blocks, -1, -1)).flatten(0, 1)
    product = product[:num_rows, :num_columns]
    return product if bias is None else product.add_(bias)


def project_per_node_type(
    batch: Batch, node: Tensor, weight: Tensor, bias: Tensor | None = None
) -> Tensor:
    """Multiply each node by the matrix of its type: (N, C), (5, C, D), (5, D) -> (N, D)."""
    rows = enumerate(node.split(batch.node_counts))
    # of a single home two blocks are empty; one stays, since all may be
    blocks = [(number, block) for number, block in rows if len(block) or not number]
    return torch.cat(
        [multiply(block, weight[n], None if bias is None else bias[n]) for n, block in blocks]
    )


def sum_rows(values: Tensor, segment: Tensor, num_segments: int) -> Tensor:
    """Sum the rows of each segment, equal in any order of rows: (E, D), (E,) -> (S, D).

    Sums of whole numbers are exact in float64.
    """
    whole = values.double().mul_(_SUM_SCALE).round_()
    sums = whole.new_zeros(num_segments, values.shape[1]).index_add_(0, segment, whole)
    return sums.div_(_SUM_SCALE).float()


def apply_to_each(function: Callable[[Tensor], Tensor], values: Tensor) -> Tensor:
    """Apply a function like `torch.exp`, within `equal_rows` by way of float64.

    The last numbers of a tensor do not fill a vector register, and get another last bit.
    """
    if not _is_on.get():
        return function(values)
    return function(values.double()).to(values.dtype)

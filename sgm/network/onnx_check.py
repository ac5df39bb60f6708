"""What an ONNX file may hold, read before ONNX Runtime sees it; needs no package `onnx`.

A network of ours is a chain of products with constant matrices and of operations that work element
by element or along one axis. Whatever else the format allows is refused: other operators, graphs
within graphs, functions, tensors in other files. With the rules for constants below, every tensor
of the graph has the number of questions, the number of places or one, and at most the width of a
constant as its axes: no file can ask for more memory than its own size and the question explain.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

# Inputs that must be a constant, by operator and position; all other inputs are what was computed.
_ELEMENTWISE = ("Add", "Sub", "Mul", "Div", "Max", "Clip")  # constants: numbers and vectors
_CONSTANTS = {"MatMul": {1: 2}, "ReduceSum": {1: 1}, "ReduceMax": {1: 1}}  # position: its axes
_OPERATORS = (
    *_ELEMENTWISE,
    *_CONSTANTS,
    "Cast",
    "Gelu",
    "Log",
    "Relu",
    "Round",
    "Sigmoid",
    "Softmax",
)
_TYPES: dict[int, np.dtype[Any]] = {
    1: np.dtype("<f4"),
    7: np.dtype("<i8"),
    11: np.dtype("<f8"),
}  # of `TensorProto`

# Fields that a message may have, by their numbers in onnx.proto; no other is read.
_MODEL = {"ir": 1, "producer": 2, "producer_version": 3, "graph": 7, "opset": 8}
_OPSET = {"domain": 1, "version": 2}
_GRAPH = {"node": 1, "name": 2, "initializer": 5, "input": 11, "output": 12}
_NODE = {"input": 1, "output": 2, "name": 3, "operator": 4, "attribute": 5}
_ATTRIBUTE = {"name": 1, "float": 2, "int": 3, "text": 4, "type": 20}
_TENSOR = {"dims": 1, "type": 2, "name": 8, "data": 9}

_Value = int | bytes


def check_onnx(content: bytes) -> None:
    """Check that a file is a network of ours, and asks for no more than it shows.

    Raises:
        ValueError: if not; it says what was found.
    """
    model = _read(content, _MODEL, "model")
    for opset in _messages(model, "opset"):
        if any(_read(opset, _OPSET, "opset").get("domain", [])):
            raise ValueError("operators from outside ONNX")
    graphs = _messages(model, "graph")
    if len(graphs) != 1:
        raise ValueError(f"{len(graphs)} graphs")
    graph = _read(graphs[0], _GRAPH, "graph")
    tensors = [_read_tensor(tensor) for tensor in _messages(graph, "initializer")]
    constants = dict(tensors)
    if len(constants) < len(tensors):
        raise ValueError("two constants of one name")
    for node in _messages(graph, "node"):
        _check_node(node, constants)


def _check_node(content: bytes, constants: dict[str, tuple[int, ...]]) -> None:
    node = _read(content, _NODE, "node")
    operator = _text(node.get("operator", [b""])[0])
    if operator not in _OPERATORS:
        raise ValueError(f"operator {operator[:50]!r}")
    for attribute in _messages(node, "attribute"):
        name = _text(_read(attribute, _ATTRIBUTE, "attribute").get("name", [b""])[0])
        if name == "keepdims":  # axes would move
            raise ValueError("attribute 'keepdims'")
    for position, value in enumerate(node.get("input", [])):
        shape = constants.get(_text(value))
        wanted = _CONSTANTS.get(operator, {}).get(position)
        if wanted is not None:
            if shape is None or len(shape) != wanted:
                raise ValueError(f"{operator} without a constant of {wanted} axes")
        elif shape is not None and not (operator in _ELEMENTWISE and len(shape) <= 1):
            raise ValueError(f"{operator} of a constant")


def _read_tensor(content: bytes) -> tuple[str, tuple[int, ...]]:
    """Return name and shape of a constant, whose values are in the file and finite."""
    tensor = _read(content, _TENSOR, "tensor")
    data = tensor.get("data", [b""])[0]
    kind = _TYPES.get(_int(tensor.get("type", [0])[0]))
    shape = tuple(_int(size) for size in tensor.get("dims", []))
    if kind is None or not isinstance(data, bytes):
        raise ValueError("a constant of another type")
    if any(size < 1 for size in shape) or math.prod(shape) * kind.itemsize != len(data):
        raise ValueError(f"a constant of shape {shape} in {len(data)} bytes")
    if not np.isfinite(np.frombuffer(data, kind)).all():
        raise ValueError("a constant that is not finite everywhere")
    return _text(tensor.get("name", [b""])[0]), shape


def _messages(message: dict[str, list[_Value]], name: str) -> list[bytes]:
    found = message.get(name, [])
    if any(isinstance(value, int) for value in found):
        raise ValueError(f"a number as {name}")
    return [value for value in found if isinstance(value, bytes)]


def _text(value: _Value) -> str:
    if not isinstance(value, bytes):
        raise ValueError("a number as a name")
    return value.decode("utf-8", "replace")


def _int(value: _Value) -> int:
    if not isinstance(value, int):
        raise ValueError("a text as a number")
    return value


def _read(content: bytes, names: dict[str, int], message: str) -> dict[str, list[_Value]]:
    """Return the values of each field of a message, in the order of the file."""
    name_of = {number: name for name, number in names.items()}
    found: dict[str, list[_Value]] = {}
    for number, value in _list_fields(content):
        if number not in name_of:
            raise ValueError(f"field {number} of the {message}")
        found.setdefault(name_of[number], []).append(value)
    return found


def _list_fields(content: bytes) -> Iterator[tuple[int, _Value]]:
    """List number and value of every field of a protocol buffer message."""
    offset = 0
    while offset < len(content):
        key, offset = _read_varint(content, offset)
        number, wire = key >> 3, key & 7
        if wire == 0:
            value, offset = _read_varint(content, offset)
            yield number, value
            continue
        size, offset = (4, offset) if wire == 5 else _read_varint(content, offset)
        if wire not in (2, 5) or offset + size > len(content):
            raise ValueError("a message that is cut short")
        yield number, content[offset : offset + size]
        offset += size


def _read_varint(content: bytes, offset: int) -> tuple[int, int]:
    """Return a number of seven bits a byte, the least first, and where it ends."""
    value = 0
    for shift in range(0, 70, 7):
        if offset >= len(content):
            break
        byte = content[offset]
        offset += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, offset
    raise ValueError("a message that is cut short")

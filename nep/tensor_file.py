"""Files of `torch.save`, read without calling, or allocating, what they say.

`torch.load(weights_only=True)` calls `bytearray` where a pickle names it, and lets strides of 0
make a large tensor of a small file. Here no pickle is executed: its opcodes are read one by one,
values are plain, and tensors are no larger than a small multiple of the file.
"""

from __future__ import annotations

import io
import math
import pickletools
import zipfile
from collections import Counter, OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from sgm.files import MOST_LEVELS, read_file
from sgm.messages import shorten

_MOST_BYTES = 1 << 35  # of a file
_MOST_REPEATS = 4  # times its size that what is in a file may have: some stand in two places
_DTYPES = {
    "Float": torch.float32,
    "Double": torch.float64,
    "Half": torch.float16,
    "BFloat16": torch.bfloat16,
    "Byte": torch.uint8,
    "Char": torch.int8,
    "Short": torch.int16,
    "Int": torch.int32,
    "Long": torch.int64,
    "Bool": torch.bool,
    "ComplexFloat": torch.complex64,
    "ComplexDouble": torch.complex128,
}
_NAMED: dict[str, Any] = {
    **{f"torch {name}Storage": dtype for name, dtype in _DTYPES.items()},
    **{str(dtype).replace(".", " "): dtype for dtype in _DTYPES.values()},
}
_WRITTEN = frozenset("BININT BININT1 BININT2 LONG1 BINFLOAT BINUNICODE".split())
_NEW: dict[str, Callable[[], Any]] = {
    "NONE": lambda: None,
    "NEWTRUE": lambda: True,
    "NEWFALSE": lambda: False,
    "EMPTY_LIST": list,
    "EMPTY_DICT": dict,
    "EMPTY_TUPLE": tuple,
}
_SIZES = {"TUPLE1": 1, "TUPLE2": 2, "TUPLE3": 3}
_PLAIN = (type(None), bool, int, float, str, bytes, Tensor, torch.dtype, torch.device)


def read_tensors(path: str | Path, most_repeats: int = _MOST_REPEATS) -> Any:
    """Read what `torch.save` wrote, on the CPU and without gradients.

    Args:
        path: a zip file, as torch writes since version 1.6.
        most_repeats: times the size of the file that its values may have, where each counts as
            often as it stands there. More is for a caller that copies few of them at a time.

    Raises:
        OSError: if it cannot be read, or is no regular file.
        ValueError: if it is another file, damaged, compressed, has other values than texts,
            numbers, lists, dictionaries, sets and dense tensors, or says that it holds more than it
            does. The caller names the file and what to do.
    """
    content = read_file(path, _MOST_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            found = _Reader(archive, len(content)).read()
        _count(found, most_repeats * len(content), {})
    except zipfile.BadZipFile as error:
        raise ValueError(f"no whole zip file ({shorten(str(error), 80)})") from None
    except ValueError:
        raise
    except Exception as error:  # of any kind, where bytes were changed
        raise ValueError(f"{type(error).__name__} in a damaged file") from error
    return found


class _Reader:
    """Reads one archive."""

    def __init__(self, archive: zipfile.ZipFile, size: int) -> None:
        entries = archive.infolist()
        is_stored = all(entry.compress_type == zipfile.ZIP_STORED for entry in entries)
        if not is_stored or sum(entry.file_size for entry in entries) > size:
            raise ValueError("a compressed file")
        self._archive = archive
        self._entries = {entry.filename.partition("/")[2]: entry for entry in entries}
        if len(self._entries) < len(entries):
            raise ValueError("two parts of one name")
        self._storages: dict[str, Tensor] = {}  # by key
        self._most = _MOST_REPEATS * size  # bytes of a tensor
        self._values_left = size  # for what is copied from other values
        self._calls: dict[str, Callable[..., Any]] = {
            "torch._utils _rebuild_tensor_v2": self._make_tensor,
            "torch._utils _rebuild_parameter": lambda tensor, requires_grad, hooks: tensor,
            "torch Size": lambda sizes: torch.Size(self._spend(sizes)),
            "torch device": lambda *name: torch.device(*name),
            "collections OrderedDict": lambda: OrderedDict(),
            "collections Counter": lambda counts: Counter(self._spend(counts)),
            "__builtin__ set": lambda values: set(self._spend(values)),
            "__builtin__ bytes": lambda: b"",
            "_codecs encode": lambda text, _: self._spend(text).encode("latin1"),
        }

    def read(self) -> Any:
        """Return the value of the archive."""
        if "byteorder" in self._entries and self._get("byteorder") != b"little":
            raise ValueError("numbers of another byte order")
        if "data.pkl" not in self._entries:
            raise ValueError("another zip file")
        return self._interpret(self._get("data.pkl"))

    def _interpret(self, content: bytes) -> Any:
        """Follow the opcodes of a pickle that `torch.save` writes; others are refused."""
        stack: list[Any] = []
        marks: list[int] = []
        memo: dict[Any, Any] = {}

        def pop_marked() -> list[Any]:
            start = marks.pop()
            values = stack[start:]
            del stack[start:]
            return values

        for opcode, value, _ in pickletools.genops(content):
            name = opcode.name
            if name in _WRITTEN:
                stack.append(value)
            elif name in _NEW:
                stack.append(_NEW[name]())
            elif name in ("BINPUT", "LONG_BINPUT"):
                memo[value] = stack[-1]
            elif name in ("BINGET", "LONG_BINGET"):
                stack.append(memo[value])
            elif name == "MARK":
                marks.append(len(stack))
            elif name in _SIZES:
                stack[-_SIZES[name] :] = [tuple(stack[-_SIZES[name] :])]
            elif name == "TUPLE":
                stack.append(tuple(pop_marked()))
            elif name in ("APPEND", "APPENDS"):
                values = [stack.pop()] if name == "APPEND" else pop_marked()
                _expect(stack[-1], list).extend(values)
            elif name in ("SETITEM", "SETITEMS"):
                values = [stack.pop(-2), stack.pop()] if name == "SETITEM" else pop_marked()
                _expect(stack[-1], dict).update(zip(values[::2], values[1::2], strict=True))
            elif name == "GLOBAL":
                if value not in _NAMED and value not in self._calls:
                    raise ValueError(f"{shorten(value)}, which is no plain value")
                stack.append(_NAMED[value] if value in _NAMED else _Called(value))
            elif name == "REDUCE":
                arguments = _expect(stack.pop(), tuple)
                stack.append(self._calls[_expect(stack.pop(), _Called)](*arguments))
            elif name == "BINPERSID":
                stack.append(self._find_storage(*_expect(stack.pop(), tuple)))
            elif name == "BUILD":
                stack.pop()  # attributes, such as the versions of a state dict's modules
            elif name == "STOP":
                break
            elif name != "PROTO":
                raise ValueError(f"{name}, which torch.save does not write")
        return stack.pop()

    def _find_storage(
        self, tag: str, dtype: torch.dtype, key: str, device: str, numbers: int
    ) -> Tensor:
        """Return the numbers of a storage, of which there are as many as the file has."""
        if tag != "storage" or _expect(numbers, int) < 0:
            raise ValueError("an unknown reference")
        if key not in self._storages:
            content = self._get(f"data/{_expect(key, str)}")
            if numbers * _expect(dtype, torch.dtype).itemsize != len(content):
                raise ValueError(f"a storage of {shorten(numbers)} numbers in {len(content)} bytes")
            is_bool = dtype is torch.bool
            raw = (
                torch.frombuffer(bytearray(content), dtype=torch.uint8 if is_bool else dtype)
                if content
                else torch.empty(0, dtype=dtype)
            )
            self._storages[key] = raw.bool() if is_bool else raw
        storage = self._storages[key]
        if storage.dtype != dtype:
            raise ValueError("a storage of two types")
        return storage

    def _make_tensor(
        self, storage: Tensor, offset: int, size: tuple[int, ...], stride: tuple[int, ...], *_: Any
    ) -> Tensor:
        """Return a view of a storage, within it; some numbers may stand in several places."""
        sizes, strides = _expect(tuple(size), tuple), _expect(tuple(stride), tuple)
        for value in (offset, *sizes, *strides):
            if _expect(value, int) < 0:
                raise ValueError("a tensor of negative size")
        numbers = math.prod(sizes)
        last = offset + sum((n - 1) * step for n, step in zip(sizes, strides, strict=True))
        is_within = not numbers or last < len(storage)
        if not is_within or numbers * storage.itemsize > self._most or len(sizes) > 64:
            raise ValueError(f"a tensor of {shorten(numbers)} numbers, more than the file has")
        if not numbers:
            return torch.empty(sizes, dtype=storage.dtype)
        return storage.as_strided(sizes, strides, offset)

    def _get(self, name: str) -> bytes:
        return self._archive.read(self._entries[name])

    def _spend(self, values: Any) -> Any:
        """Return a value that is copied, unless more is copied than there is."""
        self._values_left -= len(values) + 1
        if self._values_left < 0:
            raise ValueError("values that are repeated too often")
        return values


class _Called(str):
    """The name of what a pickle calls."""

    __slots__ = ()


def _expect(value: Any, wanted: type[Any]) -> Any:
    """Return a value of a type."""
    if not isinstance(value, wanted) or isinstance(value, bool):
        raise ValueError(f"a {type(value).__name__} instead of a {wanted.__name__}")
    return value


def _count(
    value: Any, most: int, known: dict[int, tuple[int, int]], depth: int = 0
) -> tuple[int, int]:
    """Return how large a value is, each part as often as it stands there, and its levels.

    Values are those of a pickle, in which a list may stand in many places, or within itself.

    Raises:
        ValueError: if it is larger, nested too deeply, or one is not plain.
    """
    if not isinstance(value, (list, tuple, dict, set)):
        if not isinstance(value, _PLAIN) or isinstance(value, _Called):
            raise ValueError(f"a {type(value).__name__}, which is no plain value")
        return 1 + value.nbytes if isinstance(value, Tensor) else 1, 0
    if id(value) not in known:
        if depth > MOST_LEVELS:
            raise ValueError("lists or dictionaries that are nested too deeply")
        known[id(value)] = (0, 0)
        parts = [*value, *value.values()] if isinstance(value, dict) else value
        counts = [_count(part, most, known, depth + 1) for part in parts]
        known[id(value)] = (
            1 + sum(size for size, _ in counts),
            1 + max((levels for _, levels in counts), default=0),
        )
    size, levels = known[id(value)]
    if not levels or levels + depth > MOST_LEVELS + 1:
        raise ValueError("lists or dictionaries that are nested too deeply")
    if size > most:
        raise ValueError("values that are repeated too often")
    return size, levels

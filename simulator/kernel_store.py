"""Where machine code of kernels is kept, and when it is as old as what it was made of.

It lies in `__pycache__` beside the file of a kernel, or in the folder of `NUMBA_CACHE_DIR`. It is
kept for the versions of Python and numba, the kind of processor, the sources of the kernel's file
and of all of ours that it imports from, and the names of the fields of all tuples that it is given:
after a change of any of them it is made anew. Nothing is written anywhere else.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import re
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache

_IMPORT = re.compile(r"^from ((?:sgm|simulator)[\w.]*) import", re.MULTILINE)
_REMEDY = "Run `python -m simulator.compile`"
_WATCHERS: list[Callable[[str], None]] = []


def keep(compiled: Any) -> Any:
    """Let a function of numba keep its machine code, where it has a file."""
    if Path(inspect.getfile(compiled.py_func)).exists():
        compiled._cache = _Store(compiled.py_func)
    return compiled


def is_kept(function: Callable[..., object]) -> bool:
    """Whether there is machine code of a function, made of its present sources."""
    return bool(_Store(function)._cache_file._load_index())


@contextmanager
def watch(on_compiled: Callable[[str], None]) -> Iterator[None]:
    """Call a function with the name of each kernel that is compiled, and say nothing else."""
    _WATCHERS.append(on_compiled)
    try:
        yield
    finally:
        _WATCHERS.remove(on_compiled)


class _Locator:
    """Where the machine code of a function is, as numba asks for it."""

    def __init__(self, function: Any, file: str) -> None:
        self._file = file
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Locator:
        return cls(function, file)

    def get_cache_path(self) -> str:
        """Return the folder; whether it can be written is no matter as long as it is read."""
        chosen: str = getattr(config, "CACHE_DIR", "")  # NUMBA_CACHE_DIR
        if chosen:
            folder = Path(self._file).resolve().parent
            name = hashlib.sha256(str(folder).encode()).hexdigest()[:16]
            return str(Path(chosen) / f"{folder.name}_{name}")
        return str(Path(importlib.util.cache_from_source(self._file)).parent)

    def ensure_cache_path(self) -> None:
        """Make the folder.

        Raises:
            OSError: if it cannot be written.
        """
        path = Path(self.get_cache_path())
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass

    def get_source_stamp(self) -> tuple[str, str]:
        """Return what machine code depends on besides the kernel's arguments."""
        return numba.__version__, compute_checksum(self._file)

    def get_disambiguator(self) -> str:
        """Return what tells functions of one name in one file apart."""
        return str(self._line)


class _Implementation(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012, numba's own is a list


class _Store(FunctionCache):
    """Machine code of one function; one line a process says that it waits for a compiler."""

    _impl_class = _Implementation

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the machine code for arguments; None if it is to be made, which is said once."""
        try:
            found = super().load_overload(signature, target)
        except OSError:  # a folder that cannot be read
            found = None
        if found is None and not _can_write(self.cache_path):
            _warn_once(self.cache_path)
        elif found is None and not _WATCHERS:
            _say_once()
        return found

    def save_overload(self, signature: Any, made: Any) -> None:
        """Keep machine code where it can be written."""
        if _can_write(self.cache_path):
            super().save_overload(signature, made)
        for watcher in _WATCHERS:
            watcher(f"{self._py_func.__module__}.{self._py_func.__name__}")

    def _index_key(self, signature: Any, code_generator: Any) -> tuple[Any, ...]:
        key = super()._index_key(signature, code_generator)
        return (*key, tuple(list_fields(signature)))


def list_fields(numba_type: Any) -> list[tuple[str, ...]]:
    """List the names of the fields of all named tuples in types of numba, outer ones first."""
    parts = numba_type if isinstance(numba_type, tuple) else getattr(numba_type, "types", ())
    if isinstance(numba_type, types.UniTuple | types.NamedUniTuple):
        parts = (numba_type.dtype,)
    is_named = isinstance(numba_type, types.BaseNamedTuple)
    fields = [tuple(numba_type.instance_class._fields)] if is_named else []
    return fields + [names for part in parts for names in list_fields(part)]


@lru_cache
def compute_checksum(file: str) -> str:
    """Return a checksum of a source and of all of ours from which it imports names."""
    source = Path(file).read_bytes()
    digest = hashlib.sha256(source)
    for name in sorted(set(_IMPORT.findall(source.decode()))):
        module = sys.modules.get(name)
        if module is not None and module.__file__ is not None:
            digest.update(Path(module.__file__).read_bytes())
    return digest.hexdigest()


@lru_cache
def _can_write(folder: str) -> bool:
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@lru_cache
def _say_once() -> None:
    print(
        "simulator: inner loops are compiled, a minute or two, once for this version. "
        f"{_REMEDY} to have it done ahead.",
        file=sys.stderr,
        flush=True,
    )


@lru_cache(maxsize=1)
def _warn_once(folder: str) -> None:
    warnings.warn(
        f"machine code of the simulator must be kept in a folder that can be written, got {folder}:"
        f" every process compiles for a minute or two. {_REMEDY} once as its owner, or set "
        "NUMBA_CACHE_DIR to a folder of yours.",
        stacklevel=2,
    )

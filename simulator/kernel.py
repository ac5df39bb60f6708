"""How an inner loop becomes machine code."""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., object])
KERNELS: list[Kernel] = []  # all of the modules that were imported


def kernel(function: Function) -> Function:
    """Compile a function when it is first called; later processes read the machine code.

    numba is loaded then, too, so that modules may import kernels at their top. Kernels lie beside
    what calls them, in files called `*_kernel.py` where there are many. They take C-contiguous
    arrays of one dtype each; others would be compiled anew. A kernel calls functions of its own
    file alone. Division by zero is numpy's: a check of every divisor would keep loops from being
    vectorised.

    `simulator.kernel_store` says where machine code is kept; `python -m simulator.compile` compiles
    all ahead.
    """
    made = Kernel(function)
    KERNELS.append(made)
    return cast("Function", made)


class Kernel:
    """A function that is compiled when it is first called."""

    def __init__(self, function: Callable[..., object]) -> None:
        update_wrapper(self, function)
        self._function = function
        self._compiled: Any = None

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call the machine code."""
        return (self._compiled or self.compile())(*args, **named)

    @property
    def is_compiled(self) -> bool:
        """Whether there is machine code for some arguments in this process."""
        return self._compiled is not None and bool(self._compiled.nopython_signatures)

    def compile(self) -> Any:
        """Return numba's function, which compiles for each kind of arguments.

        In the module of the function it takes the place of this object, as do those of the other
        kernels there: machine code can call them alone.
        """
        if self._compiled is not None:
            return self._compiled
        from numba import njit

        from simulator.kernel_store import keep

        self._compiled = keep(njit(self._function, error_model="numpy"))
        scope = self._function.__globals__
        for name, value in list(scope.items()):
            if isinstance(value, Kernel):
                scope[name] = value.compile()
        return self._compiled

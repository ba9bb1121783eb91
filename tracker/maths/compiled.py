"""Loops over pixels, compiled to machine code when the program is loaded, never in flight."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from pathlib import Path
from types import CodeType
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np

P = ParamSpec("P")
R = TypeVar("R")


REORDER = {"reassoc", "contract"}  # of sums, so that the processor takes several terms at once; NaN stays NaN
_made_of: dict[object, str] = {}  # by compiled function: a digest of all that its code comes from


def compiled(signature: str, *, inline: bool = False) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a function for one signature, at once, and keep the code beside the module for the next start.

    signature: in Numba's terms, such as "f8(f8[:, ::1], i8)"; a call that does not match it is a TypeError.
    inline: put its code where compiled code calls it; for what is asked of each pixel, since to hand over an array
        takes eleven numbers.
    Sums are taken in the order that is fastest, the same at each run of a machine.
    Division by zero gives inf or nan, as NumPy does. Where no folder can be written the code is compiled at each start.
    """

    def compile_now(function: Callable[P, R]) -> Callable[P, R]:
        try:
            return _jit(signature, function, inline, keep=True)
        except RuntimeError:  # Numba found no place for its cache
            return _jit(signature, function, inline, keep=False)

    return compile_now


def _jit(signature: str, function: Callable[P, R], inline: bool, *, keep: bool) -> Callable[P, R]:
    code: Any = numba.njit(fastmath=REORDER, error_model="numpy", forceinline=inline)(function)
    digest = _digest(function)
    if keep:
        code.enable_caching()
        # Numba asks the function's own file alone whether kept code is stale, yet what it calls is compiled into it.
        file = code._cache._cache_file
        file._source_stamp = (file._source_stamp, digest)
    code.compile(signature)
    code.disable_compile()
    _made_of[code] = digest
    made: Callable[P, R] = code
    return made


def _digest(function: Callable[..., Any]) -> str:
    """Return a digest of a function's file, of the compiled functions that it calls and of the constants it names."""
    digest = hashlib.sha256(Path(inspect.getfile(function)).read_bytes())
    for name in sorted(_names(function.__code__)):
        value = function.__globals__.get(name)
        if hasattr(value, "py_func") and value in _made_of:
            digest.update(f"{name} {_made_of[value]}".encode())
        elif isinstance(value, int | float | str | tuple):
            digest.update(f"{name} {value!r}".encode())
        elif isinstance(value, np.ndarray):
            digest.update(value.tobytes())
    return digest.hexdigest()


def _names(code: CodeType) -> set[str]:
    """Return the names that a function, or one inside it, looks up outside."""
    inner = (_names(constant) for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*inner)

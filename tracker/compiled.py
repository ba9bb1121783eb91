"""Loops over pixels, compiled to machine code when the program is loaded, never in flight."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numba

P = ParamSpec("P")
R = TypeVar("R")


REORDER = {"reassoc", "contract"}  # of sums, so that the processor takes several terms at once; NaN stays NaN


def compiled(signature: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a function for one signature, at once, and keep the code beside the module for the next start.

    signature: in Numba's terms, such as "f8(f8[:, ::1], i8)"; a call that does not match it is a TypeError.
    Sums are taken in the order that is fastest, the same at each run of a machine.
    Division by zero gives inf or nan, as NumPy does. Where no folder can be written the code is compiled at each start.
    """

    def compile_now(function: Callable[P, R]) -> Callable[P, R]:
        try:
            return _jit(signature, function, keep=True)
        except RuntimeError:  # Numba found no place for its cache
            return _jit(signature, function, keep=False)

    return compile_now


def _jit(signature: str, function: Callable[P, R], *, keep: bool) -> Callable[P, R]:
    code: Callable[P, R] = numba.njit(signature, cache=keep, fastmath=REORDER, error_model="numpy")(function)
    return code

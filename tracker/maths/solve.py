"""Small symmetric systems, solved in place inside compiled loops, where a call to LAPACK costs more than the work."""

from __future__ import annotations

import numpy as np

from tracker.maths.compiled import compiled
from tracker.types import Array

TINY = 1e-9


@compiled("f8(f8[::1], f8[::1])")
def dot(a: Array, b: Array) -> float:
    """Return the sum of products."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@compiled("void(f8[:, ::1])", inline=True)
def cholesky(A: Array) -> None:
    """Turn the lower triangle of a positive definite matrix (m, m) into its Cholesky factor, in place."""
    for j in range(len(A)):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = np.sqrt(A[j, j])
        for i in range(j + 1, len(A)):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]


@compiled("void(f8[:, ::1], f8[::1])", inline=True)
def lower(L: Array, b: Array) -> None:
    """Turn b (m,) into L^-1 b, in place."""
    for j in range(len(L)):
        for k in range(j):
            b[j] -= L[j, k] * b[k]
        b[j] /= L[j, j]


@compiled("void(f8[:, ::1], f8[::1])", inline=True)
def solve(L: Array, b: Array) -> None:
    """Turn b (m,) into A^-1 b, in place, with A's Cholesky factor L."""
    lower(L, b)
    for j in range(len(L) - 1, -1, -1):
        for k in range(j + 1, len(L)):
            b[j] -= L[k, j] * b[k]
        b[j] /= L[j, j]


@compiled("void(f8[:, ::1], i8)")
def eliminate(products: Array, count: int) -> None:
    """Take the first `count` of some rows out of the others, given the lower triangle of all their products (m, m).

    In place: what stands below is the products of what is left of the others (Gauss's elimination, the Schur
    complement).
    """
    for k in range(count):
        pivot = products[k, k]
        if pivot < TINY:
            continue
        for i in range(k + 1, len(products)):
            factor = products[i, k] / pivot
            for j in range(k + 1, i + 1):
                products[i, j] -= factor * products[j, k]

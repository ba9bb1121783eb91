"""A symmetric matrix as its upper triangle, the way the log holds covariances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tracker.types import Array

SIZE = 12
LENGTH = SIZE * (SIZE + 1) // 2
_UPPER = np.triu_indices(SIZE)
_PLACES = np.ravel_multi_index(_UPPER, (SIZE, SIZE))
DIAGONAL = tuple(i * SIZE - i * (i - 1) // 2 for i in range(SIZE))


def pack(matrix: Array) -> Array:
    """Return the 78 numbers on and above the diagonal of a (12, 12) matrix, row by row."""
    return np.asarray(matrix.take(_PLACES))


def unpack(values: Sequence[float | None]) -> Array:
    """Return the symmetric (12, 12) matrix of its 78 numbers; None, a number that was not finite, gives NaN."""
    matrix = np.empty((SIZE, SIZE))
    matrix[_UPPER] = np.array(values, dtype=np.float64)
    matrix.T[_UPPER] = matrix[_UPPER]
    return matrix

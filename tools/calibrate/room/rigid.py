"""The rigid motion between two sets of points."""

from __future__ import annotations

import numpy as np

from tracker.types import Array


def rigid(p_inA: Array, p_inB: Array) -> tuple[Array, Array]:
    """Return R_AtoB and p_AinB that take points (..., n, 3) nearest to others, never mirrored.

    Source: Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32 (1976).
    """
    mean_inA, mean_inB = p_inA.mean(axis=-2), p_inB.mean(axis=-2)
    a, b = p_inA - mean_inA[..., None, :], p_inB - mean_inB[..., None, :]
    u, _, vt = np.linalg.svd(np.swapaxes(b, -1, -2) @ a)
    signs = np.ones(u.shape[:-1])
    signs[..., 2] = np.linalg.det(u @ vt)
    R = (u * signs[..., None, :]) @ vt
    return R, mean_inB - (R @ mean_inA[..., None])[..., 0]

"""Covariances: their factors and inverses, and what becomes of them through a slope."""

from __future__ import annotations

import math

import numpy as np

from tracker.maths.compiled import compiled
from tracker.types import Array


@compiled("f8[:, ::1](f8[:, ::1])")
def factor(S: Array) -> Array:
    """Return L (n, n), lower, with L L' = S; NaN where S is not positive definite."""
    n = len(S)
    L = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            rest = S[i, j]
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(rest) if i == j else rest / L[j, j]
    return L


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1])")
def forward(L: Array, B: Array) -> Array:
    """Return L^-1 B (n, m)."""
    X = B.copy()
    for i in range(len(L)):
        for k in range(i):
            share = L[i, k]
            for j in range(B.shape[1]):
                X[i, j] -= share * X[k, j]
        for j in range(B.shape[1]):
            X[i, j] /= L[i, i]
    return X


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1], f8[:, ::1])")
def propagated(H: Array, P: Array, R: Array) -> Array:
    """Return H P H' + R."""
    m, n = H.shape
    S, HP = R.copy(), np.zeros((m, n))
    for i in range(m):
        for k in range(n):
            if H[i, k] != 0.0:
                for j in range(n):
                    HP[i, j] += H[i, k] * P[k, j]
        for j in range(i + 1):
            for k in range(n):
                S[i, j] += HP[i, k] * H[j, k]
            S[j, i] = S[i, j]
    return S


@compiled("f8[:, ::1](f8[:, ::1])")
def inverse_of(S: Array) -> Array:
    """Return the inverse of a covariance (n, n)."""
    root = forward(factor(S), np.eye(len(S)))
    inverse = np.zeros(S.shape)
    for k in range(len(S)):
        for i in range(k + 1):
            for j in range(k + 1):
                inverse[i, j] += root[k, i] * root[k, j]
    return inverse

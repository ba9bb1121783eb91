"""Directions spread evenly over the sphere."""

from __future__ import annotations

import math

import numpy as np

from tracker.types import Array


def spread(count: int) -> Array:
    """Return unit vectors (count, 3). Source: the golden spiral, Vogel, Mathematical Biosciences 44 (1979)."""
    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, math.pi * (1.0 + math.sqrt(5.0)) * k
    level = np.sqrt(1.0 - z * z)
    return np.stack((level * np.cos(turn), level * np.sin(turn), z), axis=1)

"""The middle of where a vehicle flies, about which the room's light is told."""

from __future__ import annotations

import numpy as np

from tracker.types import Array

FARTHEST_MEAN_M = 0.3  # from the middle: one that flies further on has another
ROUNDS = 50  # that its mean place is of


class Middle:
    """Follows a vehicle that was carried in, or took off, to where it flies."""

    def __init__(self) -> None:
        self._p_inW: Array | None = None  # where the first ball taught, and then where the vehicle went
        self._mean_m = np.zeros(3)

    @property
    def is_known(self) -> bool:
        """Say whether anything was learned about it."""
        return self._p_inW is not None

    def place(self, p_BinW: Array) -> Array:
        """Return how far from the middle a place (3,) is in W [m]; the first one is the middle."""
        if self._p_inW is None:
            self._p_inW = p_BinW.copy()
        return np.asarray(p_BinW - self._p_inW)

    def moved(self, p_BinW: Array) -> Array | None:
        """Take note of the vehicle's place in W when it teaches; return by how much the middle moves, None if not."""
        self._mean_m += (self.place(p_BinW) - self._mean_m) / ROUNDS
        if self._p_inW is None or not np.linalg.norm(self._mean_m) > FARTHEST_MEAN_M:
            return None
        shift_m, self._mean_m = self._mean_m, np.zeros(3)
        self._p_inW = self._p_inW + shift_m
        return shift_m

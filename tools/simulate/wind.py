"""Moving air in a room."""

from __future__ import annotations

import math

import numpy as np

from tracker.types import Array


class Wind:
    """Light gusts: an Ornstein-Uhlenbeck process for each axis of W, exact at the step's length.

    sigma_m_s: deviation of the gusts, a third of it upright.  memory_s: how long one lasts.
    """

    def __init__(self, sigma_m_s: float, memory_s: float, dt_s: float, rng: np.random.Generator) -> None:
        self._keep = math.exp(-dt_s / memory_s)
        self._kick = sigma_m_s * math.sqrt(1.0 - self._keep**2) * np.array([1.0, 1.0, 1.0 / 3.0])
        self._rng = rng
        self._now: Array = np.zeros(3)

    def blow(self) -> Array:
        """Return the wind of the next step (3,) [m/s]."""
        self._now = self._keep * self._now + self._kick * self._rng.standard_normal(3)
        return self._now

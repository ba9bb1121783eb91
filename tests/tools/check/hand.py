"""A hand that holds the vehicle, and does what the check asks of it."""

from __future__ import annotations

import math

import numpy as np

from tracker.maths import so3
from tracker.sources.paths import Pose
from tracker.types import Array

PUSH_S, REACTION_S = 1.5, 0.5
WAYS = {"forward": (0.5, 0.0, 0.0), "right": (0.0, -0.5, 0.0), "lift": (0.0, 0.0, 0.5)}
"""In the body's own axes: forward, left, up [m]."""


class Hand:
    """Hold the vehicle level, nose at a heading, and move it smoothly when asked.

    nose_rad: of the body's x axis in W, counter-clockwise from W's x.  place: in W [m].
    """

    def __init__(self, nose_rad: float, place: tuple[float, float, float] = (0.1, -0.2, 0.3)) -> None:
        self._R_BtoW = so3.from_euler(0.0, 0.0, nose_rad)
        self._from: Array = np.array(place)
        self._to: Array = self._from
        self._push_s = 0.0
        self._wiggle_s: float | None = None

    def hear(self, told: str, now_s: float) -> None:
        """Do what the check tells, after a moment."""
        for word, way in WAYS.items():
            if told.startswith("frame check") and word in told:
                self._from, self._push_s = self._to, now_s + REACTION_S
                self._to = self._from + self._R_BtoW @ np.array(way)
        if told.startswith("wiggle: take"):
            self._wiggle_s = now_s + REACTION_S
        elif told.startswith("wiggle:"):
            self._wiggle_s = None

    def pose_at(self, t_s: float) -> Pose:
        """Return p_BinW (3,) [m] and R_BtoW (3, 3) at a time [s]."""
        share = min(max((t_s - self._push_s) / PUSH_S, 0.0), 1.0)
        p_BinW = self._from + share**3 * (10.0 - 15.0 * share + 6.0 * share**2) * (self._to - self._from)
        return p_BinW, self._R_BtoW @ self._wiggle(t_s)

    def _wiggle(self, t_s: float) -> Array:
        """Turn about all axes at frequencies that share no beat, swelling from rest."""
        if self._wiggle_s is None or t_s <= self._wiggle_s:
            return np.eye(3)
        t_s -= self._wiggle_s
        size = 0.25 * min(t_s, 1.0) ** 2
        return so3.exp(size * np.array([math.sin(2 * math.pi * hz * t_s) for hz in (1.3, 1.7, 1.1)]))

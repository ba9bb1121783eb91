"""The marker carried by hand to calibrate a room: waved through it, then set down on three level spots."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tracker.maths import so3
from tracker.types import Array

AXES_inW = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, math.sqrt(2.0)]]) / math.sqrt(2.0)
REACH = np.array([0.55, 0.40, 0.35, 0.45, 0.45, math.pi])  # along AXES_inW [m], then roll, pitch, yaw [rad]
WAVES_HZ = np.array([0.13, 0.19, 0.23, 0.31, 0.29, 0.11])
CARRIED_S, STOOD_S = 1.0, 2.2
SPOTS_inW = np.array([[0.0, 0.0, -0.35], [0.5, 0.0, -0.35], [0.1, 0.45, -0.35]])
SPOT_YAWS = (0.3, 1.2, -0.8)
APART_M = float(np.linalg.norm(SPOTS_inW[1] - SPOTS_inW[0]))

Pose = tuple[Array, Array]
Path = Callable[[float], Pose]


def waved(seed: int) -> Path:
    """Return slow waves through most of what the paper's cameras see, with tilts that no flight has."""
    rng = np.random.default_rng((seed, 0xCA1))
    w = 2.0 * math.pi * WAVES_HZ * rng.uniform(0.8, 1.2, 6)
    phase = rng.uniform(0.0, 2.0 * math.pi, 6)

    def path(t_s: float) -> Pose:
        now = REACH * np.sin(w * t_s + phase)
        return now[:3] @ AXES_inW, so3.from_euler(*now[3:])

    return path


def waved_and_set_down(seed: int, wave_s: float) -> Path:
    """Return waves for a while [s], then the three spots, 2.2 s on each."""
    wave = waved(seed)

    def path(t_s: float) -> Pose:
        if t_s < wave_s:
            return wave(t_s)
        spot, since_s = divmod(t_s - wave_s, CARRIED_S + STOOD_S)
        k = min(int(spot), len(SPOT_YAWS) - 1)
        there = _stood(k)
        if since_s >= CARRIED_S or spot > k:
            return there
        return _between(wave(wave_s) if k == 0 else _stood(k - 1), there, since_s / CARRIED_S)

    return path


def _stood(k: int) -> Pose:
    return SPOTS_inW[k], so3.from_euler(0.0, 0.0, SPOT_YAWS[k])


def _between(one: Pose, other: Pose, share: float) -> Pose:
    """Return a pose on the way, that leaves and arrives gently."""
    gone = share * share * (3.0 - 2.0 * share)
    turn = so3.log(one[1].T @ other[1])
    return one[0] + gone * (other[0] - one[0]), one[1] @ so3.exp(gone * turn)

"""How briskly the vehicle manoeuvres just now: the levels of acceleration, and what pixels say of them.

A helicopter hovers for minutes and then pulls away within a frame. One sigma of acceleration for both is wrong for
both: too noisy in hover, too slow in the turn. So a few levels, from quiet to the envelope, are each asked how likely
the new pixels are, before those pixels are used: the noise is right in the very round in which the manoeuvre begins.

Source: a hidden Markov model over the levels, moment-matched to one Gaussian each round; the first-order
    generalized pseudo-Bayesian estimator (Bar-Shalom, Li, Kirubarajan, 11.6.4), whose models differ in variance only.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from tracker.maths.compiled import compiled
from tracker.state import Process
from tracker.types import Array

LEVELS = 6
STEP = 3.0  # of sigma from one level to the next
CHANGE_S = 0.7  # a level is kept for about so long
NEXT_SHARE = 0.5  # of the changes go to the level beside, the others to any


def start_levels() -> Array:
    """Return the probabilities (2, LEVELS) of a vehicle just found: nothing is known."""
    return np.full((2, LEVELS), 1.0 / LEVELS)


@lru_cache(maxsize=16)
def variances(process: Process) -> Array:
    """Return the levels' variances of acceleration (2, LEVELS): translation [m^2/s^4], rotation [rad^2/s^4]."""
    shares = STEP ** (2.0 * np.arange(1 - LEVELS, 1))
    tops = np.array([process.acceleration_m_s2, process.angular_acceleration_rad_s2]) ** 2
    return np.asarray(tops[:, None] * shares)


@compiled("f8[:, ::1](f8[:, ::1], f8)")
def later(levels: Array, dt: float) -> Array:
    """Return the probabilities (2, LEVELS) after dt without a sighting."""
    leave, after, last = 1.0 - math.exp(-dt / CHANGE_S), np.empty(levels.shape), levels.shape[1] - 1
    for k in range(2):
        for i in range(last + 1):
            beside = (levels[k, max(i - 1, 0)] + levels[k, min(i + 1, last)]) / 2.0
            change = NEXT_SHARE * beside + (1.0 - NEXT_SHARE) / LEVELS
            after[k, i] = (1.0 - leave) * levels[k, i] + leave * change
    return after


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1])")
def judged(levels: Array, log_likelihoods: Array) -> Array:
    """Return the probabilities (2, LEVELS) after pixels of these log likelihoods (2, LEVELS) under each level."""
    after = np.empty(levels.shape)
    for k in range(2):
        after[k] = levels[k] * np.exp(log_likelihoods[k] - log_likelihoods[k].max())
        after[k] /= after[k].sum()
    return after


@compiled("UniTuple(f8, 2)(f8[:, ::1], f8[:, ::1])")
def expected(levels: Array, of: Array) -> tuple[float, float]:
    """Return the mean variances of translation and rotation."""
    return (levels[0] * of[0]).sum(), (levels[1] * of[1]).sum()

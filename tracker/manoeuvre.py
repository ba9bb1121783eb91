"""How briskly the vehicle manoeuvres just now: the levels of acceleration, and what pixels say of them.

A helicopter hovers for minutes and then pulls away within a frame. One sigma of acceleration for both is wrong for
both: too noisy in hover, too slow in the turn. So a few levels, from quiet to the envelope, are each asked how likely
the new pixels are, before those pixels are used: the noise is right in the very round in which the manoeuvre begins.

Source: a hidden Markov model over the levels, moment-matched to one Gaussian each round; the first-order
    generalized pseudo-Bayesian estimator (Bar-Shalom, Li, Kirubarajan, 11.6.4), whose models differ in variance only.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.state import Process
from tracker.types import Array

LEVELS = 6
STEP = 3.0  # of sigma from one level to the next
CHANGE_S = 0.7  # a level is kept for about so long
NEXT_SHARE = 0.5  # of the changes go to the level beside, the others to any


def start_levels() -> Array:
    """Return the probabilities (2, LEVELS) of a vehicle just found: nothing is known."""
    return np.full((2, LEVELS), 1.0 / LEVELS)


def variances(process: Process) -> Array:
    """Return the levels' variances of acceleration (2, LEVELS): translation [m^2/s^4], rotation [rad^2/s^4]."""
    shares = STEP ** (2.0 * np.arange(1 - LEVELS, 1))
    tops = np.array([process.acceleration_m_s2, process.angular_acceleration_rad_s2]) ** 2
    return np.asarray(tops[:, None] * shares)


def later(levels: Array, dt: float) -> Array:
    """Return the probabilities (2, LEVELS) after dt without a sighting."""
    leave = 1.0 - math.exp(-dt / CHANGE_S)
    beside = np.zeros_like(levels)
    beside[:, 1:] += levels[:, :-1] / 2.0
    beside[:, :-1] += levels[:, 1:] / 2.0
    beside[:, 0] += levels[:, 0] / 2.0
    beside[:, -1] += levels[:, -1] / 2.0
    return np.asarray((1.0 - leave) * levels + leave * (NEXT_SHARE * beside + (1.0 - NEXT_SHARE) / LEVELS))


def judged(levels: Array, log_likelihoods: Array) -> Array:
    """Return the probabilities (2, LEVELS) after pixels of these log likelihoods (2, LEVELS) under each level."""
    weights = levels * np.exp(log_likelihoods - log_likelihoods.max(axis=1, keepdims=True))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def expected(levels: Array, of: Array) -> tuple[float, float]:
    """Return the mean variances of translation and rotation."""
    mean = (levels * of).sum(axis=1)
    return float(mean[0]), float(mean[1])

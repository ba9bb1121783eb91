"""What a round may teach of the cameras' clock offsets: no more than the vehicle's speed is known for.

A clock offset shows as speed times offset. In a hover the speed is mostly noise, and a filter that regresses on its own
noise learns offsets that are not there, surer with every round: noise on the regressor biases a slope, and the noise of
speed and that of place are the same pixels'. So a round of which a share of the speed may be noise adds that share of
what an offset may be wrong by to the offset's variance, and one whose speed is all noise teaches nothing.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.filter.correction import TILT_ROWS
from tracker.maths.compiled import compiled
from tracker.state import OFFSETS
from tracker.types import Array

CONTRADICTION = 5.0  # sigma: an offset that the cameras contradict so clearly is wrong, however vague the speed
HALF = 0.5  # of such a step is how sure it is
MOTION = 6  # components of velocity and rate; their errors follow as many of place and attitude


@compiled("f8[:, ::1](f8[:, ::1])")
def given_clocks(P: Array) -> Array:
    """Return the covariance (n, n) that P would be if the clock offsets were known."""
    known = P.copy()
    for c in range(OFFSETS, len(P)):
        if known[c, c] > 0.0:
            by_clock = known[c].copy()
            known -= np.outer(by_clock, by_clock / by_clock[c])
    return known


@compiled("f8(f8[:, ::1], f8[::1], f8[::1], f8[:, ::1])")
def _noise_share(H: Array, mean: Array, dx: Array, P: Array) -> float:
    """Return how much of the squared speed at which the pixels go is noise."""
    signal, noise = 0.0, 0.0
    for row in H[: len(H) - TILT_ROWS]:
        speed = 0.0
        for i in range(MOTION):
            speed += row[i] * (mean[12 + i] + dx[MOTION + i])
            for j in range(MOTION):
                noise += row[i] * P[MOTION + i, MOTION + j] * row[j]
        signal += speed * speed
    return noise / signal if signal > 0.0 else math.inf


@compiled("Tuple((f8[::1], f8[:, ::1]))(f8[::1], f8[:, ::1], f8, f8[:, ::1], f8[::1], f8[:, ::1])")
def taught(mean: Array, P_prior: Array, dt: float, H: Array, dx: Array, P: Array) -> tuple[Array, Array]:
    """Return dx (n,) and P (n, n) of an update, its offsets taken back to what the round may teach.

    Args:
        mean, P_prior: before, as `State.mean`.  dt: since the last update [s].
        H: (2s + 2, n) slope of the sightings, then of the tilt.  dx, P: error found, and covariance after it.
    Source: p(x, o) = p(x | o) p(o): the state given the offsets stays as the update found it, and the offsets' own
        distribution is replaced (Friedland, "Treatment of bias in recursive filtering", IEEE Trans. Automatic Control
        14 (1969), separates them the same way). With noise of share s in the regressor, an offset o is found as
        o (1 - s) (Fuller, "Measurement Error Models", 1.1.1), and noise that speed and place share, at most as if the
        place were late by dt, moves it by s dt. So each round adds one sigma of s (|o| + its sigma + dt).
    """
    known, dx, P = given_clocks(P), dx.copy(), P.copy()
    share = _noise_share(H, mean, dx, known)
    for c in range(OFFSETS, len(P)):
        before, after, step_s = P_prior[c, c], P[c, c], dx[c]
        if not before > after > 0.0:
            continue
        offset_s = mean[len(mean) - len(P) + c]
        astray = (share * (abs(offset_s) + math.sqrt(before) + dt)) ** 2
        if step_s**2 > CONTRADICTION**2 * after * (1.0 - after / before):
            astray = min(astray, (HALF * step_s) ** 2)
        back = min(before - after, astray)
        along = P[:, c] / after
        dx -= along * (step_s * back / (before - after))
        P += back * np.outer(along, along)
    return dx, P

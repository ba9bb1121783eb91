"""What each camera adds to the noise of its fits: lens, calibration, all that a single image cannot know.

A pair of cameras measures 12 numbers of 6 unknowns, so what the fits' own covariances leave unexplained shows, round
after round. Each camera has one variance beside its fits' own covariance: what moves each ball apart from the others.
It has another for what moves all its balls alike, as a mount that shakes does: the marker keeps its shape, so it shows
only in where the cameras' rays miss each other, and in a motion that no vehicle makes.

Source: score and Fisher information of a variance component, Patterson and Thompson, "Recovery of inter-block
    information", Biometrika 58 (1971): for innovations y of covariance S with dS/df = D D' and u = S^-1 y,
    score = (|D' u|^2 - tr D' S^-1 D) / 2 (1), information = |D' S^-1 D|_F^2 / 2 (2). For balls apart D picks the
    camera's rows, for all alike it sums them on each axis. Old rounds fade; what fits badly counts no more than LIMIT
    (Huber).
"""

from __future__ import annotations

import numpy as np

from tracker.filter.measure import Indices
from tracker.maths.compiled import compiled
from tracker.types import Array

LEAST_PX = 0.01
MEMORY = 300.0  # rounds
PRIOR_PIXELS = 24.0  # the config's value weighs as much as so many exact pixels
PRIOR_SHIFTS = 2.0  # as much as one image: that a camera does not shake
LIMIT = 9.0  # of a squared Mahalanobis distance with 2 degrees of freedom: of a sighting, or of what all share
APART, APART_KNOWN, ALIKE, ALIKE_KNOWN = range(4)
"""Of a camera's `State.noise`: variance of each ball apart [px^2], information on it [px^-4]; of all balls alike."""


def start_noise(cameras: int, sigma_px: float) -> Array:
    """Return `State.noise` (cameras, 4) of a rig just switched on: each ball errs apart, by a sigma [px]."""
    variance = sigma_px**2
    known = 1.0 / (2.0 * variance**2)  # by one exact pixel
    return np.tile([variance, PRIOR_PIXELS * known, 0.0, PRIOR_SHIFTS * known], (cameras, 1))


def doubted(noise: Array, camera: int, sigma_px: float) -> Array:
    """Return the noise (cameras, 4) of a rig of which one camera has lost its trust."""
    after = noise.copy()
    after[camera] = start_noise(1, sigma_px)[0]
    return after


@compiled("f8(f8, f8, f8, f8, f8)")
def _score(u: float, v: float, a: float, b: float, d: float) -> float:
    """Return the score (1) of D' u = (u, v) and D' S^-1 D = (a b; b d)."""
    distance2 = (d * u * u - 2.0 * b * u * v + a * v * v) / (a * d - b * b)
    weight = min(1.0, LIMIT / distance2) if distance2 > 0.0 else 1.0
    return (weight * (u * u + v * v) - a - d) / 2.0


@compiled("UniTuple(f8, 2)(i8[::1], i8, f8[::1], f8[:, ::1])")
def _apart(cameras: Indices, camera: int, u: Array, inverse: Array) -> tuple[float, float]:
    """Return score and information of the variance of a camera's balls apart; both 0 where it sees none."""
    score, information = 0.0, 0.0
    for s in range(len(cameras)):
        if cameras[s] != camera:
            continue
        i = 2 * s
        score += _score(u[i], u[i + 1], inverse[i, i], inverse[i, i + 1], inverse[i + 1, i + 1])
        for r in range(len(cameras)):
            if cameras[r] == camera:
                for k in range(2):
                    for m in range(2):
                        information += inverse[i + k, 2 * r + m] ** 2 / 2.0  # (2)
    return score, information


@compiled("UniTuple(f8, 2)(i8[::1], i8, f8[::1], f8[:, ::1])")
def _alike(cameras: Indices, camera: int, u: Array, inverse: Array) -> tuple[float, float]:
    """Return score and information of the variance of a camera's balls alike; both 0 where it sees fewer than two."""
    n, shift_u, shift_v, a, b, d = 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for s in range(len(cameras)):
        if cameras[s] != camera:
            continue
        n, shift_u, shift_v = n + 1, shift_u + u[2 * s], shift_v + u[2 * s + 1]
        for r in range(len(cameras)):
            if cameras[r] == camera:
                a += inverse[2 * s, 2 * r]
                b += inverse[2 * s, 2 * r + 1]
                d += inverse[2 * s + 1, 2 * r + 1]
    if n < 2:
        return 0.0, 0.0
    return _score(shift_u, shift_v, a, b, d), (a * a + 2.0 * b * b + d * d) / 2.0  # (2)


@compiled("f8[:, ::1](f8[:, ::1], i8[::1], f8[::1], f8[:, ::1])")
def learned(noise: Array, cameras: Indices, u: Array, inverse: Array) -> Array:
    """Return the noise (cameras, 4) after one round.

    Args:
        cameras: (n,) of each sighting.
        u, inverse: (2n,) and (2n, 2n), S^-1 y and S^-1 of the round's innovations.
    """
    after = noise.copy()
    for c in range(len(noise)):
        score, information = _apart(cameras, c, u, inverse)
        if information > 0.0:
            after[c, APART_KNOWN] = (1.0 - 1.0 / MEMORY) * noise[c, APART_KNOWN] + information
            after[c, APART] = max(LEAST_PX**2, noise[c, APART] + score / after[c, APART_KNOWN])
        score, information = _alike(cameras, c, u, inverse)
        if information > 0.0:
            after[c, ALIKE_KNOWN] = (1.0 - 1.0 / MEMORY) * noise[c, ALIKE_KNOWN] + information
            after[c, ALIKE] = max(0.0, noise[c, ALIKE] + score / after[c, ALIKE_KNOWN])
    return after

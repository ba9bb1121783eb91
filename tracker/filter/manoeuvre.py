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

from tracker.filter.matern import KINDS, MOTIONS, unit_noise
from tracker.maths.compiled import compiled
from tracker.maths.covariance import factor, forward
from tracker.state import Process
from tracker.types import Array

LEVELS = 9
AXES = 3  # of a motion
STEP = 3.0  # of sigma from one level to the next
SUDDEN_S = 0.1  # within it the briskest manoeuvre begins; one a third as brisk takes three times as long
CHANGE_S = 0.7  # a level is kept for about so long
RARER = 1.0 / 3.0  # a change is, for each level that it goes further


def _changes() -> Array:
    """Return the probability (LEVELS, LEVELS) that a change leads from a level to another."""
    level = np.arange(LEVELS)
    far = np.abs(level[:, None] - level)
    weights = np.where(far > 0, RARER**far, 0.0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


CHANGES = _changes()


def start_levels() -> Array:
    """Return the probabilities (MOTIONS, LEVELS) of a vehicle just found: nothing is known."""
    return np.full((MOTIONS, LEVELS), 1.0 / LEVELS)


@lru_cache(maxsize=16)
def strengths(process: Process) -> Array:
    """Return the levels' strengths (KINDS * MOTIONS, LEVELS), as `process_noise` takes them.

    Source: what changes by sigma within tau, as white noise, has density sigma^2 / tau.
    """
    shares = STEP ** np.arange(1.0 - LEVELS, 1.0)
    sigmas = np.outer((process.acceleration_m_s2, process.angular_acceleration_rad_s2), shares)
    return np.concatenate((sigmas**2, sigmas**2 * shares / SUDDEN_S))


@lru_cache(maxsize=16)
def envelope(process: Process) -> Array:
    """Return the strengths (KINDS * MOTIONS,) of the briskest level."""
    return strengths(process)[:, -1].copy()


@compiled("f8[:, ::1](f8[:, ::1], f8)")
def later(levels: Array, dt: float) -> Array:
    """Return the probabilities (MOTIONS, LEVELS) after dt without a sighting."""
    leave = 1.0 - math.exp(-dt / CHANGE_S)
    after = (1.0 - leave) * levels
    for motion in range(MOTIONS):
        for i in range(LEVELS):
            for j in range(LEVELS):
                after[motion, j] += leave * levels[motion, i] * CHANGES[i, j]
    return after


@compiled("f8[:, :, ::1](f8[:, ::1], f8[:, :, ::1], f8[:, ::1], f8[::1])")
def _tried(A: Array, B: Array, strengths: Array, means: Array) -> Array:
    """Return S (n, n, MOTIONS * levels), lower half, under every level of one motion, then of the other."""
    n, levels = len(A), strengths.shape[1]
    S, tried = np.empty((n, n, MOTIONS * levels)), np.empty((len(B), MOTIONS * levels))
    for k in range(len(B)):
        tried[k] = means[k]
        first = k % MOTIONS * levels
        tried[k, first : first + levels] = strengths[k]
    for i in range(n):
        for j in range(i + 1):
            S[i, j] = A[i, j]
            for k in range(len(B)):
                for t in range(MOTIONS * levels):
                    S[i, j, t] += tried[k, t] * B[k, i, j]
    return S


@compiled("f8[:, ::1](f8[::1], f8[:, ::1], f8[:, :, ::1], f8[:, ::1], f8[::1])")
def log_likelihoods(y: Array, A: Array, B: Array, strengths: Array, means: Array) -> Array:
    """Return the log likelihoods (MOTIONS, levels) of innovations y (n,) under S = A + sum s_k B_k, up to a constant.

    Args:
        B: (s, n, n) by each strength of 1, s = KINDS * MOTIONS.
        strengths: (s, levels) tried of one motion, while those of the other have their means (s,).
    """
    L = _tried(A, B, strengths, means)  # all go through Cholesky's factors side by side
    n, tries = len(y), L.shape[2]
    found, white = np.zeros(tries), np.empty((n, tries))
    for i in range(n):
        white[i] = y[i]
        for j in range(i + 1):
            for k in range(j):
                for t in range(tries):
                    L[i, j, t] -= L[i, k, t] * L[j, k, t]
            if j < i:
                for t in range(tries):
                    L[i, j, t] /= L[j, j, t]
                    white[i, t] -= L[i, j, t] * white[j, t]
        for t in range(tries):
            L[i, i, t] = math.sqrt(L[i, i, t])
            white[i, t] /= L[i, i, t]
            found[t] -= 0.5 * white[i, t] ** 2 + math.log(L[i, i, t])
    return found.reshape(MOTIONS, strengths.shape[1])


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1])")
def judged(levels: Array, log_likelihoods: Array) -> Array:
    """Return the probabilities (MOTIONS, LEVELS) after pixels of these log likelihoods under each level."""
    after = np.empty(levels.shape)
    for motion in range(MOTIONS):
        after[motion] = levels[motion] * np.exp(log_likelihoods[motion] - log_likelihoods[motion].max())
        after[motion] /= after[motion].sum()
    return after


@compiled("f8[::1](f8[:, ::1], f8[:, ::1])")
def expected(levels: Array, of: Array) -> Array:
    """Return the mean strengths (KINDS * MOTIONS,)."""
    means = np.empty(KINDS * MOTIONS)
    for k in range(KINDS * MOTIONS):
        means[k] = (levels[k % MOTIONS] * of[k]).sum()
    return means


@compiled("f8(f8[:, ::1], f8[:, ::1], i8)")
def _least_seen(S: Array, H: Array, motion: int) -> float:
    """Return the information of pixels on the place or the turn along the axis that they show least [1/m^2, 1/rad^2].

    S (n, n), H (n, size): the innovations' covariance and slope.
    Source: the harmonic mean of the eigenvalues of H' S^-1 H (3, 3), which is near the least where one is small.
    """
    first, M = AXES * motion, np.zeros((AXES, AXES))
    white = forward(factor(S), H[:, first : first + AXES].copy())
    for i in range(len(white)):
        for a in range(AXES):
            for b in range(AXES):
                M[a, b] += white[i, a] * white[i, b]
    pairs = cubes = 0.0  # the sum of the products of two eigenvalues, and the product of all
    for a in range(AXES):
        b, c = (a + 1) % AXES, (a + 2) % AXES
        pairs += M[b, b] * M[c, c] - M[b, c] * M[c, b]
        cubes += M[0, a] * (M[1, b] * M[2, c] - M[1, c] * M[2, b])
    return max(0.0, AXES * cubes / pairs) if pairs > 0.0 else 0.0


@compiled("f8[::1](f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, :, ::1], f8, f8)")
def as_gained(levels: Array, of: Array, H: Array, A: Array, B: Array, dt: float, T: float) -> Array:
    """Return the strengths (KINDS * MOTIONS,) with which one update gains what the levels' own gain in the mean.

    Args:
        levels, of: as for `expected`, after the pixels.
        H (n, size): slope of the innovations.  A, B: as for `log_likelihoods`, the other motion at its mean.
        dt, T: as for `unit_noise`.
    Source: of an innovation with variance a that a manoeuvre of strength s raises by b s, the update takes the share
        w(s) = b s / (a + b s) for the manoeuvre and leaves it the variance s (1 - w) = (a / b) w. Both are linear in
        w: mean and variance of the levels' mixture, but for how far their means lie apart, are those of the one
        strength whose w is the mean of w. The mean strength gains more, since w is concave, and leaves the state
        less sure than it is; where pixels show nothing, b = 0, it is the right one. So b / a is that of the axis that
        they show least.
    """
    means, unit = expected(levels, of), unit_noise(dt, T)
    found = means.copy()
    for motion in range(MOTIONS):
        S = A.copy()
        for k in range(len(B)):
            if k % MOTIONS != motion:
                S += means[k] * B[k]
        seen, raised, gained, left = _least_seen(S, H, motion), 0.0, 0.0, 0.0
        for level in range(levels.shape[1]):
            bs = 0.0
            for kind in range(KINDS):
                bs += of[kind * MOTIONS + motion, level] * unit[kind, 0, 0] * seen
            raised += levels[motion, level] * bs
            gained += levels[motion, level] * bs / (1.0 + bs)
            left += levels[motion, level] / (1.0 + bs)  # 1 - gained, which cancels where pixels show all
        if raised > 0.0:
            for kind in range(KINDS):
                found[kind * MOTIONS + motion] *= gained / left / raised
    return found

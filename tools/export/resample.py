"""Samples at their own times to samples on a fixed grid: no phase, no aliases, nothing invented.

    samples -> straight lines between neighbours, on a fine grid -> low-pass, zero phase -> every k-th value

The fine grid is a whole fraction of the output's period and eight times as fast as the samples. Where the output is
as fast as the samples there is nothing to alias, and the straight lines are read at the output's times. A turn is a
great circle between neighbours, and a renormalised mean of quaternions through the filter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, kaiserord, upfirdn

from tracker.types import Array

Times = NDArray[np.int64]
FILLED, SHORTENED, ABSENT = 1, 2, 4
STOPBAND_DB = 60.0
PASS_EDGE, STOP_EDGE = 0.6, 1.0  # of half the output rate
FINENESS = 8.0  # fine steps a sample: a straight line's own harmonics fold back 60 dB down
SAME_RATE = 0.02  # rates no farther apart than this are one: there is next to nothing to alias
LONG_PERIODS = 1.5  # a sample was missed where neighbours lie farther apart


@dataclass(frozen=True, slots=True)
class Layout:
    """What stands in which columns of a sample. The rest is numbers that change steadily.

    quaternion: the first of four, w x y z, None for no attitude.
    held: columns that hold their value until the next sample, such as a mode or a counter.
    """

    quaternion: int | None = None
    held: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Spacing:
    """How far apart things are [ns]. period: of the samples, usually.  gap_limit: nothing is put into longer gaps.

    step: of the output's grid.
    """

    period_ns: float
    gap_limit_ns: int
    step_ns: float

    @property
    def fine(self) -> int:
        """How many fine steps make one of the output; 1: no filter is needed."""
        return (
            1
            if self.step_ns <= self.period_ns * (1.0 + SAME_RATE)
            else math.ceil(FINENESS * self.step_ns / self.period_ns)
        )

    @property
    def reach_ns(self) -> int:
        """How far from an output's time samples count."""
        half = (len(_kernel(self.fine)) // 2) * self.step_ns / self.fine if self.fine > 1 else 0.0
        return math.ceil(half) + self.gap_limit_ns + 1


class Resampled(NamedTuple):
    """values (n, columns), NaN where there is nothing; flags (n,), a sum of FILLED, SHORTENED and ABSENT."""

    values: Array
    flags: NDArray[np.int8]


def resample(
    t_ns: Times, samples: Array, joined: NDArray[np.bool_], grid_ns: Times, layout: Layout, spacing: Spacing
) -> Resampled:
    """Return the samples' values at the grid's times.

    Args:
        t_ns: (m,) times of the samples, strictly increasing [ns].
        samples: (m, columns).
        joined: (m,) whether a sample goes on from the one before it; False where the estimate jumped.
        grid_ns: (n,) whole multiples of the step, one after another.
    Returns:
        FILLED: a sample is missing between the neighbours, the straight line is longer than usual.
        SHORTENED: so near an end or a gap that the filter was cut, to equal lengths on both sides: some aliases pass.
        ABSENT: outside the samples, or in a gap longer than the limit; every value is NaN.
    """
    fine = spacing.fine
    if len(t_ns) == 0 or len(grid_ns) == 0:
        return Resampled(np.full((len(grid_ns), samples.shape[1]), np.nan), np.full(len(grid_ns), ABSENT, np.int8))
    if fine == 1:
        return interpolated(t_ns, samples, joined, grid_ns, layout, spacing)
    kernel = _kernel(fine)
    half = len(kernel) // 2
    places = np.arange(-half, (len(grid_ns) - 1) * fine + half + 1)
    fine_ns = grid_ns[0] + np.rint(places * (spacing.step_ns / fine)).astype(np.int64)
    drawn = interpolated(t_ns, samples, joined, fine_ns, layout, spacing)
    middle = half + fine * np.arange(len(grid_ns))
    room = np.minimum(_room(drawn, _breaks(t_ns, joined, fine_ns))[middle], half)
    flags = drawn.flags[middle].copy()
    values = drawn.values[middle].copy()
    drawn_on = _continuous(drawn.values, layout)
    whole, short = room >= half, np.flatnonzero((room < half) & (flags < ABSENT))
    # Output m of the filter ends at place m * fine; its window is centred half before that.
    filtered = upfirdn(kernel, drawn_on, up=1, down=fine, axis=0)[2 * half // fine :][: len(grid_ns)]
    values[whole] = filtered[whole]
    for k in short:
        reach, centre = int(room[k]), int(middle[k])
        part = kernel[half - reach : half + reach + 1]
        values[k] = (part / part.sum()) @ drawn_on[centre - reach : centre + reach + 1]
    flags[short] |= SHORTENED
    for column in layout.held:
        values[:, column] = drawn.values[middle, column]
    return Resampled(_with_unit_quaternion(values, layout), flags)


@cache
def _kernel(fine: int) -> Array:
    """Return the low-pass: 60 dB down at half the output rate, symmetric, so without phase; its sum is one."""
    width = (STOP_EDGE - PASS_EDGE) / fine
    taps, beta = kaiserord(STOPBAND_DB, width)
    half = fine * math.ceil(taps / (2 * fine))  # whole output steps, so that outputs fall on the filter's centre
    kernel: Array = firwin(2 * half + 1, 0.5 * (STOP_EDGE + PASS_EDGE) / fine, window=("kaiser", beta))
    return kernel


def interpolated(
    t_ns: Times, samples: Array, joined: NDArray[np.bool_], at_ns: Times, layout: Layout, spacing: Spacing
) -> Resampled:
    """Draw straight lines between neighbours, and nothing anywhere else."""
    after = np.searchsorted(t_ns, at_ns, side="left")
    exact = (after < len(t_ns)) & (t_ns[np.minimum(after, len(t_ns) - 1)] == at_ns)
    before = np.where(exact, after, after - 1)
    inside = (before >= 0) & (after < len(t_ns))
    lo, hi = np.clip(before, 0, len(t_ns) - 1), np.clip(after, 0, len(t_ns) - 1)
    apart_ns = t_ns[hi] - t_ns[lo]
    present = inside & (apart_ns <= spacing.gap_limit_ns) & (exact | joined[hi])
    share = np.where(apart_ns > 0, (at_ns - t_ns[lo]) / np.maximum(apart_ns, 1), 0.0)[:, None]
    values = samples[lo] + share * (samples[hi] - samples[lo])
    if layout.quaternion is not None:
        four = slice(layout.quaternion, layout.quaternion + 4)
        values[:, four] = _slerp(samples[lo, four], samples[hi, four], share)
    for column in layout.held:
        values[:, column] = samples[lo, column]
    values[~present] = np.nan
    flags = np.where(present, 0, ABSENT).astype(np.int8)
    flags[present & (apart_ns > LONG_PERIODS * spacing.period_ns)] = FILLED
    return Resampled(values, flags)


def _slerp(q0: Array, q1: Array, share: Array) -> Array:
    """Turn from q0 to q1 (n, 4) the short way, at an even rate. Source: Shoemake 1985."""
    cosine = np.sum(q0 * q1, axis=1, keepdims=True)
    q1 = np.where(cosine < 0, -q1, q1)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    small = angle < 1e-6
    sine = np.where(small, 1.0, np.sin(angle))
    left = np.where(small, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    right = np.where(small, share, np.sin(share * angle) / sine)
    return np.asarray(left * q0 + right * q1)


def _breaks(t_ns: Times, joined: NDArray[np.bool_], at_ns: Times) -> NDArray[np.int64]:
    """Return for each time how many jumps lie before it: neighbours that differ have one between them."""
    jumps = t_ns[~joined]
    return np.searchsorted(jumps, at_ns, side="right")


def _room(drawn: Resampled, runs: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many steps each way from a place nothing is absent and nothing jumps."""
    absent = drawn.flags >= ABSENT
    jump = np.concatenate(([True], runs[1:] != runs[:-1]))
    place = np.arange(len(absent))
    # A wall before place i: i is absent, or a jump lies between i - 1 and i.
    last_wall = np.maximum.accumulate(np.where(absent, place + 1, np.where(jump, place, 0)))
    back = place - last_wall
    walls_after = np.concatenate((jump[1:], [True]))
    next_wall = np.minimum.accumulate(np.where(absent, place - 1, np.where(walls_after, place, len(place) - 1))[::-1])
    return np.minimum(back, next_wall[::-1] - place)


def _continuous(values: Array, layout: Layout) -> Array:
    """Return the values with each quaternion on the same half of the sphere as the one before it."""
    if layout.quaternion is None:
        return values
    out = values.copy()
    four = slice(layout.quaternion, layout.quaternion + 4)
    q = out[:, four]
    signs = np.sign(np.sum(q[1:] * q[:-1], axis=1))
    q[1:] *= np.cumprod(np.where(signs < 0, -1.0, 1.0))[:, None]
    return out


def _with_unit_quaternion(values: Array, layout: Layout) -> Array:
    if layout.quaternion is None:
        return values
    four = slice(layout.quaternion, layout.quaternion + 4)
    q = values[:, four]
    values[:, four] = q / np.linalg.norm(q, axis=1, keepdims=True)
    return values

"""What a ball's image leaves, and how that changes, where its centre is given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.image.newton import draw_at, fit_linear, residual, rows_of, slope_of
from tracker.image.patch import LUMA, PLANE, TRUST, channels_of, without_room
from tracker.maths.compiled import compiled
from tracker.types import Array


@compiled(
    "void(f8[:, ::1], Array(float32, 3, 'C', True), f8[::1], f8[::1], i8, f8, f8, f8[::1], f8[:, ::1], f8[:, ::1],"
    "f8[:, ::1])"
)
def _fit_at(
    pixels: Array, fine: NDArray[np.float32], made: Array, ball: Array, variance: int, u: float, v: float,
    weight: Array, drawn: Array, seen: Array, coefficients: Array,
) -> None:  # fmt: skip
    """Fill in drawn (by `draw_at`), seen (by `without_room`) and coefficients (channels, m) for a centre (u, v)."""
    m = coefficients.shape[1]
    draw_at(pixels, fine, made, ball, variance, u, v, drawn)
    without_room(pixels, drawn[m - PLANE], seen)
    fit_linear(seen, drawn[:m], weight, np.empty((m, len(weight))), np.empty((m, m)), coefficients)


@compiled("f8(f8[:, ::1], Array(float32, 3, 'C', True), f8[::1], f8[::1], i8, f8, f8, f8[:, ::1])")
def slopes_at(
    pixels: Array, fine: NDArray[np.float32], made: Array, ball: Array, variance: int, u: float, v: float, slopes: Array
) -> float:
    """Fill in the slopes (3, n) of the first channel, as fitted at a centre (u, v).

    They are by that centre's u and v [1/px] and by the blur's variance [1/px^2].
    Returns the slope by the blur's variance of half the sum of squares that the fit leaves in all channels [1/px^2]:
    positive when a sharper ball would fit better.
    """
    n, p, channels = pixels.shape[1], fine.shape[2], channels_of(pixels)
    m = p + PLANE
    drawn, seen, coefficients = np.empty((rows_of(p), n)), np.empty((channels, n)), np.empty((channels, m))
    weight, rest, others_bend = pixels[TRUST] ** 2, np.empty(n), np.empty(n)
    _fit_at(pixels, fine, made, ball, variance, u, v, weight, drawn, seen, coefficients)
    total = 0.0
    for channel in range(channels):
        c, bend = coefficients[channel], slopes[2] if channel == 0 else others_bend
        residual(drawn[:m], c, seen[channel], rest)
        slope_of(pixels, pixels[LUMA + channels + channel], drawn[m + 2 * p :], c, bend)
        for i in range(n):
            total -= weight[i] * rest[i] * bend[i]
    room = pixels[LUMA + channels]
    slope_of(pixels, room, drawn[m : m + p], coefficients[0], slopes[0])
    slope_of(pixels, room, drawn[m + p : m + 2 * p], coefficients[0], slopes[1])
    return total


@compiled("f8(f8[:, ::1], Array(float32, 3, 'C', True), f8[::1], f8[::1], i8, f8, f8)")
def squares_at(
    pixels: Array, fine: NDArray[np.float32], made: Array, ball: Array, variance: int, u: float, v: float
) -> float:
    """Return the sum of squares left in brightness or colour at a centre (u, v)."""
    n, p, channels = pixels.shape[1], fine.shape[2], channels_of(pixels)
    m = p + PLANE
    drawn, seen, coefficients = np.empty((rows_of(p), n)), np.empty((channels, n)), np.empty((channels, m))
    weight, rest = pixels[TRUST] ** 2, np.empty(n)
    _fit_at(pixels, fine, made, ball, variance, u, v, weight, drawn, seen, coefficients)
    total = 0.0
    for channel in range(channels):
        residual(drawn[:m], coefficients[channel], seen[channel], rest)
        for i in range(n):
            total += weight[i] * rest[i] * rest[i]
    return total

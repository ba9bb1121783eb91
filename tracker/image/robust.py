"""Which pixels of a ball's image show the ball and the room behind it, and which something else.

Every ball is held by a tube, and beside it is the airframe: always on the same side as the camera sees it. A fit of the
centre can bear that, but what is learned from many balls would take the tube for shade.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.image.full import FULL_WEIGHT, LEAST_WEIGHT
from tracker.image.newton import TUKEY, draw_at, fit_linear, residual, rows_of
from tracker.image.patch import PLANE, TRUST, channels_of, without_room
from tracker.maths.compiled import compiled
from tracker.types import Array

ROUNDS = 3
MEDIANS = 0.455, 1.386
"""Of a chi-square of one degree of freedom, and of two."""


@compiled("f8[:, ::1](f8[:, ::1], Array(float32, 3, 'C', True), f8[::1], f8[::1], i8, f8, f8)")
def without_strangers(
    pixels: Array, fine: NDArray[np.float32], made: Array, ball: Array, variance: int, u: float, v: float
) -> Array:
    """Return a copy of pixels (..., n) that trusts those less which fit no ball with its centre at (u, v).

    A full pixel is left out where the model is as bright or brighter, since it shows at least so much, and only there;
    its colour always.
    The spread of what the fit leaves is its own, however noisy the camera: half of the pixels lie within its median.
    Source: Tukey's biweight, Huber, Ronchetti, "Robust Statistics", 2009.
    """
    n, p, channels = pixels.shape[1], fine.shape[2], channels_of(pixels)
    m = p + PLANE
    drawn, weighted, weight = np.empty((rows_of(p), n)), np.empty((m, n)), pixels[TRUST] ** 2
    factor, coefficients, seen = np.empty((m, m)), np.empty((channels, m)), np.empty((channels, n))
    rest, squares, believed, plain = np.empty(n), np.empty(n), np.ones(n), pixels[TRUST] > 0.0
    weight *= np.where(plain, 1.0, FULL_WEIGHT**2)
    draw_at(pixels, fine, made, ball, variance, u, v, drawn)
    without_room(pixels, drawn[p], seen)
    for _ in range(ROUNDS):
        fit_linear(seen, drawn[:m], weight, weighted, factor, coefficients)
        squares[:] = 0.0
        for channel in range(channels):
            residual(drawn[:m], coefficients[channel], seen[channel], rest)
            for i in range(n):
                squares[i] += (pixels[TRUST, i] * rest[i]) ** 2
        spread = np.median(squares[plain]) / MEDIANS[channels - 1] if plain.any() else 1.0
        for i in range(n):
            believed[i] = max(LEAST_WEIGHT, 1.0 - squares[i] / (channels * TUKEY**2 * max(spread, LEAST_WEIGHT)))
            if not plain[i]:
                believed[i] = 1.0 if channels == 1 and rest[i] > 0.0 else LEAST_WEIGHT
            weight[i] = (believed[i] * pixels[TRUST, i]) ** 2
    trusted = pixels.copy()
    for i in range(n):
        trusted[TRUST, i] *= believed[i]
    return trusted

"""Whether an image shows a ball at all.

Noise holds spots of every colour, and the likeliest ball in it fits well: its misfit is that of noise, its centre as
sure as if the ball were real. What tells is how little of the image it explains. Beside a background without a ball,
one that nobody put there makes chi2 less by about its 12 terms, and by up to 40 where the likeliest of many places was
taken; a ball in an image of quality 30, or hidden by half, makes it less by some hundreds, a plain one by thousands.
"""

from __future__ import annotations

import numpy as np

from tracker.image.patch import LUMA, PLANE, TRUST, X, Y, channels_of
from tracker.maths.compiled import compiled
from tracker.maths.solve import dot, eliminate
from tracker.types import Array

LEAST_EVIDENCE = 60.0


@compiled("f8(f8[:, ::1], f8[::1], f8[::1], f8[:, ::1])")
def explained(pixels: Array, tukey: Array, squares: Array, work: Array) -> float:
    """Return by how much the squares left in brightness or colour (n,) are fewer than without a ball.

    work (PLANE + channels or more, n): overwritten.
    """
    channels, n = channels_of(pixels), pixels.shape[1]
    rows, products = work[: PLANE + channels], np.empty((PLANE + channels, PLANE + channels))
    kept = 0.0
    for i in range(n):
        weight = tukey[i] * pixels[TRUST, i]
        rows[0, i], rows[1, i], rows[2, i] = weight, weight * pixels[X, i], weight * pixels[Y, i]
        for channel in range(channels):
            bare = pixels[LUMA + channel, i] - pixels[LUMA + channels + channel, i]
            rows[PLANE + channel, i] = weight * bare
        kept += tukey[i] ** 2 * squares[i]
    for j in range(len(rows)):
        for k in range(j + 1):
            products[j, k] = dot(rows[j], rows[k])
    eliminate(products, PLANE)
    total = 0.0
    for j in range(PLANE, len(rows)):
        total += products[j, j]
    return total - kept

"""What a full pixel says: that there is at least so much light.

Where the model is brighter than the pixel could show, both agree; where it is darker they do not, and the fit hears of
it. So a full pixel counts, or does not, by what the model of the step before says. Counted as any other it would
draw a bright ball's centre towards its darker side, and left out wholly it would let the model be dark where the
picture is white.

Source: least squares with an active set of one-sided conditions; for data cut off at a limit, Tobin, "Estimation of
    relationships for limited dependent variables", Econometrica 26 (1958).
"""

from __future__ import annotations

from tracker.image.patch import TRUST
from tracker.maths.compiled import compiled
from tracker.types import Array

LEAST_WEIGHT = 1e-3  # of what is as good as left out, square root
FULL_WEIGHT = 0.1  # of a full pixel at first, and at least, where the model is darker: it is no stranger; square root


@compiled("void(f8[:, ::1], f8[::1], f8[::1])")
def weigh_full(pixels: Array, rest: Array, weights: Array) -> None:
    """Leave full pixels (..., n) out where the model is as bright or brighter, and no others.

    rest (n,): what the fit leaves, seen less model.  weights (n,): square roots, changed.
    """
    for i in range(len(rest)):
        if pixels[TRUST, i] < 0.0:
            weights[i] = LEAST_WEIGHT if rest[i] <= 0.0 else max(weights[i], FULL_WEIGHT)


@compiled("void(f8[:, ::1], f8[:, ::1])", inline=True)
def free_full(pixels: Array, rows: Array) -> None:
    """Let full pixels (..., n) say nothing of the centre where the model is as bright or brighter.

    rows (3, n): what the fit leaves, and its slopes, set to 0 there.
    """
    for i in range(pixels.shape[1]):
        if pixels[TRUST, i] < 0.0 and rows[0, i] <= 0.0:
            rows[0, i] = rows[1, i] = rows[2, i] = 0.0

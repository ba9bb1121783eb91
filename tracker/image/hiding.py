"""How much of a ball something hides, and how far off its centre may be for it.

A rod across a ball leaves a part of it that a whole ball fits well, a pixel or more elsewhere: what the rod covers is
left out as a stranger, and the limb that is left fits many places. Two cameras before which the same rod is err alike,
and no residual shows it. What does tell is how little of the ball there is. How bright the light is, or how strong its
colour, does not matter to that, nor where the ball is: on a share of its pixels is a share of its light. A ball in hard
or dim light, blurred or smeared, shows its colour strongly on few pixels, but so does the template that is fitted.

A rod stays for a while, so one look in which chance hides it is held against those just before; and what all balls of a
camera lack alike is the model's fault, not hidden.

Source: of n pixels that show s, the effective number is (sum s)^2 / sum s^2 (1), whatever the scale of s; Kish, "Survey
    sampling" (1965), of weights. If a share h of a ball is hidden, both sums, and so their number, lack about h of it.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.image.patch import PLANE, RING_PX, TRUST, X, Y
from tracker.image.reading import CHROMA_VAR, RADIUS, STREAK_U, STREAK_V
from tracker.image.template import STREAK_MAX_PX
from tracker.maths.compiled import compiled
from tracker.types import Array

MODEL = 0.04  # one sigma of an evenly lit ball's share: blur, light and what holds it are not quite as modelled
FULL = 0.15  # and of what is on pixels too bright for the camera, which show a wrong colour
AT_ONCE, IN_THE_END = 4.0, 1.5  # sigmas that one look, or the last ones, may lack by chance; one more is none
LATELY = 10.0  # looks that count together
SHORTER = 0.36  # share of a disc's rim that goes with all of its area, by the half that a straight edge hides
LEAST_WHOLE = 0.85  # of a share: all balls of a camera hidden are not taken for whole ones
MOST_HIDDEN = 0.95
NEWTON_STEPS = 3
LIT_SHAPES = 3  # of a ball in known light: coverage, that times the light, the lamp's mirror image
WHOLE = 1.0
SHARE, BY_CHANCE, UNSURE, SHOWN = range(4)
"""Of what a look shows of a ball: its share, and the variances of that by noise and by the model. The share is NaN
where there is no ball, or the light is not known yet: a ball may be lit from the side as well as hidden."""
COUNT, LATE = 3, 4
"""Of what the last looks showed, beside these: how many they were."""


@compiled("f8(f8)")
def depth_of(hidden: float) -> float:
    """Return how deep into a disc of radius 1 the straight edge reaches that hides such a share of it.

    Source: the share beyond a chord 1 - t from the middle is (acos(1 - t) - (1 - t) r) / pi with r = sqrt(t (2 - t));
        its slope by t is 2 r / pi. For small t it is 4 sqrt(2) / (3 pi) t^1.5, which is where Newton's steps start.
    """
    t: float = (0.75 * math.pi / math.sqrt(2.0) * hidden) ** (2.0 / 3.0)
    for _ in range(NEWTON_STEPS):
        root = math.sqrt(t * (2.0 - t))
        t -= (math.acos(1.0 - t) - (1.0 - t) * root - math.pi * hidden) / (2.0 * root)
    return t


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])", inline=True)
def _ball_alone(colour: Array, drawn: Array, work: Array, coefficients: Array) -> None:
    """Fill in the first row of work by how strongly each block shows the ball's colour, its background taken away.

    Arguments as for `measure_shown`. The colour is that of the blocks which the ball should cover.
    """
    m, by_blue, by_red = coefficients.shape[1], 0.0, 0.0
    for i in range(colour.shape[1]):
        blue, red = work[m + 1, i], work[m + 4, i]
        for k in range(m - PLANE):
            blue, red = blue + coefficients[0, k] * drawn[k, i], red + coefficients[1, k] * drawn[k, i]
        work[0, i], work[1, i] = blue, red
        by_blue, by_red = by_blue + blue * drawn[0, i], by_red + red * drawn[0, i]
    length = max(math.sqrt(by_blue * by_blue + by_red * by_red), 1e-9)
    for i in range(colour.shape[1]):
        work[0, i] = (by_blue * work[0, i] + by_red * work[1, i]) / length


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8, f8, f8[::1])")
def measure_shown(
    colour: Array, drawn: Array, work: Array, coefficients: Array, ball: Array, u: float, v: float, shown: Array
) -> None:
    """Fill in which share of a ball is there, shown (SHOWN,): 1 for a whole one, NaN where nothing tells.

    Args:
        colour (7, n): of a patch.  drawn (4p + 3, n): the ball there, by `newton.draw_at`.
        work (m + 7, n): what the fit leaves in blue and in red is in its rows m + 1 and m + 4; overwritten.
        coefficients (2, m): of the fit.  ball (BALL_SIZE,): what is known of it.
        u, v: where it was looked for, from the patch's middle [px].
    Source: (1) of what is seen over that of the template. With S1 = sum s and S2 = sum s^2, noise e of variance 1
        changes its logarithm by 2 sum (1 / S1 - s / S2) e, the background's level among it, and S2 is too large by n.
    """
    streak_px = min(math.sqrt(ball[STREAK_U] ** 2 + ball[STREAK_V] ** 2), STREAK_MAX_PX)
    lit, reach_px = int(coefficients.shape[1] - PLANE == LIT_SHAPES), ball[RADIUS] + streak_px / 2.0 + RING_PX
    _ball_alone(colour, drawn, work, coefficients)
    count = total = squares = whole = whole_squares = disc = disc_squares = full = 0.0
    for i in range(colour.shape[1]):
        if (colour[X, i] - u) ** 2 + (colour[Y, i] - v) ** 2 >= reach_px * reach_px:
            continue
        s, expected = work[0, i], drawn[lit, i]
        count, total, squares = count + 1.0, total + s, squares + s * s
        whole, whole_squares = whole + expected, whole_squares + expected * expected
        disc, disc_squares = disc + drawn[0, i], disc_squares + drawn[0, i] ** 2
        full += expected if colour[TRUST, i] < 0.0 else 0.0
    shown[SHARE] = np.nan
    if not (lit and total > 0.0 and squares > count and whole > 0.0):
        return
    shown[SHARE] = min(1.0, total * total / (squares - count) * whole_squares / (whole * whole))
    level = count / total - total / squares
    chance = 4.0 * max(0.0, count / (total * total) - 1.0 / squares + level * level / colour.shape[1])
    uneven = disc * disc / disc_squares * whole_squares / (whole * whole)
    shown[BY_CHANCE] = shown[SHARE] ** 2 * chance
    shown[UNSURE] = (MODEL * uneven) ** 2 + (FULL * full / whole) ** 2


@compiled("f8(f8[:, ::1])")
def whole_one(lately: Array) -> float:
    """Return the share that a whole ball shows to a camera: that of its least hidden ball, lately (balls, LATE).

    What light or blur not quite as modelled take from all balls alike hides none of them.
    """
    most = LEAST_WHOLE
    for b in range(len(lately)):
        most = max(most, lately[b, SHARE])
    return most


@compiled("f8(f8[::1], f8, f8, f8[::1])")
def hidden_variance(shown: Array, spared: float, whole: float, ball: Array) -> float:
    """Return the variance of a ball's centre along any axis for what is hidden of it [px^2].

    Args:
        shown (SHOWN or more,): of it.  spared: AT_ONCE or IN_THE_END.  whole: the share that a whole ball shows.
        ball (BALL_SIZE,): what is known of it.
    Source: an edge that reaches t radii deep leaves a part that fits whole discs from the true place, where its limb is
        theirs, to t radii further, where the edge is. A fit keeps to one of them as long as the edge stays, so the
        furthest counts: t^2 in a direction that may be any, which is t^2 / 2 along each axis.
        Blur of sigma adds sigma / sqrt(pi) times the length of its rim to a disc's (1), and to a part's: more for its
        area. So 1 less the share is h (1 + SHORTER rim) / (1 + rim), rim what blur adds to the whole disc.
    """
    if not shown[SHARE] < whole:
        return 0.0
    sigma = math.sqrt(shown[BY_CHANCE] + shown[UNSURE])
    lacking = 1.0 - shown[SHARE] / whole
    believed = min(1.0, lacking * whole / sigma - spared)
    if believed <= 0.0:
        return 0.0
    rim = 2.0 * math.sqrt(ball[CHROMA_VAR] / math.pi) / ball[RADIUS]
    hidden = min(MOST_HIDDEN, lacking * (1.0 + rim) / (1.0 + SHORTER * rim))
    shift_px: float = depth_of(hidden) * ball[RADIUS]
    variance: float = believed * shift_px * shift_px / 2.0
    return variance


def never_seen(balls: int) -> Array:
    """Return what the last looks showed of each ball (balls, LATE) before there were any."""
    return np.tile((1.0, 0.0, 1.0, 0.0), (balls, 1))


@compiled("void(Array(f8, 2, 'A', True), f8[:, ::1])")
def remember(shown: Array, lately: Array) -> None:
    """Add to what the last looks showed of each ball, lately (balls, LATE), what one did, shown (balls, SHOWN)."""
    for b in range(len(shown)):
        if np.isnan(shown[b, SHARE]):
            continue
        lately[b, COUNT] = min(LATELY, lately[b, COUNT] + 1.0)
        new = 1.0 / lately[b, COUNT]
        lately[b, SHARE] += new * (shown[b, SHARE] - lately[b, SHARE])
        lately[b, UNSURE] += new * (shown[b, UNSURE] - lately[b, UNSURE])
        lately[b, BY_CHANCE] += new * (new * shown[b, BY_CHANCE] - (2.0 - new) * lately[b, BY_CHANCE])

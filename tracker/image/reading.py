"""Reading a template off at the pixels of a patch, wherever the ball's centre is."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tracker.image.template import STREAK_MAX_PX
from tracker.maths.compiled import compiled
from tracker.types import Array

RADIUS, LUMA_VAR, CHROMA_VAR, STREAK_U, STREAK_V, LONGER_U, LONGER_UV, BALL_SIZE = range(8)
"""What compiled code knows of a ball: radius [px], variances of its blurs, see `template.variance_of` [px^2], how
far its image moves during the exposure [px], and how oval it is, see `outline.RADIUS`."""


@compiled("Tuple((i8, f8))(f8, f8)")
def _places_along(streak_u: float, streak_v: float) -> tuple[int, float]:
    """Return at how many places along a streak the ball is drawn, and what share of it they take up."""
    length = math.sqrt(streak_u * streak_u + streak_v * streak_v)
    shrink = min(1.0, STREAK_MAX_PX / length) if length > 0.0 else 0.0
    return math.ceil(2.0 * length * shrink) | 1, shrink


@compiled("i8(Array(float32, 3, 'C', True), i8, i8, f8, f8[::1], f8[:, ::1], f4[:, :, ::1])", inline=True)
def _gather(
    fine: NDArray[np.float32], u_steps: int, v_steps: int, per_px: float, ball: Array, pixels: Array,
    sums: NDArray[np.float32],
) -> int:  # fmt: skip
    """Fill in (5, p, n) each shape at each pixel and at its four neighbours on the grid, summed over a streak's places.

    They come in the order here, left, right, above, below. The rim, where all beyond is read, is empty.
    Returns how many places there are.
    """
    size, shapes = len(fine), fine.shape[2]
    middle, flat, last = size // 2, fine.reshape(size * size * shapes), size - 2
    along, below = np.uint64(shapes), np.uint64(size * shapes)  # unsigned, so that no index is looked at for its sign
    starts = np.empty(pixels.shape[1], np.uint64)
    sums[:] = np.float32(0.0)
    count, shrink = _places_along(ball[STREAK_U], ball[STREAK_V])
    for k in range(count):
        from_middle = ((k + 0.5) / count - 0.5) * shrink * per_px
        u_place = middle - u_steps - round(from_middle * ball[STREAK_U])
        v_place = middle - v_steps - round(from_middle * ball[STREAK_V])
        for i in range(len(starts)):
            column, row = u_place + int(pixels[0, i] * per_px), v_place + int(pixels[1, i] * per_px)
            c, r = min(max(column, 1), last), min(max(row, 1), last)
            starts[i] = np.uint64((r * size + c) * shapes)
        for p in range(shapes):  # one after the other, so that many reads are under way at once
            here, left, right, above, under = sums[0, p], sums[1, p], sums[2, p], sums[3, p], sums[4, p]
            for i in range(len(starts)):
                at = starts[i] + np.uint64(p)
                here[i] += flat[at]
                left[i] += flat[at - along]
                right[i] += flat[at + along]
                above[i] += flat[at - below]
                under[i] += flat[at + below]
    return count


@compiled(
    "void(Array(float32, 3, 'C', True), f8[::1], f8[::1], i8, f8, f8, f8[:, ::1],"
    "f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])",
    inline=True,
)
def read(
    fine: NDArray[np.float32], made: Array, ball: Array, variance: int, u: float, v: float, pixels: Array,
    value: Array, by_u: Array, by_v: Array, bend: Array,
) -> None:  # fmt: skip
    """Read a template off for a centre at (u, v) from a patch's middle, smeared along a streak.

    Args:
        fine, made: of the template.
        ball (BALL_SIZE,): the ball, which the one drawn is near to.  variance: LUMA_VAR or CHROMA_VAR.
        pixels (..., n): the patch, x and y in its first rows.
        value, by_u, by_v (p, n): the shapes, and their slopes by the centre's u and v [1/px], to be filled in.
        bend (p, n): half the Laplacian, which is their slope by the blur's variance [1/px^2], to be filled in.
    What the ball is off from the one drawn, and its centre from the grid, is put right to the second order. A ball
    larger by a share s / (1 - s) is the drawn one blown up: I(x) = J(x - d) with d = s x, and in one direction
    J(x - d) = J - d J' + d^2 J'' / 2, where r^2 J'' = r^2 lap J - r J' for a round picture. Blown up, its blur is too;
    what it then lacks of the variance acts by the heat equation, dI / d variance = lap I / 2. An oval ball is a round
    one pulled by exp(e), e without trace: d = s x + (1 - s) (e x - e^2 x / 2). The square of what of d leads outwards
    acts by J'' / 2, of what leads across by J' / 2r. What is of the second order and differs by direction, which shows
    at the limb alone, is that of the limb.
    """
    per_px, share = made[0], (ball[RADIUS] - made[1]) / ball[RADIUS]
    lacking = ball[variance] - made[2] * (ball[RADIUS] / made[1]) ** 2
    u_steps, v_steps = round(u * per_px), round(v * per_px)
    off_u, off_v = u - u_steps / per_px, v - v_steps / per_px
    lacking += 0.5 * (off_u * off_u + off_v * off_v)  # of a step's second order what has no direction
    n = pixels.shape[1]
    sums = np.empty((5, len(value), n), np.float32)
    mean = 1.0 / _gather(fine, u_steps, v_steps, per_px, ball, pixels, sums)
    slope, curve = 0.5 * mean * per_px, 0.5 * mean * per_px * per_px
    longer, aslant = (1.0 - share) * ball[LONGER_U], (1.0 - share) * ball[LONGER_UV]
    oval = longer * longer + aslant * aslant
    blown = share - 0.5 * (1.0 - share) * (ball[LONGER_U] ** 2 + ball[LONGER_UV] ** 2)
    first, second, limb = blown + 0.5 * (blown * blown - oval), blown * blown, 1.0 / (ball[RADIUS] * ball[RADIUS])
    for p in range(len(value)):
        for i in range(n):
            x, y = pixels[0, i] - u, pixels[1, i] - v
            du, dv = slope * (sums[1, p, i] - sums[2, p, i]), slope * (sums[3, p, i] - sums[4, p, i])
            around = sums[1, p, i] + sums[2, p, i] + sums[3, p, i] + sums[4, p, i]
            half = curve * (around - np.float32(4.0) * sums[0, p, i])
            by_u[p, i], by_v[p, i], bend[p, i] = du, dv, half
            pulled = longer * (x * x - y * y) + 2.0 * aslant * x * y
            outwards = limb * pulled
            by_size = first + outwards * (blown + outwards)
            moved_u, moved_v = (by_size + longer) * x + aslant * y, (by_size - longer) * y + aslant * x
            moved = (moved_u + off_u) * du + (moved_v + off_v) * dv
            bent = second * (x * x + y * y) + pulled * (2.0 * blown + outwards) + lacking
            value[p, i] = mean * sums[0, p, i] + moved + bent * half

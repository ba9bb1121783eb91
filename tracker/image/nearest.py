"""The coloured spot nearest to where a ball is expected; the room behind, where it has the ball's colour, is taken off.

An orange ball before wood is one spot with it. But the cameras stand still, and wood that looks as it did before the
ball came is no ball. What is left may have the vehicle's tubes on it, which before wood have its colour too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tracker.image.spots import find_spots
from tracker.image.view import RADIUS, S_UU, S_UV, S_VV, U, V
from tracker.maths.compiled import compiled
from tracker.types import Array, Image

LEAST_AREA_SHARE, MOST_AREA_SHARE = 0.15, 4.0  # of the ball's expected disc
BESIDE_PX = 1.0  # beyond a ball's radius that it is looked for round a spot's middle
STEPS, STILL_PX = 5, 0.3  # of the way to a ball's middle: the most of them, and one too short to go on
FULL = 0.85  # of a square that a ball, which reaches its sides, does not fill
KEPT = 0.75  # of a spot that the room is taken off: it stands beside the room, not before it

Table = tuple[NDArray[np.int16], NDArray[np.int16], NDArray[np.bool_], int, int]
"""A colour's, as in `tracker.image.colour_table.ColourTable`."""


@compiled("i8(f8[:, ::1], f8[::1])")
def _nearest(spots: Array, view: Array) -> int:
    """Return which of some spots is nearest the prediction, in sigma; -1 when none is large enough."""
    nearest, least = -1, np.inf
    for k in range(len(spots)):
        du, dv = spots[k, 1] - view[U], spots[k, 2] - view[V]
        distance2 = view[S_VV] * du * du - 2.0 * view[S_UV] * du * dv + view[S_UU] * dv * dv
        if spots[k, 3] >= LEAST_AREA_SHARE * math.pi * view[RADIUS] ** 2 and distance2 < least:
            nearest, least = k, distance2
    return nearest


@compiled("b1(f8[::1], f8[::1], f8)", inline=True)
def _is_one(whole: Array, spot: Array, radius_px: float) -> bool:
    """Say whether a spot with the room is the one without it."""
    return math.hypot(whole[1] - spot[1], whole[2] - spot[2]) <= radius_px


@compiled("b1(f8[::1], f8[::1], f8)", inline=True)
def _is_better(whole: Array, spot: Array, area: float) -> bool:
    """Say whether a spot with the room is nearer a ball's size than without it."""
    return abs(math.log(whole[3] / area)) <= abs(math.log(spot[3] / area))


_TABLE = "Tuple((Array(i2, 2, 'C', True), Array(i2, 1, 'C', True), Array(b1, 2, 'C', True), i8, i8))"
_SEEN = f"Array(u1, 3, 'C', True), Array(f4, 3, 'C'), Array(u1, 2, 'C'), {_TABLE}"


@compiled(f"UniTuple(f8, 2)({_SEEN}, f8, f8, f8)")
def _densest(
    image: Image, room: NDArray[np.float32], looks: NDArray[np.uint8], table: Table, u: float, v: float,
    radius_px: float,
) -> tuple[float, float]:  # fmt: skip
    """Go on from a spot's middle to where most of it is as wide as a ball: a tube that is part of it is thin.

    Returns NaN when there is nothing of it, or something larger.
    Source: mean shift with a square window (Fukunaga, Hostetler, 1975).
    """
    half, middle_u, middle_v = radius_px + BESIDE_PX, np.nan, np.nan
    for _ in range(STEPS):
        left, top = max(0, math.ceil(u - half)), max(0, math.ceil(v - half))
        right, bottom = min(image.shape[1], math.floor(u + half) + 1), min(image.shape[0], math.floor(v + half) + 1)
        if not (left < right and top < bottom):
            break
        spots, _ = find_spots(image, room, looks, left, top, right, bottom, *table, np.inf)
        if len(spots) == 0 or spots[0, 3] > FULL * (right - left) * (bottom - top):
            return np.nan, np.nan
        middle_u, middle_v = spots[0, 1], spots[0, 2]
        if math.hypot(middle_u - u, middle_v - v) < STILL_PX:
            break
        u, v = middle_u, middle_v
    return middle_u, middle_v


@compiled(f"UniTuple(f8, 2)({_SEEN}, UniTuple(i8, 4), f8[::1])")
def nearest_spot(
    image: Image, room: NDArray[np.float32], looks: NDArray[np.uint8], table: Table,
    region: tuple[int, int, int, int], view: Array,
) -> tuple[float, float]:  # fmt: skip
    """Return the middle of the spot nearest the prediction; NaN when there is none.

    Where the room has the ball's colour, what looks as it does is left out. Too little may be left of a ball that is
    like the room or was learned as room; so its spot is looked at with the room, too, and counts so if it is nearer a
    ball's size. A spot that loses hardly anything, as by one pixel beside it, is the ball as it is, whatever its size.

    Args:
        image: (height, width, 3) BGR.  room, looks: what is known to stand behind, see `behind.Room`.
        table: of the ball's colour.
        region: left, top, right, bottom of where to look.
        view: a row of `view.expected_views`.
    """
    left, top, right, bottom = region
    area = math.pi * view[RADIUS] ** 2
    spots, left_out = find_spots(image, room, looks, left, top, right, bottom, *table, MOST_AREA_SHARE * area)
    at = _nearest(spots, view)
    if left_out == 0:
        return (spots[at, 1], spots[at, 2]) if at >= 0 else (np.nan, np.nan)
    whole, _ = find_spots(image, room[:0], looks[:0], left, top, right, bottom, *table, MOST_AREA_SHARE * area)
    other = _nearest(whole, view)
    if other >= 0 and at < 0:
        return whole[other, 1], whole[other, 2]
    if other >= 0 and _is_one(whole[other], spots[at], view[RADIUS]):
        if _is_better(whole[other], spots[at], area):
            return whole[other, 1], whole[other, 2]
        if spots[at, 3] >= KEPT * whole[other, 3]:
            return spots[at, 1], spots[at, 2]
    u, v = (spots[at, 1], spots[at, 2]) if at >= 0 else (view[U], view[V])  # with a tube it may have no ball's shape
    return _densest(image, room, looks, table, u, v, view[RADIUS])

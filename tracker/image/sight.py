"""One ball in one image: find its colour near where it is expected, and fit its centre. The tracker's inner loop."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tracker.image.behind import Room
from tracker.image.centre import MAX_SHIFT_PX, SHIFT_SHARE
from tracker.image.colour_table import ColourTable
from tracker.image.evidence import LEAST_EVIDENCE
from tracker.image.hiding import AT_ONCE, IN_THE_END, hidden_variance, whole_one
from tracker.image.holder import distrust
from tracker.image.nearest import nearest_spot
from tracker.image.newton import EVIDENCE, FIT_SIZE, SHARES, gauss_newton
from tracker.image.patch import Response, cut_pixels, light_of, trust_of
from tracker.image.reading import BALL_SIZE, CHROMA_VAR, LUMA_VAR, STREAK_U, STREAK_V
from tracker.image.reading import LONGER_U as BALL_LONGER_U
from tracker.image.reading import LONGER_UV as BALL_LONGER_UV
from tracker.image.reading import RADIUS as BALL_RADIUS
from tracker.image.spots import WIDE_PX
from tracker.image.template import MARGIN_PX, STREAK_MAX_PX, Template, variance_of
from tracker.image.view import LONGER_U, LONGER_UV, RADIUS, S_UU, S_VV, SHIFT_U, SHIFT_V, SPEED_U, SPEED_V, U, V
from tracker.maths.compiled import compiled
from tracker.types import Array, Image, Reason

REGION_SIGMA = 3.5
REGION_MARGIN_PX = 3.0
LINE_BYTES = 64  # what memory sends at a time
UV, COV, MISFIT, SPOT, SHOWN, CENTRE, SIZE = slice(0, 2), slice(2, 6), 6, slice(7, 9), slice(9, 12), slice(12, 14), 14
"""What a fit gives: the middle of its image [px], its covariance (uu, uv, vu, vv) [px^2], chi2 per degree of freedom,
the coloured spot's middle [px], how much of it is there, see `hiding.SHOWN`, and where its centre is projected [px]."""
_MISFIT, _SPOT_U, _SPOT_V, _SHOWN, _CENTRE_U, _CENTRE_V = 6, 7, 8, 9, 12, 13
_FOUND, _NO_COLOUR, _OUT_OF_VIEW, _CUT_OFF, _RAN_AWAY, _NOTHING_THERE = range(6)
_REASONS = {
    _NO_COLOUR: Reason.NO_BALL, _OUT_OF_VIEW: Reason.AT_BORDER, _CUT_OFF: Reason.AT_BORDER, _RAN_AWAY: Reason.NO_BALL,
    _NOTHING_THERE: Reason.NO_BALL,
}  # fmt: skip

Known = tuple[Array, int, Array, Array]
"""Of a camera: variances of its blurs [px^2] and exposure [s], side of its blocks, light and trust of grey levels."""


def known_of(response: Response) -> Known:
    """Return how a camera answers to light, as compiled code takes it."""
    block = response.block_px
    variances = variance_of(response.luma_px, 1), variance_of(response.chroma_px, block)
    return np.array((*variances, response.exposure_s)), block, light_of(response.gamma), trust_of(response.gamma)


def find_ball(
    image: Image,
    room: Room,
    ball: int,
    colour: ColourTable,
    views: Array,
    known: Known,
    drawn: tuple[Template, Template],
    held: Array,
    lately: Array,
    fits: Array,
) -> Reason | None:
    """Find a ball near a prediction and fit its centre.

    Args:
        image: (height, width, 3) BGR.  room: what is known to stand behind.
        ball: its row in `views` and `fits`.
        colour: of this ball alone.
        views: of `view.expected_views`, its row finite.
        known: of the camera.
        drawn: the templates of its brightness and of its colour.
        held (balls, any, 3): see `Expected.held`.
        lately (balls, LATE): what the last looks showed of each, see `hiding.COUNT`.
        fits (balls, SIZE): its row is filled in.
    Returns:
        None; NO_BALL when nothing of its colour and size is there but noise, or the fit runs away; AT_BORDER when it is
        cut off.
    """
    luma, chroma = drawn
    status = _find_and_fit(
        image, room.mean, room.looks, ball, *colour, views, *known, *luma, *chroma, held, lately, fits
    )
    return None if status == _FOUND else _REASONS[status]


@compiled("f8[::1](f8[::1], f8[::1])")
def _ball_of(view: Array, answers: Array) -> Array:
    """Return what is known of a ball, see `reading.BALL_SIZE`."""
    ball = np.empty(BALL_SIZE)
    ball[BALL_RADIUS], ball[LUMA_VAR], ball[CHROMA_VAR] = view[RADIUS], answers[0], answers[1]
    ball[STREAK_U], ball[STREAK_V] = view[SPEED_U] * answers[2], view[SPEED_V] * answers[2]
    ball[BALL_LONGER_U], ball[BALL_LONGER_UV] = view[LONGER_U], view[LONGER_UV]
    return ball


@compiled("UniTuple(i8, 4)(f8[::1], i8, i8)")
def _region(view: Array, width: int, height: int) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom, exclusive, of where a ball's spot is looked for in an image."""
    u, v, radius_px = view[U], view[V], view[RADIUS]
    half_u = REGION_SIGMA * np.sqrt(view[S_UU]) + radius_px + REGION_MARGIN_PX
    half_v = REGION_SIGMA * np.sqrt(view[S_VV]) + radius_px + REGION_MARGIN_PX
    left, top = max(0, math.floor(u - half_u)), max(0, math.floor(v - half_v))
    return left, top, min(width, math.ceil(u + half_u) + 1), min(height, math.ceil(v + half_v) + 1)


@compiled("i8(Array(u1, 3, 'C', True), Array(f4, 3, 'C'), f8[:, ::1])")
def read_ahead(image: Image, room: NDArray[np.float32], views: Array) -> int:
    """Read something of each line of memory that the search for some balls will need.

    A frame just taken is in no cache. Here no read waits for another, so memory works on many at once; later each would
    be waited for. A wide region is left to the search, which goes through it row by row.

    Args:
        image: (height, width, 3) BGR.  room: what is known to stand behind, empty for nothing.
        views: of `view.expected_views`.
    Returns:
        A sum of what was read; without it the compiler would leave the reading out.
    """
    height, width, total = image.shape[0], image.shape[1], 0
    pixels, behind = image.reshape(image.size), room.reshape(room.size).view(np.int32)
    for b in range(len(views)):
        if not np.isfinite(views[b, U] + views[b, V] + views[b, RADIUS]):
            continue
        left, top, right, bottom = _region(views[b], width, height)
        for row in range(top, bottom if 0 < right - left < WIDE_PX else top):
            first, last = 3 * (row * width + left), 3 * (row * width + right)
            for i in range(first, last, LINE_BYTES):
                total += pixels[i]
            total += pixels[last - 1]
            for i in range(first, min(last, len(behind)), LINE_BYTES // 4):
                total += behind[i]
    return total


@compiled(
    "i8(Array(u1, 3, 'C', True), Array(f4, 3, 'C'), Array(u1, 2, 'C'), i8,"
    "Array(i2, 2, 'C', True), Array(i2, 1, 'C', True), Array(b1, 2, 'C', True), i8, i8,"
    "f8[:, ::1], f8[::1], i8, f8[::1], f8[::1], Array(f4, 3, 'C', True), f8[::1], Array(f4, 3, 'C', True), f8[::1],"
    "f8[:, :, ::1], f8[:, ::1], f8[:, ::1])"
)
def _find_and_fit(
    image: Image, room: NDArray[np.float32], looks: NDArray[np.uint8], ball_index: int,
    least_spread: NDArray[np.int16], lowest_spread: NDArray[np.int16], hues: NDArray[np.bool_],
    blue: int, red: int, views: Array, answers: Array, block: int, light: Array, trust: Array,
    luma: NDArray[np.float32], luma_made: Array, chroma: NDArray[np.float32], chroma_made: Array, held: Array,
    lately: Array, fits: Array,
) -> int:  # fmt: skip
    """Find the spot nearest the prediction, cut its pixels out and fit them; fill in a row of fits, say how it went."""
    height, width, view, fit = image.shape[0], image.shape[1], views[ball_index], fits[ball_index]
    fit[_SHOWN] = np.nan
    region = left, top, right, bottom = _region(view, width, height)
    if not (left < right and top < bottom):
        return _OUT_OF_VIEW
    spot_u, spot_v = nearest_spot(image, room, looks, (least_spread, lowest_spread, hues, blue, red), region, view)
    if np.isnan(spot_u):
        return _NO_COLOUR
    ball, found = _ball_of(view, answers), np.empty(FIT_SIZE)
    streak_px = math.sqrt(ball[STREAK_U] ** 2 + ball[STREAK_V] ** 2)
    edge_px = ball[BALL_RADIUS] + min(streak_px, STREAK_MAX_PX) / 2.0  # as `patch.edge_of`
    half, middle_u, middle_v = math.ceil(edge_px + MARGIN_PX), round(spot_u), round(spot_v)
    if not (half <= middle_u < width - half and half <= middle_v < height - half):
        return _CUT_OFF
    du, dv = spot_u - middle_u, spot_v - middle_v
    bright, colour = cut_pixels(image, room, looks, middle_u, middle_v, half, block, du, dv, edge_px, light, trust)
    for pixels in (bright, colour):
        distrust(pixels, held[ball_index], ball[BALL_RADIUS], ball[STREAK_U], ball[STREAK_V], du, dv)
    gauss_newton(bright, colour, luma, luma_made, chroma, chroma_made, ball, du, dv, found)
    if not (found[0] - du) ** 2 + (found[1] - dv) ** 2 <= max(MAX_SHIFT_PX, SHIFT_SHARE * ball[BALL_RADIUS]) ** 2:
        return _RAN_AWAY
    if found[EVIDENCE] < LEAST_EVIDENCE:
        return _NOTHING_THERE
    fit[0], fit[1] = found[0] + middle_u, found[1] + middle_v
    whole = whole_one(lately)
    at_once = hidden_variance(found[SHARES:], AT_ONCE, whole, ball)
    hidden = max(at_once, hidden_variance(lately[ball_index], IN_THE_END, whole, ball))
    fit[2], fit[3], fit[4], fit[5] = found[2] + hidden, found[3], found[3], found[4] + hidden
    fit[_SHOWN:_CENTRE_U] = found[SHARES:]
    fit[_CENTRE_U], fit[_CENTRE_V] = fit[0] - view[SHIFT_U], fit[1] - view[SHIFT_V]
    fit[_MISFIT], fit[_SPOT_U], fit[_SPOT_V] = found[5], spot_u, spot_v
    return _FOUND

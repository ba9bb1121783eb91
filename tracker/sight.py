"""One ball in one image: find its colour near where it is expected, and fit its centre. The tracker's inner loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.centre import MAX_SHIFT_PX, Centre, gauss_newton
from tracker.colour_table import ColourTable
from tracker.compiled import compiled
from tracker.patch import Expected, Response, cut_pixels, edge_of, light_of, trust_of
from tracker.spots import find_spots
from tracker.template import MARGIN_PX, Shades, places_along, template_for
from tracker.types import Array, Image, Reason
from tracker.view import RAY_X

REGION_SIGMA = 3.5
REGION_MARGIN_PX = 3.0
LEAST_AREA_SHARE, MOST_AREA_SHARE = 0.15, 4.0  # of the ball's expected disc
_UV, _COV, _MISFIT, _SPOT, _STRAIN = 0, 1, 3, 4, 5  # rows of what a fit gives
_FOUND, _NO_COLOUR, _OUT_OF_VIEW, _CUT_OFF, _RAN_AWAY = range(5)
_REASONS = {
    _NO_COLOUR: Reason.NO_BALL, _OUT_OF_VIEW: Reason.AT_BORDER, _CUT_OFF: Reason.AT_BORDER, _RAN_AWAY: Reason.NO_BALL,
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """A ball found: what was expected of it, from its coloured spot's middle, and what its fit gave."""

    expected: Expected
    centre: Centre


def find_ball(
    image: Image, colour: ColourTable, view: Sequence[float], shades: Shades, response: Response
) -> Sight | Reason:
    """Find a ball near a prediction and fit its centre.

    Args:
        image: (height, width, 3) BGR.
        colour: of this ball alone.
        view: a row of `view.expected_views`, finite.
        shades, response: see `patch.Expected`.
    Returns:
        Sight; NO_BALL when nothing of its colour and size is there or the fit runs away, AT_BORDER when it is cut off.
    """
    u, v, S_uu, S_uv, S_vv, radius_px, speed_u, speed_v = view[:RAY_X]
    streak_px = speed_u * response.exposure_s, speed_v * response.exposure_s
    edge_px = edge_of(radius_px, streak_px)
    half = math.ceil(edge_px + MARGIN_PX)
    luma = template_for(radius_px, response.luma_px, shades)
    chroma = template_for(radius_px, response.chroma_px, shades, response.block_px)
    fit = np.empty((6, 2))
    status = _find_and_fit(
        image, colour.least_spread, colour.lowest_spread, colour.hues, u, v, S_uu, S_uv, S_vv, radius_px, edge_px, half,
        response.block_px, light_of(response.gamma), trust_of(response.gamma), luma.fine, chroma.fine, luma.per_px,
        luma.radius_px, places_along(streak_px, luma.per_px), fit,
    )  # fmt: skip
    if status != _FOUND:
        return _REASONS[status]
    fit.flags.writeable = False
    spot = float(fit[_SPOT, 0]), float(fit[_SPOT, 1])
    expected = Expected(spot, radius_px, (speed_u, speed_v), shades, response)
    misfit, strain_in, strain_out = float(fit[_MISFIT, 0]), float(fit[_STRAIN, 0]), float(fit[_STRAIN, 1])
    return Sight(expected, Centre(fit[_UV], fit[_COV : _COV + 2], misfit, strain_in, strain_out))


@compiled(
    "i8(Array(u1, 3, 'C', True), Array(i2, 2, 'C', True), Array(i2, 1, 'C', True), Array(b1, 2, 'C', True), f8, f8,"
    "f8, f8, f8, f8, f8, i8, i8, f8[::1], f8[::1], Array(f4, 3, 'C', True), Array(f4, 3, 'C', True), i8, f8,"
    "i8[:, ::1], f8[:, ::1])"
)
def _find_and_fit(
    image: Image, least_spread: NDArray[np.int16], lowest_spread: NDArray[np.int16], hues: NDArray[np.bool_],
    u: float, v: float, S_uu: float, S_uv: float, S_vv: float, radius_px: float, edge_px: float, half: int,
    block: int, light: Array, trust: Array, luma: NDArray[np.float32], chroma: NDArray[np.float32], per_px: int,
    drawn_px: float, places: NDArray[np.int64], fit: Array,
) -> int:  # fmt: skip
    """Find the spot nearest the prediction, cut its pixels out and fit them.

    Fills in fit (6, 2): centre, its covariance (2, 2), misfit (with nothing beside it), the spot's middle, the strains;
    returns how it went.
    """
    height, width = image.shape[0], image.shape[1]
    half_u = REGION_SIGMA * np.sqrt(S_uu) + radius_px + REGION_MARGIN_PX
    half_v = REGION_SIGMA * np.sqrt(S_vv) + radius_px + REGION_MARGIN_PX
    left, top = max(0, math.floor(u - half_u)), max(0, math.floor(v - half_v))
    right, bottom = min(width, math.ceil(u + half_u) + 1), min(height, math.ceil(v + half_v) + 1)
    if not (left < right and top < bottom):
        return _OUT_OF_VIEW
    area = math.pi * radius_px**2
    spots = find_spots(image, left, top, right, bottom, least_spread, lowest_spread, hues, MOST_AREA_SHARE * area)
    nearest, least = -1, np.inf
    for k in range(len(spots)):
        du, dv = spots[k, 1] - u, spots[k, 2] - v
        distance2 = S_vv * du * du - 2.0 * S_uv * du * dv + S_uu * dv * dv
        if spots[k, 3] >= LEAST_AREA_SHARE * area and distance2 < least:
            nearest, least = k, distance2
    if nearest < 0:
        return _NO_COLOUR
    spot_u, spot_v = spots[nearest, 1], spots[nearest, 2]
    middle_u, middle_v = round(spot_u), round(spot_v)
    if not (half <= middle_u < width - half and half <= middle_v < height - half):
        return _CUT_OFF
    du, dv, found = spot_u - middle_u, spot_v - middle_v, np.empty(8)
    bright, colour = cut_pixels(image, middle_u, middle_v, half, block, du, dv, edge_px, light, trust)
    gauss_newton(bright, colour, luma, chroma, per_px, drawn_px, radius_px, places, du, dv, found)
    if not (found[0] - du) ** 2 + (found[1] - dv) ** 2 <= MAX_SHIFT_PX**2:
        return _RAN_AWAY
    fit[_UV, 0], fit[_UV, 1] = found[0] + middle_u, found[1] + middle_v
    fit[_COV, 0], fit[_COV, 1], fit[_COV + 1, 0], fit[_COV + 1, 1] = found[2], found[3], found[3], found[4]
    fit[_MISFIT, 0], fit[_MISFIT, 1] = found[5], 0.0
    fit[_SPOT, 0], fit[_SPOT, 1] = spot_u, spot_v
    fit[_STRAIN, 0], fit[_STRAIN, 1] = found[6], found[7]
    return _FOUND

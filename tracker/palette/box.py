"""The box in HSV that holds a ball's pixels and little else."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.palette.chroma import chroma, hsv_of, hue_from
from tracker.rig import Colour
from tracker.types import Array, Image

CORE = (2.0, 98.0)  # percentiles of a ball's hues
LIMB = 3.0  # percentile of its saturations and values: below are stray pixels
MARGIN_MAX_DEG = 16.0  # about what a cast of 20 % turns a hue by
MARGIN_SHARES = (1.0, 0.6, 0.3)
MARGIN_MIN_DEG = 3.0
SATURATION_SHARES = (0.5, 0.65, 0.8)  # of the limb's; half the light halves the value and leaves the saturation
SATURATION_CUTS = (10.0, 25.0)  # percentiles that a box may cut off where the room has the hue: pale pixels of the edge
VALUE_SHARES = (0.4, 0.55, 0.75)
SATURATION_FLOOR, VALUE_FLOOR = 0.15, 0.06  # below these a hue is noise
GUARD = (4.0, 0.03, 0.03)  # hue [deg], saturation, value: what noise adds to a background pixel
HUE_STEP_DEG = 2.0  # of 8-bit images
FEW_PIXELS = 20  # of background in a box: fewer weigh less and less
STEP_COST = 0.1  # a step narrower must rid the box of a tenth of the background it can avoid
CUT_STEPS = 2  # what cutting off ball pixels counts for
TOLERANCE_MAX_DEG = 90.0


@dataclass(frozen=True, slots=True, eq=False)
class Paint:
    """What was seen of one ball.

    hsv (n, 3): pixels of all cameras, hue [deg], saturation, value 0..1.  chroma (n, 2): theirs.
    bgr: their median.
    middle_deg: circular mean of the hues.  low_deg, high_deg: where nearly all lie, from the middle [deg].
    saturation, value: of the dark limb.  cuts: higher saturations that a box may ask for, ascending.
    """

    hsv: Array
    chroma: Array
    bgr: tuple[int, int, int]
    middle_deg: float
    low_deg: float
    high_deg: float
    saturation: float
    value: float
    cuts: tuple[float, ...]


def paint_seen(pixels: Image) -> Paint:
    """Sum up pixels bgr (n, 3), n >= 1."""
    hsv = hsv_of(pixels)
    sure = hsv[hsv[:, 1] >= 0.5 * np.median(hsv[:, 1])]
    angles = np.radians(sure[:, 0])
    middle_deg = float(np.degrees(np.arctan2(np.sin(angles).mean(), np.cos(angles).mean()))) % 360.0
    low_deg, high_deg = (float(x) for x in np.percentile(hue_from(sure[:, 0], middle_deg), CORE))
    saturation, value = (float(np.percentile(sure[:, k], LIMB)) for k in (1, 2))
    cuts = tuple(float(x) for x in np.percentile(sure[:, 1], SATURATION_CUTS))
    blue, green, red = (round(float(x)) for x in np.median(pixels, axis=0))
    return Paint(
        hsv,
        chroma(pixels).astype(np.float64),
        (blue, green, red),
        middle_deg,
        low_deg,
        high_deg,
        saturation,
        value,
        cuts,
    )


def gap_deg(lower: Paint, upper: Paint) -> float:
    """Return how many degrees lie between the hues of two balls, negative when they overlap.

    upper: the ball that follows `lower` on the hue circle.
    """
    turn = (upper.middle_deg - lower.middle_deg) % 360.0
    return turn - lower.high_deg + upper.low_deg


def learn_boxes(paints: Sequence[Paint], backgrounds: Sequence[Image]) -> list[Colour]:
    """Choose for each ball the widest box that holds as little of the backgrounds as any.

    Args:
        paints: of each ball.
        backgrounds: background pixels bgr (n, 3) of each camera.
    Returns:
        Boxes whose hues do not overlap: the gap between neighbours is shared out, half to each.
    """
    room = np.concatenate([hsv_of(each) for each in backgrounds]) if backgrounds else np.empty((0, 3))
    order = sorted(range(len(paints)), key=lambda ball: paints[ball].middle_deg)
    boxes: dict[int, Colour] = {}
    for place, ball in enumerate(order):
        before, after = paints[order[place - 1]], paints[order[(place + 1) % len(order)]]
        free = _free(gap_deg(before, paints[ball])), _free(gap_deg(paints[ball], after))
        boxes[ball] = _widest(paints[ball], free, room)
    return [boxes[ball] for ball in range(len(paints))]


def holds(colour: Colour, hsv: Array, guard: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> NDArray[np.bool_]:
    """Say which pixels (n, 3) lie in a box widened by a guard in hue [deg], saturation and value."""
    away = np.abs(hue_from(hsv[:, 0], colour.hue_deg))
    return np.asarray(
        (away <= colour.hue_tolerance_deg + guard[0])
        & (hsv[:, 1] >= colour.saturation_min - guard[1])
        & (hsv[:, 2] >= colour.value_min - guard[2])
    )


def _free(gap: float) -> float:
    """Return the margin that a gap to the next ball's hues leaves, negative where the hues themselves must be cut."""
    return min(MARGIN_MAX_DEG, (gap - HUE_STEP_DEG) / 2.0)


def _widest(paint: Paint, free: tuple[float, float], room: Array) -> Colour:
    """Return the box with the best trade of width against background: narrower by a step only where that pays."""
    saturations = [(step, share * paint.saturation) for step, share in enumerate(SATURATION_SHARES)]
    saturations += [(len(SATURATION_SHARES) + CUT_STEPS * k, least) for k, least in enumerate(paint.cuts, 1)]
    margins, values = list(enumerate(MARGIN_SHARES)), list(enumerate(VALUE_SHARES))
    choices = itertools.product(margins, margins, saturations, values)
    tried = [(sum(step for step, _ in one), _box(paint, free, *(value for _, value in one))) for one in choices]
    near = room[holds(tried[0][1], room, GUARD)]
    near = near[~holds(tried[-1][1], near)]  # what even the narrowest holds no choice avoids
    counts = [int(holds(box, near, GUARD).sum()) for _, box in tried]
    costs = [math.log(count + FEW_PIXELS) + STEP_COST * steps for count, (steps, _) in zip(counts, tried, strict=True)]
    return tried[int(np.argmin(costs))][1]


def _box(
    paint: Paint, free: tuple[float, float], below: float, above: float, saturation: float, value: float
) -> Colour:
    """Return one box: shares of the free margins below and above, least saturation, share of the limb's value."""
    low_deg = paint.low_deg - _margin(free[0], below)
    high_deg = paint.high_deg + _margin(free[1], above)
    tolerance_deg = min(max((high_deg - low_deg) / 2.0, HUE_STEP_DEG / 2.0), TOLERANCE_MAX_DEG)
    hue_deg = (paint.middle_deg + (low_deg + high_deg) / 2.0) % 360.0
    return Colour(
        hue_deg=round(hue_deg, 1) % 360.0,
        hue_tolerance_deg=round(max(0.5, math.floor(tolerance_deg * 10.0) / 10.0 - 0.1), 1),
        saturation_min=round(max(SATURATION_FLOOR, saturation), 3),
        value_min=round(max(VALUE_FLOOR, value * paint.value), 3),
        bgr=paint.bgr,
    )


def _margin(free_deg: float, share: float) -> float:
    return free_deg if free_deg <= MARGIN_MIN_DEG else max(MARGIN_MIN_DEG, share * free_deg)

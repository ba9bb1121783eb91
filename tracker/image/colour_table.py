"""The balls' colours as tables: what a pixel must be to have a ball's colour, without turning it into HSV first."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.image.tint import NEUTRAL, UNITY, Gains
from tracker.rig import Ball, Colour

HUE_STEPS = 180  # OpenCV's 8-bit hue counts half degrees
LEVELS = 256
FIXED_POINT = 12  # bits behind the point in OpenCV's 8-bit HSV
NEVER = LEVELS  # a spread that no pixel has


class ColourTable(NamedTuple):  # spread out into compiled calls
    """The colours of n balls, a row each, prepared for `tracker.image.detect`.

    A pixel has a colour when the spread between its largest and least channel is at least that of its largest
    channel in `least_spread` (n, 256), and its hue, 0..179, is one of `hues` (n, 180).
    lowest_spread: the least of all colours, (256,): nearly every pixel of a room stays below it.
    blue, red: what a pixel's blue and red are multiplied by first, in 1 / UNITY, to undo the colour of the light.
    """

    least_spread: NDArray[np.int16]
    lowest_spread: NDArray[np.int16]
    hues: NDArray[np.bool_]
    blue: int = UNITY
    red: int = UNITY


def colours_of(balls: tuple[Ball, ...], gains: Gains = NEUTRAL) -> ColourTable:
    """Return the tables of the balls' colours in a light."""
    blue, red = gains.undoing
    return _in_light(balls, blue, red)


def colours_of_each(balls: tuple[Ball, ...], undoing: tuple[int, int]) -> tuple[ColourTable, ...]:
    """Return a table of each ball's colour alone, in a light that is undone so."""
    return tuple(_in_light((ball,), *undoing) for ball in balls)


@lru_cache(maxsize=1024)
def _in_light(balls: tuple[Ball, ...], blue: int, red: int) -> ColourTable:
    return _tables(balls)._replace(blue=blue, red=red)


@lru_cache(maxsize=64)
def _tables(balls: tuple[Ball, ...]) -> ColourTable:
    least_spread = np.stack([_least_spread(ball.colour) for ball in balls])
    made = ColourTable(least_spread, least_spread.min(axis=0), np.stack([_hues(ball.colour) for ball in balls]))
    for table in (made.least_spread, made.lowest_spread, made.hues):
        table.flags.writeable = False
    return made


def _least_spread(colour: Colour) -> NDArray[np.int16]:
    """Return for each value 0..255 the least spread of channels that is saturated enough, NEVER if it is too dark.

    Source: OpenCV's 8-bit saturation is spread * round(255 * 2^12 / value) / 2^12, rounded.
    """
    spread = np.arange(LEVELS)
    scale = np.rint((LEVELS - 1 << FIXED_POINT) / np.maximum(spread, 1)).astype(np.int64)
    scale[0] = 0
    saturation = (spread * scale[:, None] + (1 << FIXED_POINT - 1)) >> FIXED_POINT
    enough = saturation >= round(colour.saturation_min * (LEVELS - 1))
    least = np.where(enough.any(axis=1), enough.argmax(axis=1), NEVER)
    least[: round(colour.value_min * (LEVELS - 1))] = NEVER
    return least.astype(np.int16)


def _hues(colour: Colour) -> NDArray[np.bool_]:
    """Return which of the 180 hues are the colour's; they wrap round at 360 deg."""
    low = round((colour.hue_deg - colour.hue_tolerance_deg) / 2.0)
    high = round((colour.hue_deg + colour.hue_tolerance_deg) / 2.0)
    return np.asarray((np.arange(HUE_STEPS) - low) % HUE_STEPS <= high - low)

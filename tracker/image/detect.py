"""Coloured blobs in an image, or in a part of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tracker.image.behind import NO_ROOM, Room
from tracker.image.colour_table import ColourTable, colours_of
from tracker.image.spots import find_spots
from tracker.image.tint import NEUTRAL, Gains
from tracker.rig import Ball
from tracker.types import Array, Image, frozen_array


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of pixels: left, top inclusive, right, bottom exclusive."""

    left: int
    top: int
    right: int
    bottom: int


@dataclass(frozen=True, slots=True, eq=False)
class Blob:
    """A patch of one ball's colour: its centroid uv_px (2,) and its area [px^2]."""

    uv_px: Array
    area_px: float


def region_around(uv_px: Array, half_px: Array, width_px: int, height_px: int) -> Region | None:
    """Return the pixels within half_px (2,) of uv_px (2,), cut to the image, or None when nothing is left."""
    left, top = (max(0, math.floor(uv_px[i] - half_px[i])) for i in (0, 1))
    right = min(width_px, math.ceil(uv_px[0] + half_px[0]) + 1)
    bottom = min(height_px, math.ceil(uv_px[1] + half_px[1]) + 1)
    return Region(left, top, right, bottom) if left < right and top < bottom else None


def find_blobs(
    image: Image,
    region: Region | None,
    balls: tuple[Ball, ...],
    max_area_px: float,
    gains: Gains = NEUTRAL,
    room: Room = NO_ROOM,
) -> list[list[Blob]]:
    """Find the blobs of each ball's colour.

    Args:
        image: (height, width, 3) BGR.
        region: where to look; None for the whole image.
        balls: what to look for.
        max_area_px: larger blobs are no ball [px^2].
        gains: of the light.
        room: what is known to stand behind: what looks like it is no ball.
    Returns:
        For each ball its blobs in the whole image's pixels, largest first.
    """
    if region is None:
        height, width = image.shape[:2]
        region = Region(0, 0, width, height)
    blobs: list[list[Blob]] = [[] for _ in balls]
    for ball, u, v, area in spots_in(image, region, colours_of(balls, gains), max_area_px, room).tolist():
        blobs[int(ball)].append(Blob(frozen_array((u, v)), area))
    return blobs


def spots_in(image: Image, region: Region, colours: ColourTable, max_area_px: float, room: Room = NO_ROOM) -> Array:
    """Find the blobs of each of the colours of a table, as plain numbers: some microseconds for a ball's surroundings.

    Args:
        image: (height, width, 3) BGR.
        region: where to look; it must lie within the image.
        colours: from `tracker.image.colour_table.colours_of`.
        max_area_px: larger blobs are no ball [px^2].
        room: what is known to stand behind.
    Returns:
        (m, 4): index of the colour, centroid u and v in the whole image [px], area [px^2]; largest first.
    Raises:
        ValueError: the region reaches beyond the image.
    """
    left, top, right, bottom = region.left, region.top, region.right, region.bottom
    height, width = image.shape[:2]
    if not (0 <= left <= right <= width and 0 <= top <= bottom <= height):  # the compiled loop checks no index
        raise ValueError(f"{region} reaches beyond an image of {width} x {height} px")
    spots, _ = find_spots(
        np.ascontiguousarray(image),
        room.mean,
        room.looks,
        left,
        top,
        right,
        bottom,
        colours.least_spread,
        colours.lowest_spread,
        colours.hues,
        colours.blue,
        colours.red,
        float(max_area_px),
    )
    return spots

"""Coloured blobs in an image, or in a part of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from tracker.rig import Ball, Colour
from tracker.types import Array, Image, frozen_array

MIN_AREA_PX = 4
FILL_MIN = 0.4  # share of its bounding box that a blob of a disc covers (pi/4 when whole)
ASPECT_MAX = 2.2
HUE_STEPS = 180  # OpenCV's 8-bit hue counts half degrees


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


def find_blobs(image: Image, region: Region | None, balls: tuple[Ball, ...], max_area_px: float) -> list[list[Blob]]:
    """Find the blobs of each ball's colour.

    Args:
        image: (height, width, 3) BGR.
        region: where to look; None for the whole image.
        balls: what to look for.
        max_area_px: larger blobs are no ball [px^2].
    Returns:
        For each ball its blobs in the whole image's pixels, largest first.
    """
    part = image if region is None else image[region.top : region.bottom, region.left : region.right]
    offset = np.zeros(2) if region is None else np.array([region.left, region.top], dtype=np.float64)
    hsv: Image = np.asarray(cv2.cvtColor(part, cv2.COLOR_BGR2HSV), dtype=np.uint8)
    return [_blobs_of(colour_mask(hsv, ball.colour), offset, max_area_px) for ball in balls]


def colour_mask(hsv: Image, colour: Colour) -> Image:
    """Return the mask (height, width), 255 where an HSV image has the colour; hues wrap round at 360 deg."""
    low = round((colour.hue_deg - colour.hue_tolerance_deg) / 2.0)
    high = round((colour.hue_deg + colour.hue_tolerance_deg) / 2.0)
    saturation, value = round(colour.saturation_min * 255), round(colour.value_min * 255)
    spans = [(max(low, 0), min(high, HUE_STEPS - 1))]
    if low < 0:
        spans.append((low + HUE_STEPS, HUE_STEPS - 1))
    if high >= HUE_STEPS:
        spans.append((0, high - HUE_STEPS))
    masks = [cv2.inRange(hsv, (first, saturation, value), (last, 255, 255)) for first, last in spans]
    return np.asarray(masks[0] if len(masks) == 1 else cv2.bitwise_or(masks[0], masks[1]), dtype=np.uint8)


def _blobs_of(mask: Image, offset: Array, max_area_px: float) -> list[Blob]:
    """Return the connected parts of a mask that may be a disc, largest first."""
    count, _, stats, centroids = cv2.connectedComponentsWithStats(mask, connectivity=8)
    blobs = []
    for k in range(1, count):
        _, _, width, height, area = (int(x) for x in stats[k])
        if not MIN_AREA_PX <= area <= max_area_px:
            continue
        if area < FILL_MIN * width * height or max(width, height) > ASPECT_MAX * min(width, height) + 1:
            continue
        blobs.append(Blob(frozen_array(centroids[k] + offset), float(area)))
    return sorted(blobs, key=lambda blob: -blob.area_px)

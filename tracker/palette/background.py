"""The room without the vehicle, and what in it looks like a ball."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.image.detect import Region
from tracker.image.nearest import LEAST_AREA_SHARE, MOST_AREA_SHARE
from tracker.image.spots import ASPECT_MAX, FILL_MIN, MIN_AREA_PX
from tracker.palette.box import Paint
from tracker.palette.chroma import chroma, hsv_of, hue_from
from tracker.palette.mask import colour_mask
from tracker.rig import Colour
from tracker.types import Array, Image

BEHIND_MAX = 0.3  # share of pictures in which a pixel may show the vehicle and its median still be room
LEAST_SEEN = 3  # pictures without the vehicle that a pixel needs
CLOSE_HUE_DEG, CLOSE_SHARE = 8.0, 0.85  # hue beyond the box; share of its least saturation and value
CLOSE_SIGMA = 4.0  # of the ball's own colours
SPREAD_FLOOR = 0.05  # of chroma, one sigma: what light and noise change at the least

Pixels = tuple[NDArray[np.intp], NDArray[np.intp]]
"""Rows and columns."""


class ClashKind(StrEnum):
    """What a background region does to a ball of its colour."""

    LOOKS_LIKE = "looks_like"  # as large and as round as a ball: taken for one
    HIDES = "hides"  # larger: a ball before it melts into it
    CLOSE = "close"  # outside the box, not by much: other light may make it one


@dataclass(frozen=True, slots=True)
class Clash:
    """A background region in a ball's colour.

    region: pixels.  area_px: how many have the colour.  hue_deg: their median hue.
    apart_deg: between the region's hue and the ball's.  apart_sigma: between their colours, hue and saturation, in
        standard deviations of the ball's pixels.
    """

    camera: int
    ball: int
    kind: ClashKind
    region: Region
    area_px: int
    hue_deg: float
    apart_deg: float
    apart_sigma: float

    @property
    def serious(self) -> bool:
        """Say whether it speaks against a flight."""
        return self.kind is not ClashKind.CLOSE


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """One camera's room: its image (h, w, 3) BGR and 255 in `known` (h, w) where it was seen without the vehicle."""

    image: Image
    known: Image

    @property
    def pixels(self) -> Image:
        """Return the known pixels (n, 3)."""
        return self.image[self.known > 0]


def learn_background(images: Sequence[Image], vehicles: Sequence[Image]) -> Background:
    """Return the median of pictures, where the vehicle stood often without those that show it.

    Args:
        images: of one camera, (h, w, 3) BGR.
        vehicles: 255 where each shows the vehicle, (h, w).
    """
    stack = np.stack(images)
    hidden = np.stack(vehicles) > 0
    room = np.sort(stack, axis=0)[len(stack) // 2]
    known = np.full(room.shape[:2], 255, dtype=np.uint8)
    rows, columns = np.nonzero(hidden.mean(axis=0) > BEHIND_MAX)
    if len(rows):
        values = np.where(hidden[:, rows, columns, None], np.nan, stack[:, rows, columns].astype(np.float64))
        enough = (~hidden[:, rows, columns]).sum(axis=0) >= LEAST_SEEN
        known[rows[~enough], columns[~enough]] = 0
        rows, columns, values = rows[enough], columns[enough], values[:, enough]
        if len(rows):
            room[rows, columns] = np.rint(np.nanmedian(values, axis=0)).astype(np.uint8)
    return Background(np.asarray(room, dtype=np.uint8), known)


def find_clashes(
    camera: int, room: Background, colours: Sequence[Colour], paints: Sequence[Paint], radii_px: tuple[float, float]
) -> list[Clash]:
    """Find what in one camera's background has, or nearly has, a ball's colour; the worst first.

    radii_px: the least and largest radius of a ball at the distances of this room [px].
    """
    hsv: Image = np.asarray(cv2.cvtColor(room.image, cv2.COLOR_BGR2HSV), dtype=np.uint8)
    found: list[Clash] = []
    for ball, (colour, paint) in enumerate(zip(colours, paints, strict=True)):
        inside = cv2.bitwise_and(colour_mask(hsv, colour), room.known)
        near = cv2.bitwise_and(colour_mask(hsv, _wider(colour)), room.known)
        near[cv2.dilate(inside, np.ones((5, 5), dtype=np.uint8)) > 0] = 0
        for mask, close in ((inside, False), (near, True)):
            for kind, region, pixels in _parts(np.asarray(mask, dtype=np.uint8), radii_px):
                if close and kind is ClashKind.HIDES:
                    continue  # no ball looks for itself there, and a box need not be clear of all the room
                shown = room.image[pixels]
                name = ClashKind.CLOSE if close else kind
                clash = _clash(camera, ball, name, region, np.asarray(shown, dtype=np.uint8), paint)
                if clash.serious or clash.apart_sigma <= CLOSE_SIGMA:
                    found.append(clash)
    order = list(ClashKind)
    return sorted(found, key=lambda clash: (order.index(clash.kind), -clash.area_px))


def _wider(colour: Colour) -> Colour:
    return Colour(
        colour.hue_deg,
        min(colour.hue_tolerance_deg + CLOSE_HUE_DEG, 90.0),
        colour.saturation_min * CLOSE_SHARE,
        colour.value_min * CLOSE_SHARE,
        colour.bgr,
    )


def _parts(mask: Image, radii_px: tuple[float, float]) -> list[tuple[ClashKind, Region, Pixels]]:
    """Return kind, rectangle and pixels of the parts of a mask that matter to a ball, neighbours taken together."""
    reach = 2 * math.ceil(radii_px[1]) + 1
    joined = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((reach, reach), dtype=np.uint8))
    groups = cv2.connectedComponents(joined, connectivity=8)[1]
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    worst: dict[int, ClashKind] = {}
    for k in range(1, count):
        kind = _kind(stats[k], radii_px)
        if kind is not None:
            left, top, width, _, _ = (int(x) for x in stats[k])
            group = int(groups[top, left + int(np.flatnonzero(labels[top, left : left + width] == k)[0])])
            if worst.get(group) is not ClashKind.LOOKS_LIKE:
                worst[group] = kind
    parts = []
    for group, kind in worst.items():
        rows, columns = np.nonzero((groups == group) & (mask > 0))
        region = Region(int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1)
        parts.append((kind, region, (rows, columns)))
    return parts


def _kind(stats: NDArray[np.int32], radii_px: tuple[float, float]) -> ClashKind | None:
    """Say what a connected part (left, top, width, height, area) does to a ball, by the detector's limits."""
    _, _, width, height, area = (int(x) for x in stats)
    least, most = LEAST_AREA_SHARE * math.pi * radii_px[0] ** 2, MOST_AREA_SHARE * math.pi * radii_px[1] ** 2
    if area < max(MIN_AREA_PX, least):
        return None
    round_ = area >= FILL_MIN * width * height and max(width, height) <= ASPECT_MAX * min(width, height) + 1
    if round_ and area <= most:
        return ClashKind.LOOKS_LIKE
    return ClashKind.HIDES if area >= math.pi * radii_px[0] ** 2 else None


def _clash(camera: int, ball: int, kind: ClashKind, region: Region, shown: Image, paint: Paint) -> Clash:
    hsv = hsv_of(shown)
    angles = np.radians(hsv[:, 0])
    middle_deg = float(np.degrees(np.arctan2(np.sin(angles).mean(), np.cos(angles).mean())))
    hue_deg = (middle_deg + float(np.median(hue_from(hsv[:, 0], middle_deg)))) % 360.0
    apart_deg = abs(float(hue_from(hue_deg, paint.middle_deg)))
    return Clash(camera, ball, kind, region, len(shown), hue_deg, apart_deg, _sigmas(shown, paint))


def _sigmas(shown: Image, paint: Paint) -> float:
    """Return the distance of a region's median chroma from a ball's, in the ball's own spread."""
    there = paint.chroma
    covariance = np.cov(there.T) + SPREAD_FLOOR**2 * np.eye(2) if len(there) > 2 else SPREAD_FLOOR**2 * np.eye(2)
    away: Array = np.median(chroma(shown), axis=0).astype(np.float64) - np.median(there, axis=0)
    return float(np.sqrt(away @ np.linalg.solve(covariance, away)))

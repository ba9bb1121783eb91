"""Small spots of any colour: what differs from its surroundings on the scale of a ball."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from tracker.palette.chroma import Plane, chroma
from tracker.types import Array, Image

SCALES = (0.75, 1.6)  # of the ball's expected radius
LEAST_CONTRAST = 0.15  # of chroma: paints have 0.4 and more
MOST_SPOTS = 48  # an image, strongest first
SURROUND = 3.0  # radii: one sigma of what counts as surroundings


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """n spots of one image.

    uv_px (n, 2): centres.  radius_px (n,): of a disc of their area.  chroma (n, 2): of their middles.
    """

    uv_px: Array
    radius_px: Array
    chroma: Array

    def __len__(self) -> int:
        return len(self.uv_px)


def find_spots(image: Image, radius_px: float) -> Spots:
    """Find the spots of an image (h, w, 3) BGR, strongest first, about as large as a ball of a radius [px]."""
    colour = chroma(image)
    peaks: list[tuple[float, int, int, float]] = []
    smooth = {scale: _smooth(colour, max(0.5, 0.5 * scale * radius_px)) for scale in SCALES}
    far = _surroundings(colour, SURROUND * radius_px)
    for scale, near in smooth.items():
        peaks += [(*peak, scale * radius_px) for peak in _peaks(near - far, scale * radius_px)]
    peaks.sort(reverse=True)
    kept: list[tuple[int, int, float]] = []
    for _, v, u, reach_px in peaks:
        if len(kept) == MOST_SPOTS:
            break
        if all((u - a) ** 2 + (v - b) ** 2 > radius_px**2 for a, b, _ in kept):
            kept.append((u, v, reach_px))
    return _measured(colour, kept)


def _smooth(colour: Plane, sigma_px: float) -> Plane:
    return np.asarray(cv2.GaussianBlur(colour, (0, 0), sigma_px), dtype=np.float32)


def _surroundings(colour: Plane, sigma_px: float) -> Plane:
    """Return what a wide Gaussian would, by two boxes of width w, each of variance (w^2 - 1) / 12."""
    side = 2 * round(math.sqrt(6.0 * sigma_px**2 + 1.0) / 2.0) + 1
    return np.asarray(cv2.blur(cv2.blur(colour, (side, side)), (side, side)), dtype=np.float32)


def _peaks(contrast: Plane, radius_px: float) -> list[tuple[float, int, int]]:
    """Return strength, row and column of the maxima of a contrast (h, w, 2)."""
    strength = np.hypot(contrast[..., 0], contrast[..., 1])
    side = 2 * math.ceil(radius_px) + 1
    highest = cv2.dilate(strength, np.ones((side, side), dtype=np.uint8))
    rows, columns = np.nonzero((strength >= highest) & (strength > LEAST_CONTRAST))
    found = strength[rows, columns]
    best = np.argsort(-found, kind="stable")[: 2 * MOST_SPOTS]
    return [(float(found[k]), int(rows[k]), int(columns[k])) for k in best]


def _measured(colour: Plane, peaks: list[tuple[int, int, float]]) -> Spots:
    """Return the spots at peaks (u, v, reach): the pixels at least half as different as the middle ones."""
    height, width = colour.shape[:2]
    centres, radii, colours = [], [], []
    for u, v, reach_px in peaks:
        half = math.ceil(2.0 * reach_px) + 2
        if not (half <= u < width - half and half <= v < height - half):
            continue
        part = colour[v - half : v + half + 1, u - half : u + half + 1]
        x, y = (axis.astype(np.float64) for axis in np.meshgrid(*[np.arange(-half, half + 1)] * 2))
        rim = np.maximum(np.abs(x), np.abs(y)) == half
        middle = np.median(part[half - 1 : half + 2, half - 1 : half + 2].reshape(-1, 2), axis=0)
        away = middle - np.median(part[rim], axis=0)
        share = (part - np.median(part[rim], axis=0)) @ (away / max(float(away @ away), 1e-6))
        inside = _joined(share > 0.5, half)
        weight = np.clip(share, 0.0, 1.0) * inside
        total = max(float(weight.sum()), 1e-6)
        centres.append((u + float((weight * x).sum()) / total, v + float((weight * y).sum()) / total))
        radii.append(math.sqrt(float(inside.sum()) / math.pi))
        colours.append(middle)
    return Spots(
        np.array(centres, dtype=np.float64).reshape(-1, 2),
        np.array(radii, dtype=np.float64),
        np.array(colours, dtype=np.float64).reshape(-1, 2),
    )


def _joined(mask: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], half: int) -> Array:
    """Return 1 on the part of a square mask that holds its middle, else 0."""
    _, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    here = labels[half, half]
    return np.asarray((labels == here) & (here > 0), dtype=np.float64)

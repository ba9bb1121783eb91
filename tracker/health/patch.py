"""Small pieces of the room that a camera would know again: chosen once, then looked up in later images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from tracker.types import Array, Image

HALF_PX = 8  # of a patch's side
NEAR_PX, FAR_PX = 6, 48  # how far it is looked for, usually and once it is not found there
APART_PX = 36  # of patches: they shall not all be covered by one hand
MOST = 12
CORNER_LEVELS2 = 1.0  # least eigenvalue of the mean outer product of the gradient [grey levels^2 / px^2]
NOISE_LEVELS = 2.5  # of a pixel, one sigma
LEAST_SIGMA_PX = 0.03  # that parabolas leave
ALIKE = 0.7  # least correlation with the image it was cut from: below, something stands before it
GREEN = 1  # the channel with the least noise


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """One piece of the room: its middle (u, v) in the image [px] and what it looks like (17, 17).

    sigma_px: one sigma of where it is found.
    """

    u_px: int
    v_px: int
    look: Image
    sigma_px: float

    def moved_px(self, image: Image, reach_px: int = NEAR_PX) -> tuple[float, float] | None:
        """Return how far it stands from where it stood in an image (h, w, 3) [px], None if it is not found.

        Source: the largest normalised correlation, which a change of light leaves as it is; between pixels by the
            parabolas through it and its neighbours.
        """
        reach_px = self._reach_px(image, reach_px)
        side = HALF_PX + reach_px
        part = image[self.v_px - side : self.v_px + side + 1, self.u_px - side : self.u_px + side + 1, GREEN]
        likeness = cv2.matchTemplate(np.ascontiguousarray(part), self.look, cv2.TM_CCOEFF_NORMED)
        _, best, _, (column, row) = cv2.minMaxLoc(likeness)
        last = 2 * reach_px
        if not best >= ALIKE or column in (0, last) or row in (0, last):
            return None
        across, down = likeness[row, column - 1 : column + 2].tolist(), likeness[row - 1 : row + 2, column].tolist()
        return column - reach_px + _summit(*across), row - reach_px + _summit(*down)

    def _reach_px(self, image: Image, reach_px: int) -> int:
        """Return how far the search may go without leaving the image."""
        height, width = image.shape[:2]
        room = min(self.u_px, self.v_px, width - 1 - self.u_px, height - 1 - self.v_px)
        return min(reach_px, int(room) - HALF_PX)


def choose_patches(image: Image, keep_off_px: Array, off_px: float) -> tuple[Patch, ...]:
    """Choose up to MOST pieces of an image (h, w, 3) that are corners, the sharpest first.

    Args:
        keep_off_px: (n, 2) where things stand that will move [px].  off_px: how far to keep off them [px].
    Source: the smaller eigenvalue of the gradient's second moments; Shi, Tomasi, "Good features to track" (1994).
    """
    grey = np.ascontiguousarray(image[..., GREEN])
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    side = 2 * HALF_PX + 1
    corner = cv2.cornerMinEigenVal(smooth, side) * (255.0 / 2.0) ** 2  # OpenCV has slopes of 2 / 255 a level
    rim = HALF_PX + NEAR_PX + 1
    inside = np.zeros_like(corner)
    inside[rim:-rim, rim:-rim] = corner[rim:-rim, rim:-rim]
    for u, v in keep_off_px.tolist():
        cv2.circle(inside, (round(u), round(v)), round(off_px), 0.0, cv2.FILLED)
    patches: list[Patch] = []
    while len(patches) < MOST:
        _, best, _, (u, v) = cv2.minMaxLoc(inside)
        if best < CORNER_LEVELS2:
            break
        look = grey[v - HALF_PX : v + HALF_PX + 1, u - HALF_PX : u + HALF_PX + 1].copy()
        patches.append(Patch(u, v, look, math.hypot(LEAST_SIGMA_PX, NOISE_LEVELS / math.sqrt(best) / side)))
        cv2.circle(inside, (u, v), APART_PX, 0.0, cv2.FILLED)
    return tuple(patches)


def _summit(before: float, top: float, after: float) -> float:
    """Return where the parabola through three values at -1, 0 and 1 is highest."""
    bend = before - 2.0 * top + after
    return (before - after) / (2.0 * bend) if bend < 0.0 else 0.0

"""The still room behind the balls as one camera sees it, learned tile by tile while the vehicle flies elsewhere.

A ball's limb is part ball, part room. A plain wall is a plane; writing, books or the edge of a window are none, and
draw a centre by tenths of a pixel, the same from frame to frame, so that no filter averages it out. But the cameras
stand still, and what is behind a ball was seen before the ball came.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.camera import Camera
from tracker.maths.compiled import compiled
from tracker.types import Frame, Image

TILE_PX = 16
KNOWN, WELL_KNOWN, ENOUGH = 4, 8, 24  # looks from which a tile serves, and tells gamma; the most that its mean is of
APART_NS = 250_000_000  # from look to look: a hand or a tube that stays for a moment is not the room
MANY, SOME, FEW = 96, 8, 16  # tiles a round: not known yet; of those that would be known better; of all by turn
NEARER = 4.0  # tiles further away that count as much as one look more
SELDOM = 4  # a camera's rounds for one look, once all is known
CHANGED_LEVELS = 12.0  # of the green channel, one sigma within a tile: no noise, something else stands there


class Room(NamedTuple):
    """What stands behind: mean (height, width, 3) BGR [grey levels], and looks (rows, columns) at each tile so far."""

    mean: NDArray[np.float32]
    looks: NDArray[np.uint8]


NO_ROOM = Room(np.zeros((0, 0, 3), np.float32), np.zeros((0, 0), np.uint8))


class Behind:
    """Learns what is behind the balls for one camera, as much each round as costs little."""

    def __init__(self, camera: Camera) -> None:
        height, width = camera.height_px, camera.width_px
        tiles = height // TILE_PX, width // TILE_PX  # what is left at the right and below is not learned
        self.room = Room(np.zeros((height, width, 3), np.float32), np.zeros(tiles, np.uint8))
        self._looked_ns = np.full(tiles, -(2**62))
        self._next = np.zeros(1, np.int64)
        self._eager = True  # whether the last look was at something not known yet
        self._turn = 0

    def is_due(self) -> bool:
        """Say whether to look in this round of the camera: in each while there is much to learn, then in some."""
        self._turn += 1
        return self._eager or self._turn % SELDOM == 0

    def learn(self, frame: Frame, middle_px: tuple[float, float], clear_px: float) -> None:
        """Learn some of what shows beside the vehicle, the nearest first: that is where it may fly next.

        middle_px: of the vehicle in the frame.  clear_px: how far round it the vehicle may hide the room.
        """
        self._eager = _learn(frame.image, *self.room, *middle_px, clear_px, frame.t_ns, self._looked_ns, self._next)

    def forget(self) -> None:
        """Start anew: the camera has moved."""
        self.room.looks[:] = 0
        self._eager = True


@compiled("b1(Array(u1, 2, 'C'), i8, i8, i8, i8)")
def is_known(looks: NDArray[np.uint8], u: int, v: int, half: int, least: int) -> bool:
    """Say whether all that is within `half` px of a pixel has been seen so often at least."""
    if looks.size == 0:
        return False
    top, bottom, left, right = (
        (v - half) // TILE_PX,
        (v + half) // TILE_PX,
        (u - half) // TILE_PX,
        (u + half) // TILE_PX,
    )
    if top < 0 or left < 0 or bottom >= looks.shape[0] or right >= looks.shape[1]:
        return False
    for row in range(top, bottom + 1):
        for column in range(left, right + 1):
            if looks[row, column] < least:
                return False
    return True


@compiled("f8(i8, i8, f8, f8)")
def _away_px(row: int, column: int, u: float, v: float) -> float:
    """Return how far a tile's nearest pixel is from a place."""
    left, top = float(column * TILE_PX), float(row * TILE_PX)
    du, dv = max(left - u, 0.0, u - left - TILE_PX), max(top - v, 0.0, v - top - TILE_PX)
    return float(np.sqrt(du * du + dv * dv))


@compiled("void(Array(u1, 3, 'C', True), Array(f4, 3, 'C'), Array(u1, 2, 'C'), i8, i8)")
def _look_at(image: Image, mean: NDArray[np.float32], looks: NDArray[np.uint8], row: int, column: int) -> None:
    """Take a tile into its mean, or begin it anew where something else stands now."""
    top, left, known = row * TILE_PX, column * TILE_PX, looks[row, column]
    if known > 0:
        total = squares = 0.0
        for y in range(top, top + TILE_PX):
            for x in range(left, left + TILE_PX):
                off = image[y, x, 1] - mean[y, x, 1]
                total += off
                squares += off * off
        share = 1.0 / TILE_PX**2
        if squares * share - (total * share) ** 2 > CHANGED_LEVELS**2:
            known = 0
    looks[row, column] = min(known + 1, ENOUGH)
    weight = np.float32(1.0 / looks[row, column])
    pixels, means = image.reshape(image.size), mean.reshape(mean.size)
    for y in range(top, top + TILE_PX):
        first = 3 * (y * image.shape[1] + left)
        seen, kept = pixels[first : first + 3 * TILE_PX], means[first : first + 3 * TILE_PX]
        for i in range(3 * TILE_PX):  # of known number, so that the processor takes many at once
            kept[i] += weight * (np.float32(seen[i]) - kept[i])


@compiled("b1(Array(u1, 3, 'C', True), Array(f4, 3, 'C'), Array(u1, 2, 'C'), f8, f8, f8, i8, i8[:, ::1], i8[::1])")
def _learn(
    image: Image, mean: NDArray[np.float32], looks: NDArray[np.uint8], u: float, v: float, clear_px: float,
    t_ns: int, looked_ns: NDArray[np.int64], following: NDArray[np.int64],
) -> bool:  # fmt: skip
    """Look at the tiles that need it most, and at a few of all by turn; `following` (1,) is the last of those.

    Returns whether one was not known yet.
    """
    rows, columns = looks.shape
    chosen, needs, count = np.empty(MANY, np.int64), np.empty(MANY), 0
    for row in range(rows):
        for column in range(columns):
            known = looks[row, column]
            if known >= ENOUGH or abs(t_ns - looked_ns[row, column]) < APART_NS:
                continue
            away_px = _away_px(row, column, u, v)
            need = NEARER * known + away_px / TILE_PX
            if away_px < clear_px or (count == MANY and need >= needs[MANY - 1]):
                continue
            count = min(count + 1, MANY)
            k = count - 1
            while k > 0 and needs[k - 1] > need:
                needs[k], chosen[k] = needs[k - 1], chosen[k - 1]
                k -= 1
            needs[k], chosen[k] = need, row * columns + column
    eager = False
    for k in range(count):
        row, column = chosen[k] // columns, chosen[k] % columns
        unknown = looks[row, column] < WELL_KNOWN
        eager = eager or unknown
        if k < SOME or unknown:
            _look_at(image, mean, looks, row, column)
            looked_ns[row, column] = t_ns
    for _ in range(FEW):
        following[0] = (following[0] + 1) % (rows * columns)
        row, column = following[0] // columns, following[0] % columns
        if _away_px(row, column, u, v) >= clear_px:
            _look_at(image, mean, looks, row, column)
    return eager

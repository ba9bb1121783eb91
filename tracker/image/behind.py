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
SUPPOSED = 1  # of `Room.looks`: of a tile that nobody looked at beside the vehicle, so that it may be there itself
KNOWN, WELL_KNOWN = SUPPOSED + 4, SUPPOSED + 8  # from which a tile serves centres, and tells gamma
ENOUGH = SUPPOSED + 24  # looks that a tile's mean is of at the most
ALIKE_LEVELS = 12.0  # a pixel that is no further from the room, once lit alike, shows it: noise and JPEG stay below
SHADED, BRIGHTER = 0.4, 1.25  # of the light: a shadow or a thin tube leave so much, lamps flicker and warm up
APART_NS = 250_000_000  # from look to look: a hand or a tube that stays for a moment is not the room
MANY, SOME, FEW = 96, 8, 16  # tiles a round: not known yet; of those that would be known better; of all by turn
NEARER = 4.0  # tiles further away that count as much as one look more
SELDOM = 4  # a camera's rounds for one look, once all is known
CHANGED_LEVELS = 12.0  # of the green channel, one sigma within a tile: no noise, something else stands there


class Room(NamedTuple):
    """What stands behind: mean (height, width, 3) BGR [grey levels], and looks (rows, columns) at each tile so far.

    looks: 0 where nothing is known, SUPPOSED, or SUPPOSED and one more for each look.
    """

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
        self._lately: list[Frame] = []  # some of the last frames without a track

    @property
    def known(self) -> Room:
        """Return the room, `NO_ROOM` while nothing of it is known."""
        return self.room if self.room.looks.any() else NO_ROOM

    def is_due(self) -> bool:
        """Say whether to look in this round of the camera: in each while there is much to learn, then in some."""
        self._turn += 1
        return self._eager or self._turn % SELDOM == 0

    def learn(self, frame: Frame, middle_px: tuple[float, float], clear_px: float) -> None:
        """Learn some of what shows beside the vehicle, the nearest first: that is where it may fly next.

        middle_px: of the vehicle in the frame.  clear_px: how far round it the vehicle may hide the room.
        """
        self._lately.clear()
        self._eager = _learn(frame.image, *self.room, *middle_px, clear_px, frame.t_ns, self._looked_ns, self._next)

    def suppose(self, frame: Frame) -> None:
        """Take for the room, where nothing else is known of it, what showed in most of some frames without a track.

        The vehicle may be anywhere: what it hid all the time is taken for the room, too. So nothing but balls that move
        are told from it, and no centre is fitted by it.
        """
        if self._lately and abs(frame.t_ns - self._lately[-1].t_ns) < APART_NS:
            return
        self._lately = [*self._lately[-2:], frame]
        three = [self._lately[0]] * (3 - len(self._lately)) + self._lately
        _suppose(three[0].image, three[1].image, three[2].image, *self.room)

    def forget(self) -> None:
        """Start anew: the camera has moved."""
        self._lately.clear()
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


@compiled("b1(Array(u1, 1, 'C', True), f4[::1], i8)", inline=True)
def _is_alike(image: NDArray[np.uint8], mean: NDArray[np.float32], at: int) -> bool:
    """Say whether a pixel, whose first byte is given, looks as the room does, lit as brightly as it is there now."""
    both = squares = 0.0
    for i in range(at, at + 3):
        both += image[i] * mean[i]
        squares += mean[i] * mean[i]
    light = min(max(both / max(squares, 1.0), SHADED), BRIGHTER)
    off = 0.0
    for i in range(at, at + 3):
        off = max(off, abs(image[i] - light * mean[i]))
    return bool(off <= ALIKE_LEVELS * min(light, 1.0))


@compiled(
    "UniTuple(i8, 2)(Array(u1, 1, 'C', True), i8, i8, Array(f4, 3, 'C'), Array(u1, 2, 'C'), Array(b1, 2, 'C', True),"
    "i8[:, ::1], i8)"
)
def without_room(
    image: NDArray[np.uint8], width: int, row: int, mean: NDArray[np.float32], looks: NDArray[np.uint8],
    hues: NDArray[np.bool_], pixels: NDArray[np.int64], count: int,
) -> tuple[int, int]:  # fmt: skip
    """Leave out of a row's pixels those of no ball's hue, and those that look as the known room does.

    Args:
        image: all bytes of a BGR image, `width` pixels a row.
        hues: of the balls' colours, see `ColourTable`.
        pixels (any, 4): column, value, spread and hue, `count` of them.
    Returns:
        How many are left, and how many looked as the room does.
    """
    left, alike, means = 0, 0, mean.reshape(mean.size)
    for k in range(count):
        column, hue = pixels[k, 0], pixels[k, 3]
        of_a_ball = False
        for ball in range(len(hues)):
            of_a_ball = of_a_ball or hues[ball, hue]
        if not of_a_ball:
            continue
        down, along = row // TILE_PX, column // TILE_PX
        known = down < looks.shape[0] and along < looks.shape[1] and looks[down, along] >= SUPPOSED
        if known and _is_alike(image, means, 3 * (row * width + column)):
            alike += 1
            continue
        for i in range(4):
            pixels[left, i] = pixels[k, i]
        left += 1
    return left, alike


@compiled(
    "void(Array(u1, 3, 'C', True), Array(u1, 3, 'C', True), Array(u1, 3, 'C', True), Array(f4, 3, 'C'),"
    "Array(u1, 2, 'C'))"
)
def _suppose(oldest: Image, middle: Image, newest: Image, mean: NDArray[np.float32], looks: NDArray[np.uint8]) -> None:
    """Fill in the median of three images in the tiles that nobody has looked at."""
    for row in range(looks.shape[0] * TILE_PX):
        for column in range(looks.shape[1] * TILE_PX):
            if looks[row // TILE_PX, column // TILE_PX] <= SUPPOSED:
                for i in range(3):
                    a, b, c = oldest[row, column, i], middle[row, column, i], newest[row, column, i]
                    mean[row, column, i] = max(min(a, b), min(max(a, b), c))
    for row in range(looks.shape[0]):
        for column in range(looks.shape[1]):
            looks[row, column] = max(looks[row, column], SUPPOSED)


@compiled("f8(i8, i8, f8, f8)")
def _away_px(row: int, column: int, u: float, v: float) -> float:
    """Return how far a tile's nearest pixel is from a place."""
    left, top = float(column * TILE_PX), float(row * TILE_PX)
    du, dv = max(left - u, 0.0, u - left - TILE_PX), max(top - v, 0.0, v - top - TILE_PX)
    return float(np.sqrt(du * du + dv * dv))


@compiled("void(Array(u1, 3, 'C', True), Array(f4, 3, 'C'), Array(u1, 2, 'C'), i8, i8)")
def _look_at(image: Image, mean: NDArray[np.float32], looks: NDArray[np.uint8], row: int, column: int) -> None:
    """Take a tile into its mean, or begin it anew where something else stands now."""
    top, left, known = row * TILE_PX, column * TILE_PX, max(0, looks[row, column] - SUPPOSED)
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
    looks[row, column] = min(SUPPOSED + known + 1, ENOUGH)
    weight = np.float32(1.0 / (looks[row, column] - SUPPOSED))
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
            need = NEARER * max(0, known - SUPPOSED) + away_px / TILE_PX
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

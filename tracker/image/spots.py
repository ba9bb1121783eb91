"""Connected spots of the balls' colours in a rectangle of pixels, found row by row in one pass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.image.behind import without_room
from tracker.image.colour_table import FIXED_POINT, HUE_STEPS, LEVELS
from tracker.image.tint import UNITY
from tracker.maths.compiled import compiled
from tracker.types import Array, Image

MIN_AREA_PX = 4
FILL_MIN = 0.4  # share of its bounding box that a spot of a disc covers (pi/4 when whole)
ASPECT_MAX = 2.2

_HUE_SCALE = np.array([0, *(round((HUE_STEPS << FIXED_POINT) / (6.0 * k)) for k in range(1, LEVELS))])
_HALF = 1 << FIXED_POINT - 1

# The table of spots while they grow, by column; a spot that met another one leads to it by its PARENT.
_PARENT, _BALL, _AREA, _SUM_U, _SUM_V, _LEFT, _TOP, _RIGHT, _BOTTOM, _COLUMNS = range(10)
_FIRST_CAPACITY = 64
WIDE_PX = 64  # rows as long as that are worth a first look at many pixels at once


@compiled("i8(i8, i8, i8, i8, i8)", inline=True)
def _hue(blue: int, green: int, red: int, value: int, spread: int) -> int:
    """Return OpenCV's 8-bit hue, 0..179, of a pixel whose largest channel is `value`, its least `spread` below."""
    if value == red:
        turn = green - blue
    elif value == green:
        turn = blue - red + 2 * spread
    else:
        turn = red - green + 4 * spread
    hue: int = (turn * _HUE_SCALE[spread] + _HALF) >> FIXED_POINT
    return hue if hue >= 0 else hue + HUE_STEPS


@compiled("i8(i8[:, ::1], i8)", inline=True)
def _root(spots: NDArray[np.int64], spot: int) -> int:
    """Return the spot that this one has become part of, shortening the way for the next time."""
    while spots[spot, _PARENT] != spot:
        spots[spot, _PARENT] = spots[spots[spot, _PARENT], _PARENT]
        spot = spots[spot, _PARENT]
    return spot


@compiled("i8(i8[:, ::1], i8, i8)", inline=True)
def _join(spots: NDArray[np.int64], a: int, b: int) -> int:
    """Make two spots one and return it."""
    a, b = _root(spots, a), _root(spots, b)
    if a == b:
        return a
    a, b = min(a, b), max(a, b)
    spots[b, _PARENT] = a
    for column in (_AREA, _SUM_U, _SUM_V):
        spots[a, column] += spots[b, column]
    for column in (_LEFT, _TOP):
        spots[a, column] = min(spots[a, column], spots[b, column])
    for column in (_RIGHT, _BOTTOM):
        spots[a, column] = max(spots[a, column], spots[b, column])
    return a


@compiled("void(i8[:, ::1], i8, i8, i8, i8, i8)", inline=True)
def _start(spots: NDArray[np.int64], spot: int, ball: int, first: int, last: int, row: int) -> None:
    """Start a spot with one run of pixels."""
    length = last - first + 1
    spots[spot, _PARENT], spots[spot, _BALL], spots[spot, _AREA] = spot, ball, length
    spots[spot, _SUM_U], spots[spot, _SUM_V] = (first + last) * length // 2, row * length
    spots[spot, _LEFT], spots[spot, _RIGHT], spots[spot, _TOP], spots[spot, _BOTTOM] = first, last, row, row


@compiled("f8[:, ::1](i8[:, ::1], i8, f8)")
def _likely(spots: NDArray[np.int64], count: int, most_px: float) -> Array:
    """Return ball, u, v, area of the whole spots that may be a disc, largest first."""
    likely = np.empty((count, 4))
    kept = 0
    for k in range(count):
        area = spots[k, _AREA]
        width, height = spots[k, _RIGHT] - spots[k, _LEFT] + 1, spots[k, _BOTTOM] - spots[k, _TOP] + 1
        if spots[k, _PARENT] != k or area < MIN_AREA_PX or area > most_px:
            continue
        if area < FILL_MIN * width * height or max(width, height) > ASPECT_MAX * min(width, height) + 1:
            continue
        place = kept
        while place > 0 and likely[place - 1, 3] < area:
            likely[place] = likely[place - 1]
            place -= 1
        likely[place, 0], likely[place, 3] = spots[k, _BALL], area
        likely[place, 1], likely[place, 2] = spots[k, _SUM_U] / area, spots[k, _SUM_V] / area
        kept += 1
    return likely[:kept]


@compiled("i8(Array(i2, 1, 'C', readonly=True))")
def _shift_for(lowest_spread: NDArray[np.int16]) -> int:
    """Return how far a value may be shifted so that what is left is less than any spread of a colour: 2, or 0."""
    for value in range(LEVELS):
        if value >> 2 >= lowest_spread[value]:
            return 0
    return 2


@compiled("void(Array(u1, 1, 'C', readonly=True), i8, u2[::1], u1[::1])", inline=True)
def _line(pixels: NDArray[np.uint8], start: int, undoing: NDArray[np.uint16], line: NDArray[np.uint8]) -> None:
    """Fill in the pixels of a row, the colour of the light undone.

    pixels, line: byte by byte, of the image and of the row, which begins at `start`: of two axes each byte would be
    taken by itself.  undoing: what each byte is multiplied by, in 1 / UNITY; empty for nothing.
    """
    first, unity, most = np.uint64(start), np.uint16(UNITY), np.uint16(LEVELS - 1)
    if len(undoing) == 0:
        for i in range(np.uint64(len(line))):
            line[i] = pixels[first + i]
    else:
        for i in range(np.uint64(len(line))):
            line[i] = min(most, np.uint16(np.uint16(pixels[first + i]) * undoing[i] // unity))


@compiled("u2[::1](i8, i8, i8)")
def _undoing(blue: int, red: int, width: int) -> NDArray[np.uint16]:
    """Return what undoes the colour of the light in a row, see `_line`."""
    if blue == UNITY and red == UNITY:
        return np.empty(0, np.uint16)
    undoing = np.empty((width, 3), np.uint16)
    undoing[:, 0], undoing[:, 1], undoing[:, 2] = np.uint16(blue), np.uint16(UNITY), np.uint16(red)
    return undoing.reshape(3 * width)


@compiled("void(u1[::1], u1[::1])")
def _flag(line: NDArray[np.uint8], flags: NDArray[np.uint8]) -> None:
    """Flag the pixels of a row, byte by byte, that may have a colour.

    The shift is a constant, as `_shift_for` finds it: so the processor takes many pixels at once.
    """
    three = np.uint64(3)
    for i in range(np.uint64(len(line) // 3)):  # unsigned all through: a sign or a wider number would stop that
        at = three * np.uint64(i)
        blue, green, red = line[at], line[at + np.uint64(1)], line[at + np.uint64(2)]
        most = blue if blue > green else green
        most = red if red > most else most
        least = blue if blue < green else green
        least = red if red < least else least
        flags[i] = np.uint8(most - least) > np.uint8(most >> np.uint8(2))


@compiled("i8(u1[:, ::1], i8, Array(i2, 1, 'C', readonly=True), u8[::1], i8[:, ::1])", inline=True)
def _coloured(
    line: NDArray[np.uint8], left: int, lowest_spread: NDArray[np.int16], eights: NDArray[np.uint64],
    pixels: NDArray[np.int64],
) -> int:  # fmt: skip
    """Write column, value, spread and hue of a row's pixels that may have a colour, and return how many they are.

    line: the row's pixels (n, 3) from column `left` on.
    eights: their flags, eight at a time, those beyond the row 0.
    """
    found = 0
    for eight in range(len(eights)):
        if eights[eight] == 0:
            continue
        for i in range(8 * eight, min(len(line), 8 * eight + 8)):
            blue, green, red = line[i, 0], line[i, 1], line[i, 2]
            value = max(blue, green, red)
            spread = value - min(blue, green, red)
            if spread >= lowest_spread[value]:
                pixels[found, 0], pixels[found, 1], pixels[found, 2] = left + i, value, spread
                pixels[found, 3] = _hue(blue, green, red, value, spread)
                found += 1
    return found


@compiled("i8(i8[:, ::1], i8, Array(i2, 2, 'C', readonly=True), Array(b1, 2, 'C', readonly=True), i8, i8,"
          " i8[:, :, :, ::1])", inline=True)  # fmt: skip
def _runs(
    pixels: NDArray[np.int64], found: int, least: NDArray[np.int16], hues: NDArray[np.bool_], ball: int, here: int,
    runs: NDArray[np.int64],
) -> int:  # fmt: skip
    """Write first and last column of each run of pixels of one colour, and return how many they are.

    runs (2, colours, n, 3): of two rows, of which `here` is this one.
    """
    count = 0
    for k in range(found):
        if not hues[ball, pixels[k, 3]] or pixels[k, 2] < least[ball, pixels[k, 1]]:
            continue
        column = pixels[k, 0]
        if count and runs[here, ball, count - 1, 1] == column - 1:
            runs[here, ball, count - 1, 1] = column
        else:
            runs[here, ball, count, 0] = runs[here, ball, count, 1] = column
            count += 1
    return count


@compiled("i8(i8[:, ::1], i8, i8, i8, i8[:, :, :, ::1], i8[:, ::1])", inline=True)
def _link(
    spots: NDArray[np.int64], count: int, ball: int, row: int, runs: NDArray[np.int64], lengths: NDArray[np.int64]
) -> int:
    """Make each run of a row part of the spots that it touches in the row above, or a new one; return their number.

    runs, lengths (2, colours): of the two rows; the third column leads to a run's spot.
    """
    above, here, start = (row - 1) & 1, row & 1, 0
    for k in range(lengths[here, ball]):
        first, last = runs[here, ball, k, 0], runs[here, ball, k, 1]
        _start(spots, count, ball, first, last, row)
        spot = count
        while start < lengths[above, ball] and runs[above, ball, start, 1] < first - 1:
            start += 1
        other = start
        while other < lengths[above, ball] and runs[above, ball, other, 0] <= last + 1:
            spot = _join(spots, spot, runs[above, ball, other, 2])
            other += 1
        runs[here, ball, k, 2] = spot
        count += 1
    return count


@compiled("i8[:, ::1](i8[:, ::1], i8)")
def _enlarged(spots: NDArray[np.int64], needed: int) -> NDArray[np.int64]:
    """Return a copy of the table that holds so many spots, and as many again."""
    larger = np.empty((2 * needed, _COLUMNS), np.int64)
    larger[: len(spots)] = spots
    return larger


@compiled(
    "Tuple((f8[:, ::1], i8))(Array(u1, 3, 'C', readonly=True), Array(f4, 3, 'C'), Array(u1, 2, 'C'), i8, i8, i8, i8,"
    "Array(i2, 2, 'C', readonly=True), Array(i2, 1, 'C', readonly=True), Array(b1, 2, 'C', readonly=True), i8, i8, f8)"
)
def find_spots(
    image: Image,
    room: NDArray[np.float32],
    looks: NDArray[np.uint8],
    left: int,
    top: int,
    right: int,
    bottom: int,
    least_spread: NDArray[np.int16],
    lowest_spread: NDArray[np.int16],
    hues: NDArray[np.bool_],
    blue: int,
    red: int,
    most_px: float,
) -> tuple[Array, int]:
    """Find the spots of each of n colours; pixels that touch by a side or a corner belong together.

    Args:
        image: (height, width, 3) BGR.
        room, looks: what is known to stand behind, see `behind.Room`; what looks like it belongs to no spot.
        left, top, right, bottom: where to look, within the image; right and bottom exclusive.
        least_spread, lowest_spread, hues, blue, red: the colours, as in `tracker.image.colour_table.ColourTable`.
        most_px: larger spots are none [px^2].
    Returns:
        (m, 4): index of the colour, centroid u and v in the whole image [px], area [px^2]; largest first.
        How many pixels of their hues were left out since the room looks like them.
    Source: run-based labelling with union-find (He, Chao, Suzuki, 2008), all colours in one pass.
    """
    colours, width = len(hues), right - left
    spots, count, left_out = np.empty((_FIRST_CAPACITY, _COLUMNS), np.int64), 0, 0
    pixels = np.empty((width, 4), np.int64)
    runs = np.empty((2, colours, width // 2 + 1, 3), np.int64)  # of the row above and of this one
    lengths = np.zeros((2, colours), np.int64)
    shift = _shift_for(lowest_spread) if width >= WIDE_PX else 0
    line, flags = np.empty((width, 3), np.uint8), np.zeros((width + 7) // 8 * 8, np.uint8)
    flags[:width] = 1
    # In the loop no part of an array is named: each would be counted, by an instruction that waits for all others.
    all_bytes, line_bytes, eights = image.reshape(image.size), line.reshape(line.size), flags.view(np.uint64)
    undoing = _undoing(blue, red, width)
    for row in range(top, bottom):
        here = row & 1
        _line(all_bytes, (row * image.shape[1] + left) * 3, undoing, line_bytes)
        if shift:
            _flag(line_bytes, flags)
        found = _coloured(line, left, lowest_spread, eights, pixels)
        if found and looks.size:
            found, alike = without_room(all_bytes, image.shape[1], row, room, looks, hues, pixels, found)
            left_out += alike
        for ball in range(colours):
            lengths[here, ball] = _runs(pixels, found, least_spread, hues, ball, here, runs)
            if lengths[here, ball]:
                if count + lengths[here, ball] > len(spots):
                    spots = _enlarged(spots, count + lengths[here, ball])
                count = _link(spots, count, ball, row, runs, lengths)
    return _likely(spots, count, most_px), left_out

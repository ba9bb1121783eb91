"""How much noise there is round a ball, and how much of it is the room that is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.image.exposure import Weights, block_is_full, brightness_of, is_full
from tracker.maths.compiled import compiled
from tracker.maths.solve import eliminate
from tracker.types import Array, Image

LEAST_NOISE = 1.5  # one sigma of quantisation and compression, grey levels
LUMA_SCALE, BLUE_SCALE, RED_SCALE, RED_BY_BLUE, ROOM_SHARE, SCALES = range(6)
"""What brightness and colour are multiplied by, to be in units of their noise, and how strongly a known room shows."""
UNSURE = 10.0  # pixels' worth of a room that shows as it was learned: what its light does meanwhile is seen in a few


@compiled("UniTuple(f8, 3)(f8, f8, f8)")
def luma_blue_red(b: float, g: float, r: float) -> tuple[float, float, float]:
    """Return luma, blue and red difference (ITU-R BT.601) of a colour."""
    luma = 0.114 * b + 0.587 * g + 0.299 * r
    return luma, 0.5 * b - 0.331264 * g - 0.168736 * r, -0.081312 * b - 0.418688 * g + 0.5 * r


@compiled("UniTuple(f8, 3)(Array(uint8, 3, 'C', True), i8, i8)")
def colour_at(image: Image, column: int, row: int) -> tuple[float, float, float]:
    """Return the luma, blue and red difference of a pixel, in grey levels."""
    return luma_blue_red(image[row, column, 0], image[row, column, 1], image[row, column, 2])


@compiled("UniTuple(f8, 3)(Array(uint8, 3, 'C', True), Array(f4, 3, 'C'), f8, i8, i8, i8)", inline=True)
def _colour_of_block(
    image: Image, room: NDArray[np.float32], share: float, left: int, top: int, block: int
) -> tuple[float, float, float]:
    """Return the mean luma, blue and red difference of a block of pixels less a share of the room's, in grey levels."""
    b = g = r = 0.0
    for v in range(top, top + block):
        for u in range(left, left + block):
            b, g, r = b + image[v, u, 0], g + image[v, u, 1], r + image[v, u, 2]
            if share > 0.0:
                b, g, r = b - share * room[v, u, 0], g - share * room[v, u, 1], r - share * room[v, u, 2]
    per = 1.0 / (block * block)
    return luma_blue_red(per * b, per * g, per * r)


@compiled("void(f8[:, ::1], f8, f8, f8, f8)")
def _add_products(products: Array, x: float, y: float, a: float, b: float) -> None:
    """Add to the lower triangle of the products of 1, x, y, a and b."""
    products[0, 0] += 1.0
    products[1, 0] += x
    products[1, 1] += x * x
    products[2, 0] += y
    products[2, 1] += x * y
    products[2, 2] += y * y
    products[3, 0] += a
    products[3, 1] += a * x
    products[3, 2] += a * y
    products[3, 3] += a * a
    products[4, 0] += b
    products[4, 1] += b * x
    products[4, 2] += b * y
    products[4, 3] += b * a
    products[4, 4] += b * b


@compiled(
    "UniTuple(f8, 2)(Array(uint8, 3, 'C', True), Array(f4, 3, 'C'), b1, i8, i8, i8, i8, f8, f8, f8,"
    "UniTuple(f8, 3), f8[:, ::1])"
)
def _brightness(
    image: Image, room: NDArray[np.float32], known: bool, u: int, v: int, half: int, block: int, du: float, dv: float,
    beyond_px: float, weights: Weights, products: Array,
) -> tuple[float, float]:  # fmt: skip
    """Return the variance of luma about a plane and the room, and how strongly that shows: 0 if it is no help.

    products (5, 5): overwritten.
    Source: least squares on 1, x, y and the room, whose share is 1 unless seen otherwise. A mean of few looks is noise
        in part; least squares then finds a share below 1, which is what takes out most.
    """
    products[:] = 0.0
    for top in range(v - half + ((v - half) % block), v + half - block + 2, block):
        for left in range(u - half + ((u - half) % block), u + half - block + 2, block):
            x, y = left + (block - 1) / 2 - u, top + (block - 1) / 2 - v
            if (x - du) ** 2 + (y - dv) ** 2 <= beyond_px**2:
                continue
            for row in range(top, top + block):
                for column in range(left, left + block):
                    b, g, r = image[row, column, 0], image[row, column, 1], image[row, column, 2]
                    if is_full(weights, b, g, r):
                        continue
                    luma = brightness_of(weights, b, g, r)
                    behind = 0.0
                    if known:
                        b, g, r = room[row, column, 0], room[row, column, 1], room[row, column, 2]
                        behind = brightness_of(weights, b, g, r)
                    _add_products(products, float(column - u), float(row - v), behind, luma)
    eliminate(products, 3)
    freedom, plain = max(products[0, 0] - 3.0, 1.0), max(products[4, 4], 0.0)
    if known:
        own = UNSURE * plain / freedom
        share = (products[4, 3] + own) / (products[3, 3] + own + LEAST_NOISE**2)
        with_room = plain - 2.0 * share * products[4, 3] + share * share * products[3, 3]
        if with_room < plain:
            return max(with_room, 0.0) / freedom, share
    return plain / freedom, 0.0


@compiled(
    "void(Array(uint8, 3, 'C', True), Array(f4, 3, 'C'), b1, i8, i8, i8, i8, f8, f8, f8, UniTuple(f8, 3), f8[::1])"
)
def whitening(
    image: Image, room: NDArray[np.float32], known: bool, u: int, v: int, half: int, block: int, du: float, dv: float,
    beyond_px: float, weights: Weights, scale: Array,
) -> None:  # fmt: skip
    """Find the scales (SCALES,) of luma and of the two colour differences by what varies round a ball.

    That is the variation about a plane and, where it is known, the room, of what is not full. Luma, of the channels'
    weights, varies by pixel, colour by block; colour is made white by Cholesky's factor.
    """
    products = np.empty((5, 5))
    variance, share = _brightness(image, room, known, u, v, half, block, du, dv, beyond_px, weights, products)
    products[:] = 0.0
    for top in range(v - half + ((v - half) % block), v + half - block + 2, block):
        for left in range(u - half + ((u - half) % block), u + half - block + 2, block):
            x, y = left + (block - 1) / 2 - u, top + (block - 1) / 2 - v
            if (x - du) ** 2 + (y - dv) ** 2 <= beyond_px**2:
                continue
            if block_is_full(image, left, top, block):
                continue
            _, blue, red = _colour_of_block(image, room, share, left, top, block)
            _add_products(products, x, y, blue, red)
    eliminate(products, 3)
    least, freedom = LEAST_NOISE**2, max(products[0, 0] - 3.0, 1.0)
    a = np.sqrt(max(products[3, 3], 0.0) / freedom + least / block)
    b_over_a = products[4, 3] / freedom / a
    c = np.sqrt(max(products[4, 4] / freedom + least / block - b_over_a * b_over_a, least / block))
    scale[LUMA_SCALE], scale[BLUE_SCALE], scale[RED_SCALE] = 1.0 / np.sqrt(variance + least), 1.0 / a, 1.0 / c
    scale[RED_BY_BLUE], scale[ROOM_SHARE] = b_over_a / (a * c), share

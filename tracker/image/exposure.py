"""What is too bright for a camera: channels that are full, and how much of a ball they spoil.

A full channel shows less light than there is, and no noise. A bright ball of one colour fills one or two channels
long before the others, which still show all of it: its brightness is taken from those. What is left of full pixels
says that there is at least so much light (`tracker/image/full.py`).
"""

from __future__ import annotations

import math

from tracker.maths.compiled import compiled
from tracker.standing import TOO_BRIGHT
from tracker.types import Image

CLIPPED = 254  # grey level at which a channel is full
Weights = tuple[float, float, float]
"""How much blue, green and red count in brightness; a tuple, since to hand over an array takes eleven numbers."""
LUMA_WEIGHTS: Weights = (0.114, 0.587, 0.299)  # ITU-R BT.601
FULL_SHARE = 0.35  # of a ball's pixels that may be full in a channel that counts: JPEG blurs the others more


@compiled("f8(UniTuple(f8, 3), f8, f8, f8)", inline=True)
def brightness_of(weights: Weights, b: float, g: float, r: float) -> float:
    """Return the brightness of a colour."""
    return weights[0] * b + weights[1] * g + weights[2] * r


@compiled("b1(UniTuple(f8, 3), f8, f8, f8)", inline=True)
def is_full(weights: Weights, b: float, g: float, r: float) -> bool:
    """Say whether a channel of a pixel is full that counts in its brightness."""
    return (
        (b >= CLIPPED and weights[0] > 0.0)
        or (g >= CLIPPED and weights[1] > 0.0)
        or (r >= CLIPPED and weights[2] > 0.0)
    )


@compiled("b1(Array(uint8, 3, 'C', True), i8, i8, i8)", inline=True)
def block_is_full(image: Image, left: int, top: int, block: int) -> bool:
    """Say whether any channel of a square of pixels is full, by which its colour is wrong."""
    for row in range(top, top + block):
        for column in range(left, left + block):
            if max(image[row, column, 0], image[row, column, 1], image[row, column, 2]) >= CLIPPED:
                return True
    return False


@compiled("UniTuple(f8, 4)(Array(uint8, 3, 'C', True), f8, f8, f8)")
def _full_shares(image: Image, u: float, v: float, radius_px: float) -> tuple[float, float, float, float]:
    """Return the shares of a disc's pixels that are full in blue, in green, in red, and in any of them."""
    blue = green = red = anything = count = 0
    height, width = image.shape[0], image.shape[1]
    for row in range(max(0, math.ceil(v - radius_px)), min(height, math.floor(v + radius_px) + 1)):
        for column in range(max(0, math.ceil(u - radius_px)), min(width, math.floor(u + radius_px) + 1)):
            if (column - u) ** 2 + (row - v) ** 2 >= radius_px**2:
                continue
            count += 1
            b, g, r = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            if max(b, g, r) >= CLIPPED:
                blue, green, red, anything = (
                    blue + (b >= CLIPPED),
                    green + (g >= CLIPPED),
                    red + (r >= CLIPPED),
                    anything + 1,
                )
    per = 1.0 / max(1, count)
    return per * blue, per * green, per * red, per * anything


@compiled("UniTuple(f8, 3)(Array(uint8, 3, 'C', True), f8, f8, f8)")
def channel_weights(image: Image, u: float, v: float, radius_px: float) -> Weights:
    """Return how much each channel counts in the brightness of a ball about (u, v): those it fills do not.

    Where it fills all, all count as ever.
    """
    blue, green, red, anything = _full_shares(image, u, v, radius_px)
    if anything <= FULL_SHARE or min(blue, green, red) > FULL_SHARE:
        return LUMA_WEIGHTS
    b = LUMA_WEIGHTS[0] if blue <= FULL_SHARE else 0.0
    g = LUMA_WEIGHTS[1] if green <= FULL_SHARE else 0.0
    r = LUMA_WEIGHTS[2] if red <= FULL_SHARE else 0.0
    total = b + g + r
    return b / total, g / total, r / total


def full_share(image: Image, u: float, v: float, radius_px: float) -> float:
    """Return the share of the pixels of a ball about (u, v) of which a channel is full, 0..1."""
    return _full_shares(image, u, v, radius_px)[3]


def overexposed(image: Image, u: float, v: float, radius_px: float) -> bool:
    """Say whether so much of a ball about (u, v) is too bright for its camera that it teaches nothing of the light.

    Light learned from what is left of such balls was wrong, and moved the centres of all balls by a pixel.
    """
    return full_share(image, u, v, radius_px) > TOO_BRIGHT

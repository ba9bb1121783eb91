"""The pixels round a ball, ready to be fitted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tracker.image.template import MARGIN_PX, STREAK_MAX_PX, Shades, Streak, Template
from tracker.maths.compiled import compiled
from tracker.maths.solve import eliminate
from tracker.types import Array, Image

RING_PX = 1.5  # the background's own variation is measured from this far beyond the ball's edge to the patch's corner
LEAST_NOISE = 1.5  # one sigma of quantisation and compression, grey levels
CLIPPED, CLIPPED_TRUST = 254, 0.1  # grey level at which a channel is full; what it shows is too dark
DARKEST = 0.04  # below this share of white a camera's response is straight
WHITE = 255.0
SUBSAMPLED_PX = 2  # most cameras and JPEG keep colour by blocks of 2 x 2 pixels, which begin at even ones
FULL_DETAIL = 0.75  # above this share of what neighbours of different blocks differ by, colour is kept by the pixel
X, Y, TRUST, LUMA = range(4)
BLUE, RED = 3, 4
PLANE = 3  # terms of the background


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """The pixels round a ball.

    bright (4, n): for each pixel X, Y from the middle pixel [px], TRUST, how far it counts, and LUMA.
    colour (5, n or n / 4): for each pixel or block of 2 x 2 X, Y of its middle, TRUST, BLUE and RED difference.
    LUMA, BLUE and RED are in units of their noise.
    """

    bright: Array
    colour: Array


@dataclass(frozen=True, slots=True)
class Response:
    """How a camera answers to light.

    luma_px, chroma_px: blur of brightness and colour, one sigma of a round kernel, the pixel's box aside [px].
    exposure_s: how long the shutter stands open [s].
    gamma: grey levels are light to the power of 1 / gamma.
    detail: mean square difference in colour of neighbours in one block of 2 x 2 pixels over that across blocks.
    """

    luma_px: float = 0.4
    chroma_px: float = 0.7
    exposure_s: float = 0.004
    gamma: float = 1.0
    detail: float = 0.0

    @property
    def block_px(self) -> int:
        """Return the side of the squares by which colour is kept [px]."""
        return 1 if self.detail > FULL_DETAIL else SUBSAMPLED_PX


@dataclass(frozen=True, slots=True)
class Expected:
    """What is known of a ball before its image is fitted.

    uv_px: centre within about a pixel.  radius_px: from its size and distance.
    speed_px_s: how fast its image moves.  shades: see `template.Shades`.  response: its camera's.
    drawn: templates of its brightness and its colour that serve for it; None for those of its own.
    ray: (x, y, 1) leads to it from the camera; None where uv_px must tell.
    """

    uv_px: tuple[float, float]
    radius_px: float
    speed_px_s: tuple[float, float]
    shades: Shades
    response: Response
    drawn: tuple[Template, Template] | None = None
    ray: tuple[float, float] | None = None

    @property
    def streak_px(self) -> Streak:
        """Return how far its image moves during the exposure [px]."""
        return self.speed_px_s[0] * self.response.exposure_s, self.speed_px_s[1] * self.response.exposure_s


@dataclass(frozen=True, slots=True)
class Extent:
    """Which pixels belong to a ball.

    u, v: the patch's middle pixel.  du, dv: where the ball is expected from there [px].
    edge_px: how far its image reaches from its middle.  half: how far the patch reaches [px].
    """

    u: int
    v: int
    du: float
    dv: float
    edge_px: float
    half: int


def edge_of(radius_px: float, streak_px: Streak) -> float:
    """Return how far a ball's image reaches from its middle [px]."""
    return radius_px + min(math.hypot(*streak_px), STREAK_MAX_PX) / 2.0


def extent_of(ball: Expected) -> Extent:
    """Return which pixels belong to a ball."""
    u, v = round(ball.uv_px[0]), round(ball.uv_px[1])
    edge_px = edge_of(ball.radius_px, ball.streak_px)
    return Extent(u, v, ball.uv_px[0] - u, ball.uv_px[1] - v, edge_px, math.ceil(edge_px + MARGIN_PX))


def fits_in(image: Image, extent: Extent) -> bool:
    """Say whether a ball's patch lies within its image."""
    height, width, half = int(image.shape[0]), int(image.shape[1]), extent.half
    return half <= extent.u < width - half and half <= extent.v < height - half


@lru_cache(maxsize=16)
def light_of(gamma: float) -> Array:
    """Return the light of each grey level (256,), 0..WHITE."""
    return np.asarray(WHITE * (np.arange(256) / WHITE) ** gamma)


@lru_cache(maxsize=16)
def trust_of(gamma: float) -> Array:
    """Return the weight of a pixel of each brightness (256,): 1 / the slope of light by grey level."""
    share = np.maximum(np.arange(256) / WHITE, DARKEST)
    return np.asarray(1.0 / (gamma * share ** (gamma - 1.0)))


@compiled("UniTuple(f8, 3)(Array(uint8, 3, 'C', True), i8, i8, i8)")
def _colour_of_block(image: Image, left: int, top: int, block: int) -> tuple[float, float, float]:
    """Return the mean luma, blue and red difference (ITU-R BT.601) of a block of pixels, in grey levels."""
    b = g = r = 0
    for v in range(top, top + block):
        for u in range(left, left + block):
            b += image[v, u, 0]
            g += image[v, u, 1]
            r += image[v, u, 2]
    share = 1.0 / (block * block)
    luma = share * (0.114 * b + 0.587 * g + 0.299 * r)
    blue = share * (0.5 * b - 0.331264 * g - 0.168736 * r)
    return luma, blue, share * (-0.081312 * b - 0.418688 * g + 0.5 * r)


@compiled("void(f8[:, ::1], f8, f8, f8, f8, i8)")
def _add_products(products: Array, x: float, y: float, a: float, b: float, count: int) -> None:
    """Add to the lower triangle of the products of 1, x, y, a and, with a count of 5, b."""
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
    if count == 5:
        products[4, 0] += b
        products[4, 1] += b * x
        products[4, 2] += b * y
        products[4, 3] += b * a
        products[4, 4] += b * b


@compiled("void(Array(uint8, 3, 'C', True), i8, i8, i8, i8, f8, f8, f8, f8[::1])")
def whitening(
    image: Image, u: int, v: int, half: int, block: int, du: float, dv: float, beyond_px: float, scale: Array
) -> None:
    """Find the scales of luma and of the two colour differences by the background's variation about a plane.

    Luma varies by pixel, colour by block; colour is made white by Cholesky's factor.
    """
    bright, colour = np.zeros((4, 4)), np.zeros((5, 5))  # products of 1, x, y, luma; of 1, x, y, blue, red
    for top in range(v - half + ((v - half) % block), v + half - block + 2, block):
        for left in range(u - half + ((u - half) % block), u + half - block + 2, block):
            x, y = left + (block - 1) / 2 - u, top + (block - 1) / 2 - v
            if (x - du) ** 2 + (y - dv) ** 2 <= beyond_px**2:
                continue
            luma, blue, red = _colour_of_block(image, left, top, block)
            _add_products(colour, x, y, blue, red, 5)
            if block == 1:
                _add_products(bright, x, y, luma, 0.0, 4)
                continue
            for row in range(top, top + block):
                for column in range(left, left + block):
                    luma, _, _ = _colour_of_block(image, column, row, 1)
                    _add_products(bright, float(column - u), float(row - v), luma, 0.0, 4)
    eliminate(bright, 3)
    eliminate(colour, 3)
    least, freedom = LEAST_NOISE**2, max(colour[0, 0] - 3.0, 1.0)
    scale[0] = 1.0 / np.sqrt(max(bright[3, 3], 0.0) / max(bright[0, 0] - 3.0, 1.0) + least)
    a = np.sqrt(max(colour[3, 3], 0.0) / freedom + least / block)
    b_over_a = colour[4, 3] / freedom / a
    c = np.sqrt(max(colour[4, 4] / freedom + least / block - b_over_a * b_over_a, least / block))
    scale[1] = 1.0 / a
    scale[2] = 1.0 / c
    scale[3] = b_over_a / (a * c)


@compiled("Tuple((f8[:, ::1], f8[:, ::1]))(Array(uint8, 3, 'C', True), i8, i8, i8, i8, f8, f8, f8, f8[::1], f8[::1])")
def cut_pixels(
    image: Image,
    u: int,
    v: int,
    half: int,
    block: int,
    du: float,
    dv: float,
    edge_px: float,
    light: Array,
    trust: Array,
) -> tuple[Array, Array]:
    """Cut out and whiten; (u, v) is the middle pixel, (du, dv) the ball's place from there. See `Patch`."""
    pixels = (2 * half + 1) ** 2
    bright, colour, scale, count = np.empty((4, pixels)), np.empty((5, pixels)), np.zeros(4), 0
    share = 1.0 / (block * block)
    whitening(image, u, v, half, block, du, dv, edge_px + RING_PX, scale)
    for top in range(v - half + ((v - half) % block), v + half - block + 2, block):
        for left in range(u - half + ((u - half) % block), u + half - block + 2, block):
            x, y = left + (block - 1) / 2 - u, top + (block - 1) / 2 - v
            if (x - du) ** 2 + (y - dv) ** 2 >= (edge_px + MARGIN_PX) ** 2:
                continue
            mean = blue = red = 0.0
            clipped = False
            for k in range(block * block):
                down = k >> (block - 1)  # of a block of two; of one both are 0
                row, column = top + down, left + k - block * down
                b, g, r = image[row, column, 0], image[row, column, 1], image[row, column, 2]
                lb, lg, lr = light[b], light[g], light[r]
                brightness = 0.114 * b + 0.587 * g + 0.299 * r
                full = max(b, g, r) >= CLIPPED
                clipped = clipped or full
                mean += share * brightness
                blue += share * (0.5 * lb - 0.331264 * lg - 0.168736 * lr)
                red += share * (-0.081312 * lb - 0.418688 * lg + 0.5 * lr)
                i = block * block * count + k
                bright[X, i] = column - u
                bright[Y, i] = row - v
                bright[TRUST, i] = trust[int(brightness + 0.5)] * (CLIPPED_TRUST if full else 1.0)
                bright[LUMA, i] = (0.114 * lb + 0.587 * lg + 0.299 * lr) * scale[0]
            colour[X, count] = x
            colour[Y, count] = y
            colour[TRUST, count] = trust[int(mean + 0.5)] * (CLIPPED_TRUST if clipped else 1.0)
            colour[BLUE, count] = blue * scale[1]
            colour[RED, count] = red * scale[2] - blue * scale[3]
            count += 1
    return np.ascontiguousarray(bright[:, : count * block**2]), np.ascontiguousarray(colour[:, :count])


def cut(image: Image, extent: Extent, response: Response) -> Patch:
    """Cut out the pixels of a ball whose patch lies within its image.

    Light is undone of the camera's gamma, since ball and background mix as light; a pixel's trust falls as gamma
    spreads its noise. Brightness and colour are scaled by what the ring round the ball varies, in grey levels.
    """
    e, light, trust = extent, light_of(response.gamma), trust_of(response.gamma)
    return Patch(*cut_pixels(image, e.u, e.v, e.half, response.block_px, e.du, e.dv, e.edge_px, light, trust))


@compiled("f8(Array(uint8, 3, 'C', True), i8, i8, i8)")
def _detail(image: Image, u: int, v: int, half: int) -> float:
    """Compare neighbours in a row, in the same block of 2 x 2 pixels and in two."""
    squares = np.zeros(2)
    for row in range(v - half, v + half + 1):
        for column in range(u - half, u + half):
            _, blue, red = _colour_of_block(image, column, row, 1)
            _, next_blue, next_red = _colour_of_block(image, column + 1, row, 1)
            squares[column % 2] += (blue - next_blue) ** 2 + (red - next_red) ** 2
    return float(squares[0] / max(squares[1], 1.0))


def detail_of(image: Image, extent: Extent) -> float:
    """Return `Response.detail` as one ball's patch shows it."""
    return _detail(image, extent.u, extent.v, extent.half)

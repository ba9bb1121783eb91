"""The pixels round a ball, ready to be fitted."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tracker.image.behind import KNOWN, NO_ROOM, WELL_KNOWN, Room, is_known
from tracker.image.exposure import CLIPPED, brightness_of, channel_weights, is_full
from tracker.image.template import MARGIN_PX, STREAK_MAX_PX, Shades, Streak, Template
from tracker.image.whiten import (
    BLUE_SCALE,
    LUMA_SCALE,
    RED_BY_BLUE,
    RED_SCALE,
    ROOM_SHARE,
    SCALES,
    colour_at,
    luma_blue_red,
    whitening,
)
from tracker.maths.compiled import compiled
from tracker.types import Array, Image

RING_PX = 1.5  # the background's own variation is measured from this far beyond the ball's edge to the patch's corner
FULL_TRUST = 0.1  # of a full pixel's colour
DARKEST = 0.04  # below this share of white a camera's response is straight
WHITE = 255.0
SUBSAMPLED_PX = 2  # most cameras and JPEG keep colour by blocks of 2 x 2 pixels, which begin at even ones
FULL_DETAIL = 0.75  # above this share of what neighbours of different blocks differ by, colour is kept by the pixel
X, Y, TRUST, LUMA = range(4)
BLUE, RED = 3, 4
PLANE = 3  # terms of the background
NOT_HELD: Array = np.empty((0, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """The pixels round a ball.

    bright (5, n): for each pixel X, Y from the middle pixel [px], TRUST, how far it counts, negative where it is full,
    LUMA, of the channels that the ball does not fill, and LUMA of the room behind, 0 where that is not known.
    colour (7, n or n / 4): for each pixel or block of 2 x 2 X, Y of its middle, TRUST, BLUE and RED difference, and
    both of the room behind.
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
    ray: (x, y, 1) leads to it from the camera; None where uv_px must tell.  room: what is known to stand behind.
    held (any, 3): what holds it, see `holder.EXCESS`.  longer: how oval it is, LONGER_U and LONGER_UV of `outline`.
    """

    uv_px: tuple[float, float]
    radius_px: float
    speed_px_s: tuple[float, float]
    shades: Shades
    response: Response
    drawn: tuple[Template, Template] | None = None
    ray: tuple[float, float] | None = None
    room: Room = NO_ROOM
    held: Array = field(default_factory=lambda: NOT_HELD)
    longer: tuple[float, float] = (0.0, 0.0)

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


def behind_is_known(ball: Expected) -> bool:
    """Say whether all that stands behind a ball's patch has been seen so often without it that it hides nothing."""
    extent = extent_of(ball)
    return is_known(ball.room.looks, extent.u, extent.v, extent.half, WELL_KNOWN)


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


@compiled("i8(i8, i8, i8, i8, f8, f8, f8)")
def _blocks_within(u: int, v: int, half: int, block: int, du: float, dv: float, reach_px: float) -> int:
    """Count the blocks of a patch whose middle is nearer to the ball than that."""
    count = 0
    for top in range(v - half + ((v - half) % block), v + half - block + 2, block):
        for left in range(u - half + ((u - half) % block), u + half - block + 2, block):
            x, y = left + (block - 1) / 2 - u, top + (block - 1) / 2 - v
            count += (x - du) ** 2 + (y - dv) ** 2 < reach_px**2
    return count


@compiled(
    "Tuple((f8[:, ::1], f8[:, ::1]))(Array(uint8, 3, 'C', True), Array(f4, 3, 'C'), Array(u1, 2, 'C'), i8, i8, i8, i8,"
    "f8, f8, f8, f8[::1], f8[::1])"
)
def cut_pixels(
    image: Image, room: NDArray[np.float32], looks: NDArray[np.uint8], u: int, v: int, half: int, block: int,
    du: float, dv: float, edge_px: float, light: Array, trust: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Cut out and whiten; (u, v) is the middle pixel, (du, dv) the ball's place from there. See `Patch`."""
    reach_px, count = edge_px + MARGIN_PX, 0
    blocks = _blocks_within(u, v, half, block, du, dv, reach_px)
    bright, colour, scale = np.empty((5, blocks * block**2)), np.empty((7, blocks)), np.empty(SCALES)
    share, known = 1.0 / (block * block), is_known(looks, u, v, half, KNOWN)
    weights = channel_weights(image, u + du, v + dv, edge_px)
    whitening(image, room, known, u, v, half, block, du, dv, edge_px + RING_PX, weights, scale)
    shows = scale[ROOM_SHARE]
    for top in range(v - half + ((v - half) % block), v + half - block + 2, block):
        for left in range(u - half + ((u - half) % block), u + half - block + 2, block):
            x, y = left + (block - 1) / 2 - u, top + (block - 1) / 2 - v
            if not (x - du) ** 2 + (y - dv) ** 2 < reach_px**2:
                continue
            mean = blue = red = blue_behind = red_behind = 0.0
            clipped = False
            for k in range(block * block):
                down = k >> (block - 1)  # of a block of two; of one both are 0
                row, column = top + down, left + k - block * down
                b, g, r = image[row, column, 0], image[row, column, 1], image[row, column, 2]
                _, by_blue, by_red = luma_blue_red(light[b], light[g], light[r])
                mean += share * (0.114 * b + 0.587 * g + 0.299 * r)
                brightness, full = brightness_of(weights, b, g, r), is_full(weights, b, g, r)
                luma = brightness_of(weights, light[b], light[g], light[r])
                clipped = clipped or max(b, g, r) >= CLIPPED
                blue += share * by_blue
                red += share * by_red
                i = block * block * count + k
                bright[X, i] = column - u
                bright[Y, i] = row - v
                bright[TRUST, i] = trust[int(brightness + 0.5)] * (-1.0 if full else 1.0)
                bright[LUMA, i] = luma * scale[LUMA_SCALE]
                bright[LUMA + 1, i] = 0.0
                if shows > 0.0:
                    b, g, r = room[row, column, 0] + 0.5, room[row, column, 1] + 0.5, room[row, column, 2] + 0.5
                    _, by_blue, by_red = luma_blue_red(light[int(b)], light[int(g)], light[int(r)])
                    luma = brightness_of(weights, light[int(b)], light[int(g)], light[int(r)])
                    blue_behind += share * by_blue
                    red_behind += share * by_red
                    bright[LUMA + 1, i] = shows * luma * scale[LUMA_SCALE]
            colour[X, count] = x
            colour[Y, count] = y
            colour[TRUST, count] = trust[int(mean + 0.5)] * (-FULL_TRUST if clipped else 1.0)
            colour[BLUE, count] = blue * scale[BLUE_SCALE]
            colour[RED, count] = red * scale[RED_SCALE] - blue * scale[RED_BY_BLUE]
            colour[BLUE + 2, count] = shows * blue_behind * scale[BLUE_SCALE]
            colour[RED + 2, count] = shows * (red_behind * scale[RED_SCALE] - blue_behind * scale[RED_BY_BLUE])
            count += 1
    return bright, colour


@compiled("i8(f8[:, ::1])")
def channels_of(pixels: Array) -> int:
    """Return how many channels the brightness or the colour of a patch has."""
    return (len(pixels) - LUMA) // 2


@compiled("void(f8[:, ::1], f8[::1], f8[:, ::1])", inline=True)
def without_room(pixels: Array, bare: Array, seen: Array) -> None:
    """Fill in what is seen in each channel (channels, n), without the known room where the ball leaves it bare (n,)."""
    channels = len(seen)
    for channel in range(channels):
        for i in range(len(bare)):
            seen[channel, i] = pixels[LUMA + channel, i] - bare[i] * pixels[LUMA + channels + channel, i]


def cut(image: Image, extent: Extent, ball: Expected) -> Patch:
    """Cut out the pixels of a ball whose patch lies within its image.

    Light is undone of the camera's gamma, since ball and background mix as light; a pixel's trust falls as gamma
    spreads its noise. Brightness and colour are scaled by what the ring round the ball varies, in grey levels.
    """
    e, block, gamma = extent, ball.response.block_px, ball.response.gamma
    light, trust = light_of(gamma), trust_of(gamma)
    return Patch(*cut_pixels(image, *ball.room, e.u, e.v, e.half, block, e.du, e.dv, e.edge_px, light, trust))


@compiled("f8(Array(uint8, 3, 'C', True), i8, i8, i8)")
def _detail(image: Image, u: int, v: int, half: int) -> float:
    """Compare neighbours in a row, in the same block of 2 x 2 pixels and in two."""
    squares = np.zeros(2)
    for row in range(v - half, v + half + 1):
        for column in range(u - half, u + half):
            _, blue, red = colour_at(image, column, row)
            _, next_blue, next_red = colour_at(image, column + 1, row)
            squares[column % 2] += (blue - next_blue) ** 2 + (red - next_red) ** 2
    return float(squares[0] / max(squares[1], 1.0))


def detail_of(image: Image, extent: Extent) -> float:
    """Return `Response.detail` as one ball's patch shows it."""
    return _detail(image, extent.u, extent.v, extent.half)

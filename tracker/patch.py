"""The pixels round a ball, ready to be fitted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tracker.compiled import compiled
from tracker.solve import eliminate
from tracker.template import MARGIN_PX, STREAK_MAX_PX, Shades, Streak
from tracker.types import Array, Image

RING_PX = 1.5  # the background's own variation is measured from this far beyond the ball's edge to the patch's corner
LEAST_NOISE = 1.5  # one sigma of quantisation and compression, grey levels
DARKEST = 0.04  # below this share of white a camera's response is straight
WHITE = 255.0
X, Y, TRUST, LUMA, CHROMA_B, CHROMA_R = range(6)
"""Rows of a patch: pixels from its middle, how far the pixel counts, and brightness and colour in units of noise."""


@dataclass(frozen=True, slots=True)
class Response:
    """How a camera answers to light.

    luma_px, chroma_px: blur of brightness and colour, one sigma of a round kernel, the pixel's box aside [px].
    exposure_s: how long the shutter stands open [s].
    gamma: grey levels are light to the power of 1 / gamma.
    """

    luma_px: float = 0.4
    chroma_px: float = 0.7
    exposure_s: float = 0.004
    gamma: float = 1.0


@dataclass(frozen=True, slots=True)
class Expected:
    """What is known of a ball before its image is fitted.

    uv_px: centre within about a pixel.  radius_px: from its size and distance.
    speed_px_s: how fast its image moves.  shades: see `template.Shades`.  response: its camera's.
    """

    uv_px: tuple[float, float]
    radius_px: float
    speed_px_s: tuple[float, float]
    shades: Shades
    response: Response

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


def extent_of(ball: Expected) -> Extent:
    """Return which pixels belong to a ball."""
    u, v = round(ball.uv_px[0]), round(ball.uv_px[1])
    edge_px = ball.radius_px + min(math.hypot(*ball.streak_px), STREAK_MAX_PX) / 2.0
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


@compiled("void(Array(uint8, 3, 'C', True), i8, i8, i8, f8, f8, f8, f8[::1])")
def _whitening(image: Image, u: int, v: int, half: int, du: float, dv: float, beyond_px: float, scale: Array) -> None:
    """Find the scales of luma and of the two colour differences by the background's variation about a plane.

    BGR turns into luma, blue and red difference (ITU-R BT.601); colour is made white by Cholesky's factor.
    """
    rows = np.zeros((6, 6))  # of 1, x, y, luma, blue, red: their products' sums
    one = np.empty(6)
    for y in range(-half, half + 1):
        for x in range(-half, half + 1):
            if (x - du) ** 2 + (y - dv) ** 2 <= beyond_px**2:
                continue
            b, g, r = image[v + y, u + x, 0], image[v + y, u + x, 1], image[v + y, u + x, 2]
            one[0], one[1], one[2] = 1.0, x, y
            one[3] = 0.114 * b + 0.587 * g + 0.299 * r
            one[4] = 0.5 * b - 0.331264 * g - 0.168736 * r
            one[5] = -0.081312 * b - 0.418688 * g + 0.5 * r
            for i in range(6):
                for j in range(i + 1):
                    rows[i, j] += one[i] * one[j]
    freedom = max(rows[0, 0] - 3.0, 1.0)
    eliminate(rows, 3)
    least = LEAST_NOISE**2
    a = np.sqrt(max(rows[4, 4], 0.0) / freedom + least)
    b_over_a = rows[5, 4] / freedom / a
    c = np.sqrt(max(rows[5, 5] / freedom + least - b_over_a * b_over_a, least))
    scale[0] = 1.0 / np.sqrt(max(rows[3, 3], 0.0) / freedom + least)
    scale[1] = 1.0 / a
    scale[2] = 1.0 / c
    scale[3] = b_over_a / (a * c)


@compiled("f8[:, ::1](Array(uint8, 3, 'C', True), i8, i8, i8, f8, f8, f8, f8[::1], f8[::1])")
def _cut_pixels(
    image: Image, u: int, v: int, half: int, du: float, dv: float, edge_px: float, light: Array, trust: Array
) -> Array:
    """Cut out and whiten; (u, v) is the middle pixel, (du, dv) the ball's place from there."""
    side = 2 * half + 1
    scale = np.zeros(6)
    _whitening(image, u, v, half, du, dv, edge_px + RING_PX, scale)
    pixels = np.empty((6, side * side))
    count = 0
    for y in range(-half, half + 1):
        for x in range(-half, half + 1):
            if (x - du) ** 2 + (y - dv) ** 2 >= (edge_px + MARGIN_PX) ** 2:
                continue
            b, g, r = image[v + y, u + x, 0], image[v + y, u + x, 1], image[v + y, u + x, 2]
            brightness = 0.114 * b + 0.587 * g + 0.299 * r
            lb, lg, lr = light[b], light[g], light[r]
            luma = 0.114 * lb + 0.587 * lg + 0.299 * lr
            blue = 0.5 * lb - 0.331264 * lg - 0.168736 * lr
            red = -0.081312 * lb - 0.418688 * lg + 0.5 * lr
            pixels[X, count] = x
            pixels[Y, count] = y
            pixels[TRUST, count] = trust[int(brightness + 0.5)]
            pixels[LUMA, count] = luma * scale[0]
            pixels[CHROMA_B, count] = blue * scale[1]
            pixels[CHROMA_R, count] = red * scale[2] - blue * scale[3]
            count += 1
    return pixels[:, :count].copy()


def cut(image: Image, extent: Extent, gamma: float) -> Array:
    """Cut out the pixels of a ball whose patch lies within its image (6, n): see the rows' names.

    Light is undone of the camera's gamma, since ball and background mix as light; a pixel's trust falls as gamma
    spreads its noise. Brightness and colour are scaled by what the ring round the ball varies, in grey levels.
    """
    e = extent
    return _cut_pixels(image, e.u, e.v, e.half, e.du, e.dv, e.edge_px, light_of(gamma), trust_of(gamma))

"""The pixels round a ball, ready to be fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.template import MARGIN_PX, STREAK_MAX_PX, Shades, Streak
from tracker.types import Array, Image

RING_PX = 1.5  # the background's own variation is measured from this far beyond the ball's edge to the patch's corner
LEAST_NOISE = 1.5  # one sigma of quantisation and compression, grey levels
PLANE = 3  # terms of the background
CHANNELS = 3
# BGR -> luma, blue difference, red difference (ITU-R BT.601)
_TO_YCC = np.array([[0.114, 0.587, 0.299], [0.5, -0.331264, -0.168736], [-0.081312, -0.418688, 0.5]]).T


@dataclass(frozen=True, slots=True)
class Blur:
    """How a camera smears.

    luma_px, chroma_px: brightness and colour, one sigma of a round kernel, the pixel's box aside [px].
    exposure_s: how long the shutter stands open [s].
    """

    luma_px: float = 0.4
    chroma_px: float = 0.7
    exposure_s: float = 0.004


@dataclass(frozen=True, slots=True)
class Expected:
    """What is known of a ball before its image is fitted.

    uv_px: centre within about a pixel.  radius_px: from its size and distance.
    speed_px_s: how fast its image moves.  shades: see `template.Shades`.  blur: its camera's.
    """

    uv_px: tuple[float, float]
    radius_px: float
    speed_px_s: tuple[float, float]
    shades: Shades
    blur: Blur

    @property
    def streak_px(self) -> Streak:
        """Return how far its image moves during the exposure [px]."""
        return self.speed_px_s[0] * self.blur.exposure_s, self.speed_px_s[1] * self.blur.exposure_s


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Square patches of k balls, n pixels each.

    half: pixels from the middle to the edge.  middle (k, 2): the middle pixels.  x, y (n,): pixels from there.
    plane (PLANE, n): 1, x, y of the background.  inside (k, n): 1 near the ball, else 0.
    z (k, 2, n, 2): brightness (its second channel is 0) and colour, whitened by the background's own variation.
    """

    half: int
    middle: Array
    x: Array
    y: Array
    plane: Array
    inside: Array
    z: Array


def patch_half(balls: Sequence[Expected]) -> int:
    """Return how far patches must reach from their middle pixel [px]."""
    reach = max(ball.radius_px + min(float(np.hypot(*ball.streak_px)), STREAK_MAX_PX) / 2.0 for ball in balls)
    return int(np.ceil(reach + MARGIN_PX))


def fits_in(image: Image, ball: Expected, half: int) -> bool:
    """Say whether a ball's patch lies within its image."""
    u, v = round(ball.uv_px[0]), round(ball.uv_px[1])
    height, width = int(image.shape[0]), int(image.shape[1])
    return half <= u < width - half and half <= v < height - half


def cut(images: Sequence[Image], balls: Sequence[Expected], half: int) -> Patches:
    """Cut out and whiten the pixels round balls whose patches lie within their images."""
    side = 2 * half + 1
    span = np.arange(-half, half + 1, dtype=np.float64)
    middles = [(round(ball.uv_px[0]), round(ball.uv_px[1])) for ball in balls]
    pixels = np.stack(
        [image[v - half : v + half + 1, u - half : u + half + 1] for image, (u, v) in zip(images, middles, strict=True)]
    )
    ycc = pixels.reshape(len(balls), side * side, 3) @ _TO_YCC
    x, y = np.tile(span, side), np.repeat(span, side)
    middle = np.array(middles, dtype=np.float64)
    offset = np.array([ball.uv_px for ball in balls]) - middle
    distance = np.sqrt((x - offset[:, :1]) ** 2 + (y - offset[:, 1:]) ** 2)
    edge = np.array([[ball.radius_px + float(np.hypot(*ball.streak_px)) / 2.0] for ball in balls])
    plane = np.stack((np.ones_like(x), x / half, y / half))
    variance = _variation(ycc, plane, (distance > edge + RING_PX).astype(np.float64))
    inside = (distance < edge + MARGIN_PX).astype(np.float64)
    return Patches(half, middle, x, y, plane, inside, _whitened(ycc, variance))


def _variation(ycc: Array, plane: Array, ring: Array) -> Array:
    """Return the covariance (k, 3, 3) of the background pixels, 1 in `ring` (k, n), about their own plane."""
    on = ring[:, None, :] * plane
    normal = on @ plane.T + 1e-9 * np.eye(PLANE)
    rest = (ycc - plane.T @ np.linalg.solve(normal, on @ ycc)) * ring[:, :, None]
    freedom = np.maximum(ring.sum(axis=1) - PLANE, 1.0)
    covariance = rest.transpose(0, 2, 1) @ rest / freedom[:, None, None]
    return np.asarray(covariance + LEAST_NOISE**2 * np.eye(CHANNELS))


def _whitened(ycc: Array, variance: Array) -> Array:
    """Return brightness and colour (k, 2, n, 2) in units of their noise; colour by Cholesky's factor, by hand."""
    a = np.sqrt(variance[:, 1, 1])
    b = variance[:, 1, 2] / a
    c = np.sqrt(variance[:, 2, 2] - b * b)
    z = np.zeros((*ycc.shape[:1], 2, ycc.shape[1], 2))
    z[:, 0, :, 0] = ycc[:, :, 0] / np.sqrt(variance[:, 0, 0])[:, None]
    z[:, 1, :, 0] = ycc[:, :, 1] / a[:, None]
    z[:, 1, :, 1] = (ycc[:, :, 2] - b[:, None] * z[:, 1, :, 0]) / c[:, None]
    return z

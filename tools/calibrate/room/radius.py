"""The balls measured by their images, against the radius that the config says of them.

A ball twice as far looks half as large, but no less blurred: over a wave through the room the two come apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tools.calibrate.room.again import Again, again, taught
from tools.calibrate.room.footage import Footage
from tracker.image.appearance import MISFIT_MAX
from tracker.image.centre import Centre, fit_centre, misfit_at
from tracker.image.patch import Expected, cut, extent_of
from tracker.rig import Rig, make_marker, make_rig
from tracker.types import Array, Image

ROUNDS, SETTLED = 4, 0.003  # light and blur are learned anew under each radius, until it changes by so small a share
STEP, STEP_PX2 = 0.03, 0.03  # of the radius, as a share, and of the blur's variance, for slopes
MOST = 0.2  # by which a radius may change in a round
STRETCHES = 10  # by whose scatter one sigma is known
BY_PIXEL, BY_BLOCK = 0.009, 0.018
"""One sigma of what a model of the image errs by, as a share of the radius. Ten drawn rooms whose colour is kept by
the pixel: 0.9 % rms, -1.1 to 1.5. JPEG with colour by blocks and gamma make yellow 1.3 % large, orange 1.7 and green
2.3 % small."""


@dataclass(frozen=True, slots=True)
class Size:
    """The radius of balls. names: theirs.  said_mm: the config's.  found_mm, sigma_mm: measured."""

    names: tuple[str, ...]
    said_mm: float
    found_mm: float
    sigma_mm: float

    @property
    def off_mm(self) -> float:
        """Return by how much it is larger than said."""
        return self.found_mm - self.said_mm


def measured_sizes(footage: Footage, rig: Rig) -> tuple[Size, ...]:
    """Measure the balls' radii.

    Args:
        footage: with the images kept.
        rig: cameras and clocks as found; the marker gives the radii to begin with.
    Source: the sum of squares that an image's fit leaves is a parabola of radius and blur near its least; the sum of
        all images' parabolas has its own least there where the radii and each camera's blur are. One sigma by leaving
        out a stretch of time after the other: Efron, "The jackknife, the bootstrap and other resampling plans" (1982).
    """
    now, shares = rig, np.ones(len(rig.marker))
    for _ in range(ROUNDS):
        N, g, by_block = _parabolas(again(footage, now))
        shares = _least(N.sum(axis=0), g.sum(axis=0))[: len(rig.marker)]
        now = _resized(now, np.clip(shares, -MOST, MOST))
        if np.abs(shares).max() < SETTLED:
            break
    model = BY_BLOCK if by_block else BY_PIXEL
    sigmas = np.hypot(_jackknife(N, g)[: len(rig.marker)], model).tolist()
    return tuple(
        Size((ball.name,), 1e3 * ball.radius_m, 1e3 * found.radius_m, 1e3 * found.radius_m * sigma)
        for ball, found, sigma in zip(rig.marker.balls, now.marker.balls, sigmas, strict=True)
    )


def together(sizes: Sequence[Size]) -> Size:
    """Return what all balls come to: the model errs otherwise for each colour, so their mean is known better."""
    said, found, sigma = (
        float(np.mean(values)) for values in zip(*((s.said_mm, s.found_mm, s.sigma_mm) for s in sizes), strict=True)
    )
    return Size(tuple(name for size in sizes for name in size.names), said, found, sigma / float(np.sqrt(len(sizes))))


def _jackknife(N: Array, g: Array) -> Array:
    """Return one sigma of each unknown by what leaving a stretch out does."""
    kept = [k for k in range(len(N)) if N[k].any()]
    without = np.array([_least(N.sum(axis=0) - N[k], g.sum(axis=0) - g[k]) for k in kept])
    spread = ((without - without.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(np.sqrt((len(kept) - 1) / len(kept) * spread))


def _resized(rig: Rig, shares: Array) -> Rig:
    """Return a rig whose balls are larger by a share each."""
    balls = zip(rig.marker.balls, shares.tolist(), strict=True)
    return make_rig(
        rig.cameras, make_marker(tuple(replace(ball, radius_m=ball.radius_m * (1.0 + share)) for ball, share in balls))
    )


def _parabolas(cameras: Sequence[Again]) -> tuple[Array, Array, bool]:
    """Return the curvature (stretches, n, n) and slope (stretches, n) of the squares left, by radii, then blurs.

    And whether a camera keeps colour by blocks.
    """
    balls = len(cameras[0].rig.marker)
    size = balls + len(cameras)
    N, g, by_block = np.zeros((STRETCHES, size, size)), np.zeros((STRETCHES, size)), False
    for each, rivals in zip(cameras, taught(cameras), strict=True):
        lessons = each.lessons()
        by_block = by_block or rivals.best.response.block_px > 1
        for n, k in enumerate(lessons):
            image, stretch = each.image(k), STRETCHES * n // len(lessons)
            for ball in range(balls):
                found = _parabola(image, each.expected(rivals, k, ball))
                if found is not None:
                    at = [ball, balls + each.camera]
                    N[stretch][np.ix_(at, at)] += found[0]
                    g[stretch][at] += found[1]
    return N, g, by_block


def _parabola(image: Image, ball: Expected) -> tuple[Array, Array] | None:
    """Return the curvature (2, 2) and slope (2,) of the squares that a ball's fit leaves, by radius and blur.

    None where no ball fits.
    """
    found = fit_centre(image, ball)
    if not isinstance(found, Centre) or found.misfit > MISFIT_MAX:
        return None
    extent = extent_of(replace(ball, radius_px=ball.radius_px * (1.0 + STEP)))
    patch = cut(image, extent, ball)
    centre = float(found.uv_px[0]) - extent.u, float(found.uv_px[1]) - extent.v

    def left(radius: float, blur: float) -> float:
        return misfit_at(patch, _other(ball, STEP * radius, STEP_PX2 * blur), centre)

    middle = left(0.0, 0.0)
    larger, smaller, soft, sharp, both, neither = (
        left(*at) for at in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1))
    )
    by_both = 0.5 * (both + neither - larger - smaller - soft - sharp + 2.0 * middle)
    curvature = np.array([[larger + smaller - 2.0 * middle, by_both], [by_both, soft + sharp - 2.0 * middle]])
    slope, unit = 0.5 * np.array([larger - smaller, soft - sharp]), np.array([STEP, STEP_PX2])
    weight = 1.0 / max(found.misfit, 1e-6)
    return weight * curvature / np.outer(unit, unit), weight * slope / unit


def _other(ball: Expected, share: float, more_px2: float) -> Expected:
    """Return a ball larger by a share, and its brightness blurred more."""
    blur_px = float(np.sqrt(max(0.0, ball.response.luma_px**2 + more_px2)))
    response = replace(ball.response, luma_px=blur_px)
    return replace(ball, radius_px=ball.radius_px * (1.0 + share), response=response)


def _least(N: Array, g: Array) -> Array:
    """Return where a parabola is least."""
    return np.asarray(-np.linalg.lstsq(N, g)[0])

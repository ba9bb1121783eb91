"""What one well-fitted ball teaches of the camera's response and the room's light."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tracker.image.centre import Group, misfit_at, numbers_of, slopes_at, templates_of
from tracker.image.patch import LUMA, TRUST, Expected, Patch, Response, X, Y
from tracker.image.reading import CHROMA_VAR, LUMA_VAR, read
from tracker.image.robust import without_strangers
from tracker.image.template import COARSE, GLOSS, TERMS, Vector, draw, every_term, steps_of
from tracker.maths.compiled import compiled
from tracker.maths.solve import cholesky, dot, eliminate, solve
from tracker.types import Array

BLUR_MAX_PX = 1.5
EXPOSURE_TRIAL_S, EXPOSURE_MAX_S = 0.001, 0.02
EXPOSURE_S_PX = 0.008  # step of exposure for one of blur [s/px]
LEAST_STREAK_PX = 0.2  # a trial that moves the ball's ends by less shows nothing
SMEARED_PX = 2.0  # a streak so long hides the blur
RIDGE = 1e-9
PLANE, OTHERS = 3, 6  # of the background; with the centre's two, and the gloss, whose share differs by paint


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One ball's pixels, with what was known of it and where its fit put it.

    patch: trusts those less that fit no ball.
    centre: from the patch's middle pixel [px].
    slopes (2, n): of its brightness, as fitted, by the centre [1/px].
    sharper_luma, sharper_chroma: whether its brightness and its colour would fit better with less blur.
    """

    patch: Patch
    ball: Expected
    centre: tuple[float, float]
    slopes: Array
    sharper_luma: bool
    sharper_chroma: bool


def sample_of(patch: Patch, ball: Expected, centre: tuple[float, float]) -> Sample:
    """Look at a fitted ball again, and past what is in front of it or beside it."""
    numbers, (luma, chroma) = numbers_of(ball), templates_of(ball)
    bright = without_strangers(patch.bright, luma.fine, luma.made, numbers, LUMA_VAR, *centre)
    colour = without_strangers(patch.colour, chroma.fine, chroma.made, numbers, CHROMA_VAR, *centre)
    patch = Patch(bright, colour)
    slopes, by_luma = slopes_at(patch, ball, centre, Group.BRIGHTNESS)
    _, by_chroma = slopes_at(patch, ball, centre, Group.COLOUR)
    return Sample(patch, ball, centre, slopes, by_luma > 0.0, by_chroma > 0.0)


def sharper(sample: Sample, step_px: float) -> Response:
    """Return the camera's response, its blurs and its exposure moved one step to where the ball fits better."""
    ball, now = sample.ball, sample.ball.response
    luma_px, chroma_px, exposure_s = now.luma_px, now.chroma_px, now.exposure_s
    if math.hypot(*ball.speed_px_s) * EXPOSURE_TRIAL_S > LEAST_STREAK_PX:
        shorter = _shorter(sample.patch, ball, sample.centre)
        exposure_s = _stepped(exposure_s, shorter, step_px * EXPOSURE_S_PX, EXPOSURE_MAX_S)
    if math.hypot(*ball.streak_px) < SMEARED_PX:
        luma_px = _stepped(luma_px, sample.sharper_luma, step_px, BLUR_MAX_PX)
        chroma_px = _stepped(chroma_px, sample.sharper_chroma, step_px, BLUR_MAX_PX)
    return Response(luma_px, chroma_px, exposure_s, now.gamma, now.detail)


def _shorter(patch: Patch, ball: Expected, centre: tuple[float, float]) -> bool:
    """Say whether the ball fits better under a shorter exposure than under a longer one."""
    now = ball.response
    shorter, longer = (
        replace(ball, response=replace(now, exposure_s=max(0.0, now.exposure_s + trial_s)))
        for trial_s in (-EXPOSURE_TRIAL_S, EXPOSURE_TRIAL_S)
    )
    return misfit_at(patch, shorter, centre) < misfit_at(patch, longer, centre)


def _stepped(now: float, less: bool, step: float, most: float) -> float:
    return min(most, max(0.0, now + (-step if less else step)))


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])")
def _without_others(pixels: Array, terms: Array, slopes: Array, products: Array) -> None:
    """Fill in the products of terms and brightness (m, m), m = OTHERS + TERMS + 1, without what is each ball's own.

    That is the background, the gloss, and where exactly its centre is: light learned at a centre that the light
    itself has pulled aside would never be put right.
    terms: (TERMS + 1, n), the gloss last.  slopes: (2, n) by the centre.
    The terms' products stand after the OTHERS first rows, the brightness's last, lower triangle.
    """
    n = pixels.shape[1]
    rows, weighted = np.empty((len(products), n)), np.empty(n)
    for i in range(n):
        bare = 1.0 - terms[0, i]
        rows[0, i], rows[1, i], rows[2, i] = bare, bare * pixels[X, i], bare * pixels[Y, i]
    rows[PLANE], rows[PLANE + 1], rows[PLANE + 2] = slopes[0], slopes[1], terms[GLOSS]
    rows[OTHERS:-1], rows[-1] = terms[:GLOSS], pixels[LUMA]
    for j in range(len(rows)):
        for i in range(n):
            weighted[i] = pixels[TRUST, i] ** 2 * rows[j, i]
        for k in range(j + 1):
            products[j, k] = dot(weighted, rows[k])
    eliminate(products, OTHERS)


@compiled("f8(Array(float32, 3, 'C', True), f8[::1], f8[::1], f8[:, ::1], f8, f8, f8[:, ::1], f8[:, ::1], f8[::1])")
def _equations(
    fine: NDArray[np.float32], made: Array, ball: Array, pixels: Array, u: float, v: float, slopes: Array,
    information: Array, target: Array,
) -> float:  # fmt: skip
    """Fill in the normal equations of the terms, see `light_on`, and return the ball's mean brightness."""
    n = pixels.shape[1]
    terms, by = np.empty((TERMS + 1, n)), np.empty((3, TERMS + 1, n))
    read(fine, made, ball, LUMA_VAR, u, v, pixels, terms, by[0], by[1], by[2])
    products = np.empty((OTHERS + TERMS + 1, OTHERS + TERMS + 1))
    _without_others(pixels, terms, slopes, products)
    even, factor = np.empty(4), np.empty((4, 4))
    for i in range(TERMS):
        target[i] = products[-1, OTHERS + i]
        for j in range(i + 1):
            information[i, j] = information[j, i] = products[OTHERS + i, OTHERS + j]
    for i in range(4):
        even[i], factor[i] = target[i], information[i, :4]
        factor[i, i] += RIDGE * information[0, 0]
    cholesky(factor)
    solve(factor, even)
    mean: float = even[0] + 2.0 / 3.0 * even[3]  # z is 2/3 on the mean over a disc
    return mean


def light_on(sample: Sample, lamp: Vector) -> tuple[Array, Array] | None:
    """Return the normal equations of the light's terms on a ball, at mean brightness 1.

    lamp: as seen along the ball's ray.
    Returns:
        information (TERMS, TERMS), target (TERMS,) for `Light.learned`; None for a ball without brightness of its own.
    """
    ball, pixels = sample.ball, sample.patch.bright
    template = draw(*steps_of(ball.radius_px, ball.response.luma_px), 1, COARSE, every_term(lamp))
    information, target, drawn = np.empty((TERMS, TERMS)), np.empty(TERMS), (template.fine, template.made)
    mean = _equations(*drawn, numbers_of(ball), pixels, *sample.centre, sample.slopes, information, target)
    return (information * mean**2, target * mean) if mean > 0.0 else None

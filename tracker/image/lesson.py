"""What one well-fitted ball teaches of the camera's response and the room's light."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tracker.image.at_centre import slopes_at, squares_at
from tracker.image.centre import numbers_of, templates_of
from tracker.image.harmonics import TERMS
from tracker.image.patch import TRUST, Expected, Patch, Response, X, Y, without_room
from tracker.image.reading import CHROMA_VAR, LUMA_VAR, STREAK_U, STREAK_V, read
from tracker.image.robust import without_strangers
from tracker.image.template import COARSE, EVERY_TERM, GLOSS, Template, Vector, draw, mirrored, steps_of
from tracker.maths.compiled import compiled
from tracker.maths.solve import dot, eliminate
from tracker.types import Array

BLUR_MAX_PX = 1.5
EXPOSURE_TRIAL_S, EXPOSURE_MAX_S = 0.001, 0.02
EXPOSURE_S_PX = 0.008  # step of exposure for one of blur [s/px]
LEAST_STREAK_PX = 0.2  # a trial that moves the ball's ends by less shows nothing
SMEARED_PX = 2.0  # a streak so long hides the blur
PLANE, OTHERS = 3, 7  # of the background; with the centre's two, the blur, and the gloss, whose share differs by paint


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One ball's pixels, with what was known of it and where its fit put it.

    patch: trusts those less that fit no ball.
    numbers: see `reading.BALL_SIZE`.  luma: the template of its brightness.
    centre: from the patch's middle pixel [px].
    slopes (3, n): of its brightness, as fitted, by the centre [1/px] and by the blur's variance [1/px^2].
    sharper_luma, sharper_chroma: whether its brightness and its colour would fit better with less blur.
    """

    patch: Patch
    ball: Expected
    numbers: Array
    luma: Template
    centre: tuple[float, float]
    slopes: Array
    sharper_luma: bool
    sharper_chroma: bool


def sample_of(patch: Patch, ball: Expected, centre: tuple[float, float]) -> Sample:
    """Look at a fitted ball again, and past what is in front of it or beside it. The patch is used up."""
    numbers, (luma, chroma) = numbers_of(ball), templates_of(ball)
    slopes = np.empty((3, patch.bright.shape[1]))
    by_luma, by_chroma = _look_again(patch.bright, patch.colour, *luma, *chroma, numbers, *centre, slopes)
    return Sample(patch, ball, numbers, luma, centre, slopes, by_luma > 0.0, by_chroma > 0.0)


@compiled(
    "UniTuple(f8, 2)(f8[:, ::1], f8[:, ::1], Array(f4, 3, 'C', True), f8[::1], Array(f4, 3, 'C', True), f8[::1],"
    "f8[::1], f8, f8, f8[:, ::1])"
)
def _look_again(
    bright: Array, colour: Array, luma: NDArray[np.float32], luma_made: Array, chroma: NDArray[np.float32],
    chroma_made: Array, ball: Array, u: float, v: float, slopes: Array,
) -> tuple[float, float]:  # fmt: skip
    """Trust those pixels less that fit no ball with its centre at (u, v); return what `slopes_at` does of both.

    slopes (3, n): of the brightness, filled in.
    """
    bright[TRUST] = without_strangers(bright, luma, luma_made, ball, LUMA_VAR, u, v)[TRUST]
    colour[TRUST] = without_strangers(colour, chroma, chroma_made, ball, CHROMA_VAR, u, v)[TRUST]
    by_luma = slopes_at(bright, luma, luma_made, ball, LUMA_VAR, u, v, slopes)
    by_chroma = slopes_at(colour, chroma, chroma_made, ball, CHROMA_VAR, u, v, np.empty((3, colour.shape[1])))
    return by_luma, by_chroma


def sharper(sample: Sample, step_px: float) -> Response:
    """Return the camera's response, its blurs and its exposure moved one step to where the ball fits better."""
    ball, now = sample.ball, sample.ball.response
    luma_px, chroma_px, exposure_s = now.luma_px, now.chroma_px, now.exposure_s
    if math.hypot(*ball.speed_px_s) * EXPOSURE_TRIAL_S > LEAST_STREAK_PX:
        exposure_s = _stepped(exposure_s, _shorter(sample), step_px * EXPOSURE_S_PX, EXPOSURE_MAX_S)
    if math.hypot(*ball.streak_px) < SMEARED_PX:
        luma_px = _stepped(luma_px, sample.sharper_luma, step_px, BLUR_MAX_PX)
        chroma_px = _stepped(chroma_px, sample.sharper_chroma, step_px, BLUR_MAX_PX)
    return Response(luma_px, chroma_px, exposure_s, now.gamma, now.detail)


def _shorter(sample: Sample) -> bool:
    """Say whether the ball fits better under a shorter exposure than under a longer one."""
    now_s = sample.ball.response.exposure_s
    return _misfit(sample, max(0.0, now_s - EXPOSURE_TRIAL_S)) < _misfit(sample, now_s + EXPOSURE_TRIAL_S)


def _misfit(sample: Sample, exposure_s: float) -> float:
    """Return the sum of squares that the ball's fit leaves in its brightness under another exposure."""
    numbers, (speed_u, speed_v) = sample.numbers.copy(), sample.ball.speed_px_s
    numbers[STREAK_U], numbers[STREAK_V] = speed_u * exposure_s, speed_v * exposure_s
    return squares_at(sample.patch.bright, *sample.luma, numbers, LUMA_VAR, *sample.centre)


def _stepped(now: float, less: bool, step: float, most: float) -> float:
    return min(most, max(0.0, now + (-step if less else step)))


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])")
def _without_others(pixels: Array, terms: Array, slopes: Array, products: Array) -> None:
    """Fill in the products of terms and brightness (m, m), m = OTHERS + TERMS + 1, without what is each ball's own.

    That is the background, the gloss, and where exactly its centre is: light learned at a centre that the light
    itself has pulled aside would never be put right. Neither is how much it is blurred exactly known: demosaicing and
    JPEG do not blur as a lens does.
    terms: (TERMS + 1, n), the gloss last.  slopes: (3, n) by the centre and by the blur's variance.
    The terms' products stand after the OTHERS first rows, the brightness's last, lower triangle.
    """
    n = pixels.shape[1]
    rows, weighted = np.empty((len(products), n)), np.empty(n)
    for i in range(n):
        bare = 1.0 - terms[0, i]
        rows[0, i], rows[1, i], rows[2, i] = bare, bare * pixels[X, i], bare * pixels[Y, i]
    rows[PLANE : OTHERS - 1], rows[OTHERS - 1] = slopes, terms[GLOSS]
    rows[OTHERS:-1] = terms[:GLOSS]
    without_room(pixels, rows[0], rows[-1:])
    for j in range(len(rows)):
        for i in range(n):
            weighted[i] = pixels[TRUST, i] ** 2 * rows[j, i]
        for k in range(j + 1):
            products[j, k] = dot(weighted, rows[k])
    eliminate(products, OTHERS)


@compiled(
    "void(Array(f4, 3, 'C', True), f8[::1], Array(f4, 3, 'C', True), f8[::1], f8[::1], f8[:, ::1], f8, f8, f8[:, ::1],"
    "f8[:, ::1], f8[::1])"
)
def _equations(
    matt: NDArray[np.float32], matt_made: Array, gloss: NDArray[np.float32], gloss_made: Array, ball: Array,
    pixels: Array, u: float, v: float, slopes: Array, information: Array, target: Array,
) -> None:  # fmt: skip
    """Fill in the normal equations of the terms, see `light_on`."""
    n = pixels.shape[1]
    terms, by = np.empty((TERMS + 1, n)), np.empty((3, TERMS, n))
    read(matt, matt_made, ball, LUMA_VAR, u, v, pixels, terms[:GLOSS], by[0], by[1], by[2])
    read(gloss, gloss_made, ball, LUMA_VAR, u, v, pixels, terms[GLOSS:], by[0], by[1], by[2])
    products = np.empty((OTHERS + TERMS + 1, OTHERS + TERMS + 1))
    _without_others(pixels, terms, slopes, products)
    for i in range(TERMS):
        target[i] = products[-1, OTHERS + i]
        for j in range(i + 1):
            information[i, j] = information[j, i] = products[OTHERS + i, OTHERS + j]


def light_on(sample: Sample, lamp: Vector) -> tuple[Array, Array]:
    """Return the normal equations of the light's terms on a ball, times the brightness of its paint.

    lamp: as seen along the ball's ray.
    Returns:
        information (TERMS, TERMS), target (TERMS,) for `Light.learned`.
    """
    ball, pixels = sample.ball, sample.patch.bright
    steps = steps_of(ball.radius_px, ball.response.luma_px)
    matt, gloss = _matt(*steps), _gloss(*steps, lamp)
    information, target = np.empty((TERMS, TERMS)), np.empty(TERMS)
    _equations(*matt, *gloss, sample.numbers, pixels, *sample.centre, sample.slopes, information, target)
    return information, target


@lru_cache(maxsize=64)
def _matt(radius_steps: int, blur_steps: int) -> Template:
    """Return the matt terms, drawn; what they are asked for by would take long to compare."""
    return draw(radius_steps, blur_steps, 1, COARSE, EVERY_TERM)


@lru_cache(maxsize=256)
def _gloss(radius_steps: int, blur_steps: int, lamp: Vector) -> Template:
    """Return a lamp's mirror image, drawn."""
    return draw(radius_steps, blur_steps, 1, COARSE, mirrored(lamp))

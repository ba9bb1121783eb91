"""A ball as a camera's file keeps it: mixed with the room as light, encoded by gamma, its colour kept by blocks.

JPEG averages colour over blocks after gamma, in grey levels, and leaves brightness by the pixel. Undone of gamma, a
ball's rim then shows neither as it was: a fit in light finds gamma too low and draws centres aside. So here a picture
is made as the file was, and compared in its terms, luma and colour differences (ITU-R BT.601).

The light of channel c is   s P_c m + g h + (1 - a) (k_c0 + k_c1 x + k_c2 y)   (1): a, m and h are the template's
coverage, matt ball and mirrored lamp, P the paint, which all sightings of a ball share. Colours of each sighting's own
would fit better and draw gamma by 0.3: what is common is found wrong beside many unknowns that are not; Neyman, Scott,
"Consistent estimates based on partially consistent observations", Econometrica 16 (1948).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tracker.image.full import LEAST_WEIGHT
from tracker.image.newton import LEAST_MISFIT, TUKEY, draw_at, rows_of, slope_of
from tracker.image.patch import DARKEST, PLANE, WHITE
from tracker.image.reading import LUMA_VAR
from tracker.image.robust import MEDIANS
from tracker.image.whiten import BLUE_SCALE, LUMA_SCALE, RED_BY_BLUE, RED_SCALE, luma_blue_red
from tracker.maths.compiled import compiled
from tracker.maths.solve import cholesky, dot, eliminate, solve
from tracker.types import Array, Image

BRIGHT, GLOSS, PLANES, U, V, OWN = 0, 1, 2, 11, 12, 13
"""Unknowns of one sighting: s, g, nine k, channel by channel, and the centre from the patch's middle pixel [px]."""
GAMMA, BLUR, PAINT, ALL = 13, 14, 15, 18
"""Those that sightings share: gamma, the variance of the blur [px^2], and the paint's three."""
SHARED = ALL - OWN
SHAPES = 3  # of a template whose light is known
TERMS = SHAPES + PLANE
ROUNDS = 4  # the first from a rough guess, without leaving pixels out
MOST_STEP_PX = 0.5
RIDGE = 1e-7
INSIDE, OUTSIDE = 0.99, 0.01  # coverage


@compiled("void(f8[:, ::1], f8, f8[:, ::1], f8[:, ::1])")
def encode(light: Array, gamma: float, levels: Array, slopes: Array) -> None:
    """Fill in the grey levels of light (3, n), 0..WHITE, and their slopes; below DARKEST a camera is straight."""
    dark = WHITE * DARKEST**gamma
    at_dark = WHITE * DARKEST
    steepest = at_dark / (gamma * dark)
    for c in range(light.shape[0]):
        for i in range(light.shape[1]):
            if light[c, i] > dark:
                levels[c, i] = WHITE * (light[c, i] / WHITE) ** (1.0 / gamma)
                slopes[c, i] = levels[c, i] / (gamma * light[c, i])
            else:
                levels[c, i] = at_dark + steepest * (light[c, i] - dark)
                slopes[c, i] = steepest


@compiled("void(f8[::1], i8, f8, f8[::1], f8[::1])")
def average(plane: Array, side: int, smoothing: float, work: Array, blocks: Array) -> None:
    """Fill in the means of a square's blocks of 2 x 2 pixels (side^2,), each with a share of its neighbours.

    smoothing: the share on each of two sides, along both axes.
    """
    width, kept = 2 * side, 1.0 - 2.0 * smoothing
    for row in range(side):
        for column in range(side):
            i = 2 * (row * width + column)
            blocks[row * side + column] = 0.25 * (plane[i] + plane[i + 1] + plane[i + width] + plane[i + width + 1])
    for row in range(side):
        for column in range(side):
            beside = blocks[row * side + max(column - 1, 0)] + blocks[row * side + min(column + 1, side - 1)]
            work[row * side + column] = kept * blocks[row * side + column] + smoothing * beside
    for row in range(side):
        for column in range(side):
            beside = work[max(row - 1, 0) * side + column] + work[min(row + 1, side - 1) * side + column]
            blocks[row * side + column] = kept * work[row * side + column] + smoothing * beside


@compiled("void(f8[:, ::1], i8, f8, f8[::1], f8[::1], f8[::1])")
def shown(channels: Array, side: int, smoothing: float, scale: Array, bright: Array, colour: Array) -> None:
    """Turn grey levels, or their slopes (3, n), into white luma (n,) and colour differences, blue then red (2 blocks,).

    scale (SCALES,): of `whiten.whitening`.
    """
    n, blocks = channels.shape[1], side * side
    blue, red, work = np.empty(n), np.empty(n), np.empty(blocks)
    for i in range(n):
        luma, blue[i], red[i] = luma_blue_red(channels[0, i], channels[1, i], channels[2, i])
        bright[i] = scale[LUMA_SCALE] * luma
    average(blue, side, smoothing, work, colour[:blocks])
    average(red, side, smoothing, work, colour[blocks:])
    for k in range(blocks):
        colour[blocks + k] = scale[RED_SCALE] * colour[blocks + k] - scale[RED_BY_BLUE] * colour[k]
        colour[k] *= scale[BLUE_SCALE]


@compiled("void(f8[::1], f8[::1], f8[:, ::1])")
def coefficients_of(own: Array, paint: Array, coefficients: Array) -> None:
    """Fill in what each channel has of the rows that `draw_at` draws (3, TERMS)."""
    for c in range(3):
        coefficients[c, 0], coefficients[c, 1], coefficients[c, 2] = 0.0, own[BRIGHT] * paint[c], own[GLOSS]
        for j in range(PLANE):
            coefficients[c, SHAPES + j] = own[PLANES + PLANE * c + j]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8, f8[:, :, ::1])")
def differentiate(pixels: Array, drawn: Array, own: Array, paint: Array, gamma: float, channels: Array) -> None:
    """Fill in each channel's slopes by every unknown, and its grey levels last: (ALL + 1, 3, n), empty before.

    drawn: by `newton.draw_at` at the centre that own has.
    """
    n = pixels.shape[1]
    coefficients, light, levels, S = np.empty((3, TERMS)), np.zeros((3, n)), channels[ALL], np.empty((3, n))
    unknown = np.zeros(n)  # room, but for its plane
    coefficients_of(own, paint, coefficients)
    for c in range(3):
        for j in range(TERMS):
            for i in range(n):
                light[c, i] += coefficients[c, j] * drawn[j, i]
    encode(light, gamma, levels, S)
    for c in range(3):
        slope_of(pixels, unknown, drawn[TERMS : TERMS + SHAPES], coefficients[c], channels[U, c])
        slope_of(pixels, unknown, drawn[TERMS + SHAPES : TERMS + 2 * SHAPES], coefficients[c], channels[V, c])
        slope_of(pixels, unknown, drawn[TERMS + 2 * SHAPES :], coefficients[c], channels[BLUR, c])
        for i in range(n):
            channels[BRIGHT, c, i] = S[c, i] * paint[c] * drawn[1, i]
            channels[GLOSS, c, i] = S[c, i] * drawn[2, i]
            channels[PAINT + c, c, i] = S[c, i] * own[BRIGHT] * drawn[1, i]
            channels[U, c, i] *= S[c, i]
            channels[V, c, i] *= S[c, i]
            channels[BLUR, c, i] *= S[c, i]
            share = max(light[c, i] / WHITE, DARKEST**gamma)
            channels[GAMMA, c, i] = -levels[c, i] * math.log(share) / gamma**2
            for j in range(PLANE):
                channels[PLANES + PLANE * c + j, c, i] = S[c, i] * drawn[SHAPES + j, i]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[::1])")
def guess(light: Array, drawn: Array, paint: Array, own: Array) -> None:
    """Fill in about how bright ball and background are, by the light (3, n) well inside the ball and well outside."""
    lit = matt = 0.0
    outside = np.zeros(4)
    for i in range(light.shape[1]):
        if drawn[0, i] > INSIDE:
            for c in range(3):
                lit += light[c, i] * paint[c] * drawn[1, i]
                matt += (paint[c] * drawn[1, i]) ** 2
        elif drawn[0, i] < OUTSIDE:
            outside[3] += 1.0
            for c in range(3):
                outside[c] += light[c, i]
    own[BRIGHT] = lit / matt
    for c in range(3):
        own[PLANES + PLANE * c] = outside[c] / outside[3]


@compiled("f8(f8[::1], f8[::1], i8, b1, f8[::1])")
def believe(rest: Array, trust: Array, parts: int, everything: bool, weight: Array) -> float:
    """Fill in weights (parts n,) by what a fit leaves in n pixels or blocks of so many parts; return its chi2 per part.

    everything: leave no pixel out.  Else by Tukey's biweight, as `tracker.image.robust` does.
    """
    n = len(trust)
    squares = np.zeros(n)
    for k in range(parts * n):
        squares[k % n] += (trust[k % n] * rest[k]) ** 2
    spread = max(LEAST_WEIGHT, np.median(squares[trust > LEAST_WEIGHT]) / MEDIANS[parts - 1])
    total = count = 0.0
    for i in range(n):
        doubt = 1.0 if everything else max(LEAST_WEIGHT, 1.0 - squares[i] / (parts * TUKEY**2 * spread))
        total += doubt**2 * squares[i]
        count += parts * (doubt * min(1.0, trust[i])) ** 2
        for part in range(parts):
            weight[part * n + i] = doubt * trust[i]
    return total / max(1.0, count)


@compiled("UniTuple(f8, 2)(f8[:, :, ::1], f8[::1], f8[::1], f8[::1], f8[::1], i8, f8, f8[::1], b1, i8, f8[:, ::1])")
def normal_equations(
    channels: Array, seen_bright: Array, seen_colour: Array, trust: Array, trust_colour: Array, side: int,
    smoothing: float, scale: Array, everything: bool, count: int, products: Array,
) -> tuple[float, float]:  # fmt: skip
    """Fill in the products of the first slopes and of what is left (count + 1, count + 1), lower triangle.

    Returns chi2 per degree of freedom of brightness and of colour, by which they are weakened.
    """
    n, blocks = channels.shape[2], side * side
    bright, colour = np.empty((count + 1, n)), np.empty((count + 1, 2 * blocks))
    for k in range(count):
        shown(channels[k], side, smoothing, scale, bright[k], colour[k])
    shown(channels[ALL], side, smoothing, scale, bright[count], colour[count])
    bright[count], colour[count] = seen_bright - bright[count], seen_colour - colour[count]
    weight, weight_colour = np.empty(n), np.empty(2 * blocks)
    misfit = believe(bright[count], trust, 1, everything, weight)
    misfit_colour = believe(colour[count], trust_colour, 2, everything, weight_colour)
    weight /= np.sqrt(max(misfit, LEAST_MISFIT))
    weight_colour /= np.sqrt(max(misfit_colour, LEAST_MISFIT))
    for k in range(count + 1):
        for i in range(n):
            bright[k, i] *= weight[i]
        for i in range(2 * blocks):
            colour[k, i] *= weight_colour[i]
        for j in range(k + 1):
            products[k, j] = dot(bright[k], bright[j]) + dot(colour[k], colour[j])
    return misfit, misfit_colour


@compiled("void(f8[:, ::1], i8, f8[:, ::1], f8[::1])")
def step_of(products: Array, rest: int, factor: Array, step: Array) -> None:
    """Solve for a sighting's own unknowns; fill in the Cholesky factor (OWN, OWN) and the step (OWN,)."""
    for j in range(OWN):
        for k in range(j + 1):
            factor[j, k] = products[j, k]
        factor[j, j] = factor[j, j] * (1.0 + RIDGE) + RIDGE
        step[j] = products[rest, j]
    cholesky(factor)
    solve(factor, step)


@compiled(
    "f8(Array(u1, 3, 'C', True), f8[:, ::1], f8[::1], f8[::1], i8, f8[::1], Array(f4, 3, 'C', True), f8[::1], f8[::1],"
    "f8, f8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[:, ::1])"
)
def fit_encoded(
    image: Image, pixels: Array, trust: Array, trust_colour: Array, side: int, scale: Array,
    fine: NDArray[np.float32], made: Array, ball: Array, gamma: float, smoothing: float, paint: Array, light_of: Array,
    own: Array, covariance: Array, shared: Array,
) -> float:  # fmt: skip
    """Fit a ball in a square of an image (2 side, 2 side, 3).

    Args:
        pixels (2, n): x, y from the patch's middle pixel.  trust (n,), trust_colour (blocks,).
        scale (SCALES,): of `whiten.whitening`.
        fine, made: its template of brightness.  ball: `reading.BALL_SIZE`.
        gamma, smoothing, paint (3,): of the camera, see `encoding.Encoding`.  light_of (256,): of each grey level.
        own (OWN,): its centre to begin with; all filled in.
        covariance (2, 2): of the centre, filled in.
        shared: none, or (SHARED + 1, SHARED + 1): lower triangle of the products of what is shared and of what is left,
            without what is the sighting's own, filled in.
    Returns:
        chi2 per degree of freedom of its brightness.
    Source: Gauss-Newton, (1) encoded; the unknowns shared are for `gamma.learned`.
    """
    n, blocks = pixels.shape[1], side * side
    light, seen, channels = np.empty((3, n)), np.empty((3, n)), np.zeros((ALL + 1, 3, n))
    seen_bright, seen_colour = np.empty(n), np.empty(2 * blocks)
    for i in range(n):
        for c in range(3):
            level = image[i // (2 * side), i % (2 * side), c]
            seen[c, i], light[c, i] = level, light_of[level]
    shown(seen, side, 0.0, scale, seen_bright, seen_colour)
    count = ALL if len(shared) else OWN
    drawn, products = np.empty((rows_of(SHAPES), n)), np.empty((count + 1, count + 1))
    factor, step, misfit = np.empty((OWN, OWN)), np.empty(OWN), 0.0
    for k in range(ROUNDS):
        draw_at(pixels, fine, made, ball, LUMA_VAR, own[U], own[V], drawn)
        if k == 0:
            guess(light, drawn, paint, own)
        differentiate(pixels, drawn, own, paint, gamma, channels)
        used = count if k == ROUNDS - 1 else OWN
        misfit, _ = normal_equations(
            channels, seen_bright, seen_colour, trust, trust_colour, side, smoothing, scale, k == 0, used, products
        )
        step_of(products, used, factor, step)
        for j in range(2):
            step[U + j] = min(MOST_STEP_PX, max(-MOST_STEP_PX, step[U + j]))
        own += step
    for j in range(2):
        step[:] = 0.0
        step[U + j] = 1.0
        solve(factor, step)
        covariance[j, 0], covariance[j, 1] = step[U], step[V]
    if len(shared):
        for j in range(OWN):
            products[j, j] = products[j, j] * (1.0 + RIDGE) + RIDGE
        eliminate(products, OWN)
        shared[:] = products[OWN:, OWN:]
    return misfit

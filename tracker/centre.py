"""Sub-pixel centres of balls, by fitting their images.

A pixel near the edge shows part ball, part room. Which part is unknown where the ball is dark and so is the room, so
the whole patch is fitted at once: coverage times a shaded ball, the rest times a sloping background; brightness and
the two colour differences apart, because cameras blur colour more (Bayer filters, JPEG 4:2:0). The linear coefficients
are solved for inside (variable projection), the centre by Gauss-Newton, and pixels that fit no ball (tubes, writing)
lose their weight (Tukey's biweight).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from tracker.compiled import compiled
from tracker.patch import LUMA, TRUST, Expected, Patch, X, Y, cut, extent_of, fits_in
from tracker.solve import cholesky, dot, lower, solve
from tracker.template import places_along, read, template_for
from tracker.types import Array, Image, Reason, frozen_array

PLANE = 3  # terms of the background
TUKEY = 4.685  # of the robust sigma: 95 % efficient where all is well (Huber, Ronchetti, "Robust Statistics", 2009)
LEAST_WEIGHT = 1e-3
ITERATIONS = 5
ROUGH_PX = 0.5
CONVERGED_PX = 0.02  # of the last step; what is left after it is far smaller
MAX_SHIFT_PX = 1.5
RIDGE = 1.0 + 1e-9
COVERED = 0.5  # share of a pixel that makes it the ball's
STRAIN_OUT, STRAIN_IN, STANDS_OUT, _SUMS = 5, 6, 7, 8


class Group(Enum):
    """What is blurred alike."""

    BRIGHTNESS = auto()
    COLOUR = auto()


@dataclass(frozen=True, slots=True, eq=False)
class Centre:
    """A fitted ball.

    uv_px (2,), cov_px (2, 2) [px^2] of the fit alone; misfit: chi2 per degree of freedom.
    strain_in, strain_out: square of the colour that the model leaves on the ball and beside it, all pixels counted
        alike, clipped ones too, as a share of the square by which the ball stands out.
    """

    uv_px: Array
    cov_px: Array
    misfit: float
    strain_in: float = 0.0
    strain_out: float = 0.0


@compiled("void(f8[:, ::1], Array(float32, 3, 'C', True), i8, f8, f8, i8[:, ::1], i8, i8, f8[:, ::1])")
def _draw_at(
    pixels: Array, fine: NDArray[np.float32], per_px: int, drawn_px: float, radius_px: float,
    places: NDArray[np.int64], u_steps: int, v_steps: int, drawn: Array,
) -> None:  # fmt: skip
    """Draw the ball on a patch (..., n) with its centre at (u_steps, v_steps) / per_px.

    Fills in drawn (3p + 3, n): the model, which is the shapes (p) and the background's plane where the ball is not,
    then the shapes' slopes (p) by the centre's u, and by its v.
    """
    p = fine.shape[2]
    value, by_u, by_v = drawn[:p], drawn[p + PLANE : 2 * p + PLANE], drawn[2 * p + PLANE :]
    read(fine, per_px, drawn_px, radius_px, u_steps, v_steps, places, pixels, value, by_u, by_v)
    for i in range(pixels.shape[1]):
        bare = 1.0 - drawn[0, i]
        drawn[p, i] = bare
        drawn[p + 1, i] = bare * pixels[X, i]
        drawn[p + 2, i] = bare * pixels[Y, i]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1])")
def _fit_linear(pixels: Array, model: Array, weight: Array, factor: Array, coefficients: Array) -> None:
    """Solve for the linear coefficients of each channel (channels, m).

    Args:
        model (m, n).  weight (n,): of each pixel.  factor (m, m): Cholesky's, filled in.
    """
    weighted = np.empty(len(weight))
    for j in range(len(model)):
        for i in range(len(weight)):
            weighted[i] = weight[i] * model[j, i]
        for k in range(j + 1):
            factor[j, k] = dot(weighted, model[k])
        factor[j, j] *= RIDGE
        for channel in range(len(coefficients)):
            coefficients[channel, j] = dot(weighted, pixels[LUMA + channel])
    cholesky(factor)
    for channel in range(len(coefficients)):
        solve(factor, coefficients[channel])


@compiled("void(f8[:, ::1], f8[::1], f8[::1])")
def _residual(model: Array, c: Array, rest: Array) -> None:
    """Take the model with coefficients c (m,) off what rest (n,) holds."""
    for j in range(len(model)):
        for i in range(len(rest)):
            rest[i] -= c[j] * model[j, i]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[::1])")
def _slope(pixels: Array, by: Array, c: Array, slope: Array) -> None:
    """Fill in the slope (n,) of the model with coefficients c (m,), from the shapes' slopes (p, n).

    The background's rows are (1 - coverage) (1, x, y); their slopes are minus the coverage's times (1, x, y).
    """
    p = len(by)
    for i in range(len(slope)):
        slope[i] = (c[0] - c[p] - c[p + 1] * pixels[X, i] - c[p + 2] * pixels[Y, i]) * by[0, i]
    for j in range(1, p):
        for i in range(len(slope)):
            slope[i] += c[j] * by[j, i]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], i8, f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def _add_channel(
    pixels: Array,
    model: Array,
    by_u: Array,
    by_v: Array,
    weight: Array,
    channel: int,
    factor: Array,
    c: Array,
    squares: Array,
    normal: Array,
) -> None:
    """Add what one channel says of the centre.

    Args:
        by_u, by_v (p, n): slopes of the shapes.  factor, c (m,): from `_fit_linear`.
        squares (n,): misfit of each pixel, added to.
        normal (8,): information uu, uv, vv and gradient u, v of the centre; squares left beside the ball and on it,
            squares by which the ball stands out; added to.
    """
    m, n = model.shape
    rest, slope_u, slope_v = pixels[LUMA + channel].copy(), np.empty(n), np.empty(n)
    _residual(model, c, rest)
    _slope(pixels, by_u, c, slope_u)
    _slope(pixels, by_v, c, slope_v)
    weighted_u, weighted_v = weight * slope_u, weight * slope_v
    for i in range(n):
        squares[i] += (pixels[TRUST, i] * rest[i]) ** 2
        if model[0, i] > COVERED:
            plane = c[m - 3] + c[m - 2] * pixels[X, i] + c[m - 1] * pixels[Y, i]
            normal[STRAIN_IN] += rest[i] ** 2
            normal[STANDS_OUT] += (pixels[LUMA + channel, i] - plane) ** 2
        else:
            normal[STRAIN_OUT] += rest[i] ** 2
    normal[0] += dot(weighted_u, slope_u)
    normal[1] += dot(weighted_u, slope_v)
    normal[2] += dot(weighted_v, slope_v)
    normal[3] += dot(weighted_u, rest)
    normal[4] += dot(weighted_v, rest)
    # What the linear coefficients can follow says nothing of the centre.
    T_u, T_v = np.empty(m), np.empty(m)
    for j in range(m):
        T_u[j], T_v[j] = dot(weighted_u, model[j]), dot(weighted_v, model[j])
    lower(factor, T_u)
    lower(factor, T_v)
    normal[0] -= dot(T_u, T_u)
    normal[1] -= dot(T_u, T_v)
    normal[2] -= dot(T_v, T_v)


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def _linearise(pixels: Array, drawn: Array, tukey: Array, squares: Array, normal: Array) -> None:
    """Linearise the brightness or the colour of a patch about the centre that a ball was drawn at, see `_draw_at`.

    Fills in squares (n,) and normal (8,) as `_add_channel` does.
    """
    count, p, channels = pixels.shape[1], (len(drawn) - PLANE) // 3, len(pixels) - LUMA
    weight = np.empty(count)
    for i in range(count):
        weight[i] = (tukey[i] * pixels[TRUST, i]) ** 2
    model, by_u, by_v = drawn[: p + PLANE], drawn[p + PLANE : 2 * p + PLANE], drawn[2 * p + PLANE :]
    factor, coefficients = np.empty((p + PLANE, p + PLANE)), np.empty((channels, p + PLANE))
    squares[:] = 0.0
    normal[:] = 0.0
    _fit_linear(pixels, model, weight, factor, coefficients)
    for channel in range(channels):
        c = coefficients[channel]
        _add_channel(pixels, model, by_u, by_v, weight, channel, factor, c, squares, normal)


@compiled("f8(f8[::1], f8[::1], i8, i8, f8[::1])")
def _misfit(squares: Array, tukey: Array, channels: int, shapes: int, normal: Array) -> float:
    """Return chi2 per degree of freedom of brightness or colour, and weaken normal (8,) where it is above 1."""
    freedom, total = -float(channels * (shapes + PLANE)), 0.0
    for i in range(len(squares)):
        freedom += channels * tukey[i] ** 2
        total += squares[i] * tukey[i] ** 2
    misfit = total / max(1.0, freedom)
    normal /= max(1.0, misfit)
    return misfit


@compiled("void(f8[::1], i8, f8[::1])")
def _doubt(squares: Array, channels: int, tukey: Array) -> None:
    """Fill in the weights of Tukey's biweight, square roots."""
    scale = max(1.0, float(np.median(squares)) / channels)
    for i in range(len(squares)):
        tukey[i] = max(LEAST_WEIGHT, 1.0 - squares[i] / channels / (TUKEY**2 * scale))


@compiled("f8[:, ::1](f8[:, ::1], Array(float32, 3, 'C', True), i8, f8, f8, i8[:, ::1], i8, i8)")
def _slopes_at(
    pixels: Array,
    fine: NDArray[np.float32],
    per_px: int,
    drawn_px: float,
    radius_px: float,
    places: NDArray[np.int64],
    u_steps: int,
    v_steps: int,
) -> Array:
    """Return the slopes (2, n) of the brightness, as fitted, by a centre on the grid [1/px]."""
    count, p = pixels.shape[1], fine.shape[2]
    drawn, weight = np.empty((3 * p + PLANE, count)), pixels[TRUST] ** 2
    factor, coefficients = np.empty((p + PLANE, p + PLANE)), np.empty((1, p + PLANE))
    _draw_at(pixels, fine, per_px, drawn_px, radius_px, places, u_steps, v_steps, drawn)
    _fit_linear(pixels, drawn[: p + PLANE], weight, factor, coefficients)
    slopes = np.empty((2, count))
    _slope(pixels, drawn[p + PLANE : 2 * p + PLANE], coefficients[0], slopes[0])
    _slope(pixels, drawn[2 * p + PLANE :], coefficients[0], slopes[1])
    return slopes


@compiled("f8(f8[:, ::1], Array(float32, 3, 'C', True), i8, f8, f8, i8[:, ::1], i8, i8)")
def _squares_at(
    pixels: Array,
    fine: NDArray[np.float32],
    per_px: int,
    drawn_px: float,
    radius_px: float,
    places: NDArray[np.int64],
    u_steps: int,
    v_steps: int,
) -> float:
    """Return the sum of squares left in brightness or colour at a centre on the grid."""
    count, p, channels = pixels.shape[1], fine.shape[2], len(pixels) - LUMA
    drawn, weight = np.empty((3 * p + PLANE, count)), pixels[TRUST] ** 2
    factor, coefficients = np.empty((p + PLANE, p + PLANE)), np.empty((channels, p + PLANE))
    _draw_at(pixels, fine, per_px, drawn_px, radius_px, places, u_steps, v_steps, drawn)
    model = drawn[: p + PLANE]
    _fit_linear(pixels, model, weight, factor, coefficients)
    total = 0.0
    for channel in range(channels):
        rest = pixels[LUMA + channel].copy()
        _residual(model, coefficients[channel], rest)
        total += dot(rest * weight, rest)
    return total


@compiled(
    "void(f8[:, ::1], f8[:, ::1], Array(float32, 3, 'C', True), Array(float32, 3, 'C', True), i8, f8, f8,"
    "i8[:, ::1], f8, f8, f8[::1])"
)
def gauss_newton(
    bright: Array,
    colour: Array,
    luma: NDArray[np.float32],
    chroma: NDArray[np.float32],
    per_px: int,
    drawn_px: float,
    radius_px: float,
    places: NDArray[np.int64],
    u: float,
    v: float,
    fit: Array,
) -> None:
    """Fit from a start (u, v), pixels from the patch's middle.

    Fills in fit (8,): u, v, covariance uu, uv, vv, misfit, and the strains on the ball and beside it.
    """
    limit = 3 * per_px // 2  # a centre further from the middle pixel has run away
    p, n_bright, n_colour = luma.shape[2], bright.shape[1], colour.shape[1]
    drawn_b, drawn_c = np.empty((3 * p + PLANE, n_bright)), np.empty((3 * p + PLANE, n_colour))
    tukey_b, squares_b, normal = np.ones(n_bright), np.empty(n_bright), np.empty(_SUMS)
    tukey_c, squares_c, normal_c = np.ones(n_colour), np.empty(n_colour), np.empty(_SUMS)
    misfit = det = 0.0
    at_u = at_v = limit + 1  # where the ball is drawn: nowhere yet
    for iteration in range(ITERATIONS):
        us, vs = max(-limit, min(limit, round(u * per_px))), max(-limit, min(limit, round(v * per_px)))
        if us != at_u or vs != at_v:
            _draw_at(bright, luma, per_px, drawn_px, radius_px, places, us, vs, drawn_b)
            _draw_at(colour, chroma, per_px, drawn_px, radius_px, places, us, vs, drawn_c)
            at_u, at_v = us, vs
        _linearise(bright, drawn_b, tukey_b, squares_b, normal)
        _linearise(colour, drawn_c, tukey_c, squares_c, normal_c)
        misfit_b = _misfit(squares_b, tukey_b, 1, p, normal)
        misfit_c = _misfit(squares_c, tukey_c, 2, p, normal_c)
        misfit = (misfit_b * n_bright + misfit_c * 2 * n_colour) / (n_bright + 2 * n_colour)
        normal += normal_c
        det = normal[0] * normal[2] - normal[1] * normal[1]
        step_u = (normal[2] * normal[3] - normal[1] * normal[4]) / det
        step_v = (normal[0] * normal[4] - normal[1] * normal[3]) / det
        new_u = us / per_px + min(1.0, max(-1.0, step_u))
        new_v = vs / per_px + min(1.0, max(-1.0, step_v))
        moved = max(abs(new_u - u), abs(new_v - v))
        u, v = new_u, new_v
        if moved < CONVERGED_PX and iteration > 0:
            break
        if moved <= ROUGH_PX:  # weights before that would hold the wrong place fast
            _doubt(squares_b, 1, tukey_b)
            _doubt(squares_c, 2, tukey_c)
    fit[0], fit[1] = u, v
    fit[2], fit[3], fit[4] = normal[2] / det, -normal[1] / det, normal[0] / det
    fit[5] = misfit
    stands_out = max(normal_c[STANDS_OUT], 1e-12)
    fit[6], fit[7] = normal_c[STRAIN_IN] / stands_out, normal_c[STRAIN_OUT] / stands_out


def fit_centre(image: Image, ball: Expected) -> Centre | Reason:
    """Fit the centre of a ball.

    Args:
        image: (height, width, 3) BGR.
        ball: what is known of it.
    Returns:
        Centre; AT_BORDER when its patch leaves the image, NO_BALL when the fit runs away.
    Source: Golub, Pereyra, "Separable nonlinear least squares", Inverse Problems 19 (2003), with Kaufman's
        approximation of the Jacobian; weights: Tukey's biweight.
    """
    extent = extent_of(ball)
    if not fits_in(image, extent):
        return Reason.AT_BORDER
    patch, streak_px, fit = cut(image, extent, ball.response), ball.streak_px, np.empty(8)
    luma = template_for(ball.radius_px, ball.response.luma_px, ball.shades)
    chroma = template_for(ball.radius_px, ball.response.chroma_px, ball.shades, ball.response.block_px)
    n, places = luma.per_px, places_along(streak_px, luma.per_px)
    shapes = luma.fine, chroma.fine, n, luma.radius_px
    gauss_newton(patch.bright, patch.colour, *shapes, ball.radius_px, places, extent.du, extent.dv, fit)
    du, dv, cov_uu, cov_uv, cov_vv, *rest = fit.tolist()
    if not math.hypot(du - extent.du, dv - extent.dv) <= MAX_SHIFT_PX:
        return Reason.NO_BALL
    uv_px = frozen_array((extent.u + du, extent.v + dv))
    return Centre(uv_px, frozen_array(((cov_uu, cov_uv), (cov_uv, cov_vv))), *rest)


def misfit_at(patch: Patch, ball: Expected, centre: tuple[float, float], group: Group) -> float:
    """Return the sum of squares that a ball's fit leaves in its brightness or its colour at a given centre.

    centre: from the patch's middle pixel [px].
    """
    bright = group is Group.BRIGHTNESS
    blur_px, box_px = (ball.response.luma_px, 1) if bright else (ball.response.chroma_px, ball.response.block_px)
    template = template_for(ball.radius_px, blur_px, ball.shades, box_px)
    n, places = template.per_px, places_along(ball.streak_px, template.per_px)
    u, v = (round(c * n) for c in centre)
    pixels = patch.bright if bright else patch.colour
    return _squares_at(pixels, template.fine, n, template.radius_px, ball.radius_px, places, u, v)


def slopes_at(patch: Patch, ball: Expected, centre: tuple[float, float]) -> Array:
    """Return the slopes (2, n) of a ball's brightness, as fitted, by a given centre from the patch's middle [1/px]."""
    template = template_for(ball.radius_px, ball.response.luma_px, ball.shades)
    n, places = template.per_px, places_along(ball.streak_px, template.per_px)
    u, v = (round(c * n) for c in centre)
    drawn = template.fine, n, template.radius_px
    return _slopes_at(patch.bright, *drawn, ball.radius_px, places, u, v)

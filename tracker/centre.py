"""Sub-pixel centres of balls, by fitting their images.

A pixel near the edge shows part ball, part room. Which part is unknown where the ball is dark and so is the room, so
the whole patch is fitted at once: coverage times a shaded ball, the rest times a sloping background; brightness and
the two colour differences apart, because cameras blur colour more (Bayer filters, JPEG 4:2:0). The linear coefficients
are solved for inside (variable projection), the centre by Gauss-Newton, and pixels that fit no ball (tubes, writing)
lose their weight (Tukey's biweight).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.compiled import compiled
from tracker.patch import LUMA, TRUST, Expected, X, Y, cut, fits_in
from tracker.solve import cholesky, lower, solve
from tracker.template import places_along, read, template_for
from tracker.types import Array, Image, Reason, frozen_array

CHANNELS, PLANE = 3, 3  # brightness and two of colour; terms of the background
TUKEY = 4.0
LEAST_WEIGHT = 1e-3
ITERATIONS = 5
ROUGH_PX = 0.5
CONVERGED_PX = 0.02  # of the last step; what is left after it is far smaller
MAX_SHIFT_PX = 1.5
RIDGE = 1.0 + 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Centre:
    """A fitted ball.

    uv_px (2,), cov_px (2, 2) [px^2] of the fit alone; misfit: chi2 per degree of freedom.
    """

    uv_px: Array
    cov_px: Array
    misfit: float


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1])")
def _fill(pixels: Array, value: Array, columns: Array) -> None:
    """Fill in the model's columns (n, p + 3): the shapes (n, p), and the background's plane where the ball is not."""
    p = value.shape[1]
    for i in range(len(pixels)):
        for j in range(p):
            columns[i, j] = value[i, j]
        columns[i, p] = 1.0 - value[i, 0]
        columns[i, p + 1] = columns[i, p] * pixels[i, X]
        columns[i, p + 2] = columns[i, p] * pixels[i, Y]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], i8, i8, f8[:, ::1], f8[:, ::1])")
def _fit_linear(
    pixels: Array, columns: Array, weight: Array, first: int, last: int, factor: Array, coefficients: Array
) -> None:
    """Solve for the linear coefficients of channels first to last - 1 (3, m), which are blurred alike.

    Args:
        columns (n, m): the model's.  weight (n,): of each pixel.  factor (m, m): Cholesky's, filled in.
    """
    m = columns.shape[1]
    factor[:] = 0.0
    coefficients[first:last] = 0.0
    for i in range(len(pixels)):
        for j in range(m):
            weighted = weight[i] * columns[i, j]
            for k in range(j + 1):
                factor[j, k] += weighted * columns[i, k]
            for channel in range(first, last):
                coefficients[channel, j] += weighted * pixels[i, LUMA + channel]
    for j in range(m):
        factor[j, j] *= RIDGE
    cholesky(factor)
    for channel in range(first, last):
        solve(factor, coefficients[channel])


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], i8, f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def _add_channel(
    pixels: Array,
    columns: Array,
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
        by_u, by_v (n, p): slopes of the shapes.  factor, c (m,): from `_fit_linear`.
        squares (n,): misfit of each pixel, added to.
        normal (5,): information uu, uv, vv and gradient u, v of the centre, added to.
    """
    m, p = columns.shape[1], by_u.shape[1]
    T_u, T_v = np.zeros(m), np.zeros(m)
    for i in range(len(pixels)):
        fitted = 0.0
        for j in range(m):
            fitted += columns[i, j] * c[j]
        rest = pixels[i, LUMA + channel] - fitted
        squares[i] += pixels[i, TRUST] ** 2 * rest * rest / CHANNELS
        # The plane's columns are (1 - coverage) (1, x, y); their slopes are minus the coverage's.
        uncovered = c[p] + pixels[i, X] * c[p + 1] + pixels[i, Y] * c[p + 2]
        slope_u, slope_v = -by_u[i, 0] * uncovered, -by_v[i, 0] * uncovered
        for j in range(p):
            slope_u += by_u[i, j] * c[j]
            slope_v += by_v[i, j] * c[j]
        weighted_u, weighted_v = weight[i] * slope_u, weight[i] * slope_v
        normal[0] += weighted_u * slope_u
        normal[1] += weighted_u * slope_v
        normal[2] += weighted_v * slope_v
        normal[3] += weighted_u * rest
        normal[4] += weighted_v * rest
        for j in range(m):
            T_u[j] += weighted_u * columns[i, j]
            T_v[j] += weighted_v * columns[i, j]
    # What the linear coefficients can follow says nothing of the centre.
    lower(factor, T_u)
    lower(factor, T_v)
    for j in range(m):
        normal[0] -= T_u[j] * T_u[j]
        normal[1] -= T_u[j] * T_v[j]
        normal[2] -= T_v[j] * T_v[j]


@compiled(
    "void(f8[:, ::1], Array(float32, 3, 'C', True), Array(float32, 3, 'C', True), i8, i8, f8, f8, i8[:, ::1],"
    "i8, i8, f8[::1], f8[::1], f8[::1])"
)
def _linearise(
    pixels: Array,
    luma: NDArray[np.float32],
    chroma: NDArray[np.float32],
    per_px: int,
    reach: int,
    drawn_px: float,
    radius_px: float,
    places: NDArray[np.int64],
    u_steps: int,
    v_steps: int,
    tukey: Array,
    squares: Array,
    normal: Array,
) -> None:
    """Linearise about a centre at (u_steps, v_steps) / per_px; fill in squares and normal as `_add_channel` does."""
    count, p = len(pixels), luma.shape[2]
    weight = (tukey * pixels[:, TRUST]) ** 2
    columns = np.empty((count, p + PLANE))
    value, by_u, by_v = np.empty((count, p)), np.empty((count, p)), np.empty((count, p))
    factor, coefficients = np.empty((p + PLANE, p + PLANE)), np.empty((CHANNELS, p + PLANE))
    squares[:] = 0.0
    normal[:] = 0.0
    for first, last, fine in ((0, 1, luma), (1, CHANNELS, chroma)):
        read(fine, per_px, reach, drawn_px, radius_px, u_steps, v_steps, places, pixels, value, by_u, by_v)
        _fill(pixels, value, columns)
        _fit_linear(pixels, columns, weight, first, last, factor, coefficients)
        for channel in range(first, last):
            c = coefficients[channel]
            _add_channel(pixels, columns, by_u, by_v, weight, channel, factor, c, squares, normal)


@compiled("f8(f8[:, ::1], Array(float32, 3, 'C', True), i8, i8, f8, f8, i8[:, ::1], i8, i8, i8)")
def _misfit(
    pixels: Array,
    fine: NDArray[np.float32],
    per_px: int,
    reach: int,
    drawn_px: float,
    radius_px: float,
    places: NDArray[np.int64],
    u_steps: int,
    v_steps: int,
    group: int,
) -> float:
    """Return the sum of squares left in brightness (group 0) or colour (1) at a centre on the grid."""
    count, p = len(pixels), fine.shape[2]
    first, last = (0, 1) if group == 0 else (1, CHANNELS)
    value, by_u, by_v = np.empty((count, p)), np.empty((count, p)), np.empty((count, p))
    columns, weight = np.empty((count, p + PLANE)), pixels[:, TRUST] ** 2
    factor, coefficients = np.empty((p + PLANE, p + PLANE)), np.empty((CHANNELS, p + PLANE))
    read(fine, per_px, reach, drawn_px, radius_px, u_steps, v_steps, places, pixels, value, by_u, by_v)
    _fill(pixels, value, columns)
    _fit_linear(pixels, columns, weight, first, last, factor, coefficients)
    total = 0.0
    for i in range(count):
        for channel in range(first, last):
            rest = pixels[i, LUMA + channel]
            for j in range(p + PLANE):
                rest -= columns[i, j] * coefficients[channel, j]
            total += weight[i] * rest * rest
    return total


@compiled(
    "void(f8[:, ::1], Array(float32, 3, 'C', True), Array(float32, 3, 'C', True), i8, i8, f8, f8, i8[:, ::1],"
    "f8, f8, f8[::1])"
)
def _gauss_newton(
    pixels: Array,
    luma: NDArray[np.float32],
    chroma: NDArray[np.float32],
    per_px: int,
    reach: int,
    drawn_px: float,
    radius_px: float,
    places: NDArray[np.int64],
    u: float,
    v: float,
    fit: Array,
) -> None:
    """Fit from a start (u, v), pixels from the patch's middle; fill in u, v, covariance uu, uv, vv and misfit."""
    limit = 3 * per_px // 2  # a centre further from the middle pixel has run away
    count = len(pixels)
    tukey, squares, normal = np.ones(count), np.empty(count), np.empty(5)
    freedom = misfit = det = 0.0
    for iteration in range(ITERATIONS):
        u_steps = max(-limit, min(limit, round(u * per_px)))
        v_steps = max(-limit, min(limit, round(v * per_px)))
        _linearise(
            pixels, luma, chroma, per_px, reach, drawn_px, radius_px, places, u_steps, v_steps, tukey, squares, normal
        )
        det = normal[0] * normal[2] - normal[1] * normal[1]
        step_u = (normal[2] * normal[3] - normal[1] * normal[4]) / det
        step_v = (normal[0] * normal[4] - normal[1] * normal[3]) / det
        new_u = u_steps / per_px + min(1.0, max(-1.0, step_u))
        new_v = v_steps / per_px + min(1.0, max(-1.0, step_v))
        moved = max(abs(new_u - u), abs(new_v - v))
        u, v = new_u, new_v
        freedom = -CHANNELS * (luma.shape[2] + PLANE) - 2.0
        misfit = 0.0
        for i in range(count):
            freedom += CHANNELS * tukey[i] ** 2
            misfit += CHANNELS * squares[i] * tukey[i] ** 2
        if moved < CONVERGED_PX and iteration > 0:
            break
        if moved > ROUGH_PX:
            continue  # weights now would hold the wrong place fast
        scale = max(1.0, float(np.median(squares)))
        for i in range(count):
            tukey[i] = max(LEAST_WEIGHT, 1.0 - squares[i] / (TUKEY**2 * scale))
    misfit /= max(1.0, freedom)
    excess = max(1.0, misfit) / det
    fit[0], fit[1] = u, v
    fit[2], fit[3], fit[4] = normal[2] * excess, -normal[1] * excess, normal[0] * excess
    fit[5] = misfit


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
    if not fits_in(image, ball):
        return Reason.AT_BORDER
    pixels = cut(image, ball)
    luma = template_for(ball.radius_px, ball.response.luma_px, ball.shades, ball.half, ball.streak_px)
    chroma = template_for(ball.radius_px, ball.response.chroma_px, ball.shades, ball.half, ball.streak_px)
    (u, v), places = ball.middle, places_along(ball.streak_px, luma.per_px)
    fit = np.empty(6)
    start = ball.uv_px[0] - u, ball.uv_px[1] - v
    _gauss_newton(
        pixels, luma.fine, chroma.fine, luma.per_px, luma.reach, luma.radius_px, ball.radius_px, places, *start, fit
    )
    du, dv, cov_uu, cov_uv, cov_vv, misfit = fit.tolist()
    if not (du - start[0]) ** 2 + (dv - start[1]) ** 2 <= MAX_SHIFT_PX**2:
        return Reason.NO_BALL
    return Centre(frozen_array((u + du, v + dv)), frozen_array(((cov_uu, cov_uv), (cov_uv, cov_vv))), misfit)


def misfit_at(pixels: Array, ball: Expected, centre: tuple[float, float], group: int) -> float:
    """Return the sum of squares that a ball's fit leaves at a given centre.

    Args:
        pixels: the ball's patch.
        centre: from the patch's middle pixel [px].
        group: 0 of brightness, 1 of colour.
    """
    blur_px = ball.response.chroma_px if group else ball.response.luma_px
    template = template_for(ball.radius_px, blur_px, ball.shades, ball.half, ball.streak_px)
    n, places = template.per_px, places_along(ball.streak_px, template.per_px)
    u, v = (round(c * n) for c in centre)
    return _misfit(pixels, template.fine, n, template.reach, template.radius_px, ball.radius_px, places, u, v, group)

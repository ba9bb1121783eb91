"""The fit of one ball's image, compiled: linear coefficients solved for inside, the centre by Gauss-Newton."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.image.doubt import NORMAL, OCTANTS, add_octants, disagreement, doubted_covariance
from tracker.image.evidence import explained
from tracker.image.full import FULL_WEIGHT, LEAST_WEIGHT, free_full, weigh_full
from tracker.image.hiding import SHOWN, measure_shown
from tracker.image.patch import LUMA, PLANE, TRUST, X, Y, channels_of, without_room
from tracker.image.reading import CHROMA_VAR, LUMA_VAR, read
from tracker.maths.compiled import compiled
from tracker.maths.solve import TINY, cholesky, dot, lower, solve
from tracker.types import Array

TUKEY = 4.685  # of the robust sigma: 95 % efficient where all is well (Huber, Ronchetti, "Robust Statistics", 2009)
LEAST_MISFIT = 0.4  # a fit is surer where less noise is seen than was allowed for, as far as this
ITERATIONS = 5
LATTICE = 8  # places per pixel where a ball is linearised
FARTHEST_PX = 1.5  # a centre further from the middle pixel has run away
ROUGH_PX = 0.5
CONVERGED_PX = 0.02  # of the last step; what is left after it is far smaller
RIDGE = 1.0 + 1e-9
EVIDENCE, SHARES, FIT_SIZE = 6, 7, 7 + SHOWN  # of what `gauss_newton` fills in


@compiled("i8(i8)")
def rows_of(shapes: int) -> int:
    """Return the rows that `draw_at` fills: the model, and of each shape its slopes by u, by v and by variance."""
    return 4 * shapes + PLANE


@compiled("void(f8[:, ::1], Array(float32, 3, 'C', True), f8[::1], f8[::1], i8, f8, f8, f8[:, ::1])")
def draw_at(
    pixels: Array, fine: NDArray[np.float32], made: Array, ball: Array, variance: int, u: float, v: float, drawn: Array
) -> None:
    """Draw a ball on a patch (..., n) with its centre at (u, v); arguments as for `reading.read`.

    Fills in drawn (4p + 3, n): the model, which is the shapes (p) and the background's plane where the ball is not,
    then the shapes' slopes (p) by the centre's u, by its v, and by the blur's variance.
    """
    p = fine.shape[2]
    m = p + PLANE
    by_u, by_v, by_variance = drawn[m : m + p], drawn[m + p : m + 2 * p], drawn[m + 2 * p :]
    read(fine, made, ball, variance, u, v, pixels, drawn[:p], by_u, by_v, by_variance)
    for i in range(pixels.shape[1]):
        bare = 1.0 - drawn[0, i]
        drawn[p, i] = bare
        drawn[p + 1, i] = bare * pixels[X, i]
        drawn[p + 2, i] = bare * pixels[Y, i]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])", inline=True)
def fit_linear(seen: Array, model: Array, weight: Array, weighted: Array, factor: Array, coefficients: Array) -> None:
    """Solve for the linear coefficients of each channel (channels, m).

    Args:
        seen (channels, n): see `without_room`.  model (m, n).
        weight (n,): of each pixel.  weighted (m, n): the model with them, filled in.
        factor (m, m): Cholesky's, filled in.
    """
    for j in range(len(model)):
        for i in range(len(weight)):
            weighted[j, i] = weight[i] * model[j, i]
        for k in range(j + 1):
            factor[j, k] = dot(weighted[j], model[k])
        factor[j, j] *= RIDGE
        for channel in range(len(coefficients)):
            coefficients[channel, j] = dot(weighted[j], seen[channel])
    cholesky(factor)
    for channel in range(len(coefficients)):
        solve(factor, coefficients[channel])


@compiled("void(f8[:, ::1], f8[::1], f8[::1], f8[::1])", inline=True)
def residual(model: Array, c: Array, seen: Array, rest: Array) -> None:
    """Fill in what the model with coefficients c (m,) leaves of what was seen (n,)."""
    for i in range(len(rest)):
        rest[i] = seen[i]
    for j in range(len(model)):
        for i in range(len(rest)):
            rest[i] -= c[j] * model[j, i]


@compiled("void(f8[:, ::1], f8[::1], f8[:, ::1], f8[::1], f8[::1])", inline=True)
def slope_of(pixels: Array, room: Array, by: Array, c: Array, slope: Array) -> None:
    """Fill in the slope (n,) of one channel's model with coefficients c (m,), from the shapes' slopes (p, n).

    The background's rows are (1 - coverage) (1, x, y), as the known room's (n,) is; their slopes are minus the
    coverage's.
    """
    p = len(by)
    for i in range(len(slope)):
        slope[i] = (c[0] - c[p] - c[p + 1] * pixels[X, i] - c[p + 2] * pixels[Y, i] - room[i]) * by[0, i]
    for j in range(1, p):
        for i in range(len(slope)):
            slope[i] += c[j] * by[j, i]


@compiled(
    "void(f8[:, ::1], f8[::1], f8[:, ::1], f8[::1], f8[:, ::1], i8, f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1],"
    "f8[::1], f8[::1])",
    inline=True,
)
def _add_channel(
    pixels: Array, seen: Array, drawn: Array, weight: Array, weighted: Array, channel: int, factor: Array, c: Array,
    rows: Array, T: Array, squares: Array, normal: Array,
) -> None:  # fmt: skip
    """Add what one channel says of the centre.

    Args:
        seen (n,): in this channel, without the known room.  drawn: by `draw_at`.
        weighted, factor, c (m,): from `fit_linear`.
        rows (3, n), T (2, m): overwritten.
        squares (n,): misfit of each pixel, added to.
        normal (5,): information uu, uv, vv and gradient u, v of the centre, added to.
    """
    m, rest, slope_u, slope_v = len(c), rows[0], rows[1], rows[2]
    p = m - PLANE
    residual(drawn[:m], c, seen, rest)
    room = pixels[LUMA + channels_of(pixels) + channel]
    slope_of(pixels, room, drawn[m : m + p], c, slope_u)
    slope_of(pixels, room, drawn[m + p : m + 2 * p], c, slope_v)
    if channels_of(pixels) == 1:
        free_full(pixels, rows)
    uu = uv = vv = ur = vr = 0.0
    for i in range(len(weight)):
        u, v = weight[i] * slope_u[i], weight[i] * slope_v[i]
        uu += u * slope_u[i]
        uv += u * slope_v[i]
        vv += v * slope_v[i]
        ur += u * rest[i]
        vr += v * rest[i]
        squares[i] += (pixels[TRUST, i] * rest[i]) ** 2
    # What the linear coefficients can follow says nothing of the centre.
    for j in range(m):
        T[0, j], T[1, j] = dot(weighted[j], slope_u), dot(weighted[j], slope_v)
    lower(factor, T[0])
    lower(factor, T[1])
    normal[0] += uu - dot(T[0], T[0])
    normal[1] += uv - dot(T[0], T[1])
    normal[2] += vv - dot(T[1], T[1])
    normal[3] += ur
    normal[4] += vr


@compiled("i8(i8, i8)")
def _rows_of_sheet(shapes: int, channels: int) -> int:
    """Return the rows that `_laid_out` divides."""
    return rows_of(shapes) + shapes + PLANE + 4 * channels + 3


@compiled("Tuple((f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[::1]))(f8[:, ::1], i8, i8)")
def _laid_out(sheet: Array, shapes: int, channels: int) -> tuple[Array, Array, Array, Array, Array]:
    """Divide a sheet (rows, n) for the fit of a brightness or a colour: to ask for memory takes as long as to solve.

    Returns what is drawn (4p + 3, n), see `draw_at`; work (m + 1 + 3 channels, n), see `_linearise`; what is seen
    (channels, n); Tukey's weights and the squares left (n,).
    """
    work, seen = rows_of(shapes), rows_of(shapes) + shapes + PLANE + 1 + 3 * channels
    tukey, squares = seen + channels, seen + channels + 1
    return sheet[:work], sheet[work:seen], sheet[seen:tukey], sheet[tukey], sheet[squares]


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[::1])", inline=True)
def _linearise(
    pixels: Array, drawn: Array, tukey: Array, work: Array, seen: Array, small: Array, squares: Array, normal: Array
) -> None:
    """Linearise the brightness or the colour of a patch about the centre that a ball was drawn at, see `draw_at`.

    work (m + 1 + 3 channels, n): overwritten, its last rows by what each channel leaves and its slopes by u and by v.
    seen (channels, n), small (m + channels + 2, m): overwritten.
    Fills in squares (n,) and normal (5,) as `_add_channel` does.
    """
    channels, m = len(seen), small.shape[1]
    weight = work[m]
    for i in range(len(weight)):
        weight[i] = (tukey[i] * pixels[TRUST, i]) ** 2
    factor, coefficients, T = small[:m], small[m : m + channels], small[m + channels :]
    squares[:] = 0.0
    normal[:] = 0.0
    without_room(pixels, drawn[m - PLANE], seen)
    fit_linear(seen, drawn[:m], weight, work[:m], factor, coefficients)
    for channel in range(channels):
        c = coefficients[channel]
        rows = work[m + 1 + 3 * channel : m + 4 + 3 * channel]
        _add_channel(pixels, seen[channel], drawn, weight, work[:m], channel, factor, c, rows, T, squares, normal)


@compiled("UniTuple(f8, 2)(f8[:, ::1], f8[::1], f8[::1], i8, i8, f8[::1])")
def _misfit(
    pixels: Array, squares: Array, tukey: Array, channels: int, shapes: int, normal: Array
) -> tuple[float, float]:  # fmt: skip
    """Return chi2 per degree of freedom of brightness or colour, and the noise that normal (5,) is weakened for.

    That is no less than 1, unless all pixels leave less, those too that the fit did not believe. Full pixels show no
    noise; where hardly any others are, nothing tells it, and 1 is taken.
    """
    least = -float(channels * (shapes + PLANE))
    freedom, total, count, everything = least, 0.0, least, 0.0
    for i in range(len(squares)):
        if pixels[TRUST, i] < 0.0:
            continue
        freedom += channels * tukey[i] ** 2
        total += squares[i] * tukey[i] ** 2
        count += channels
        everything += squares[i]
    misfit = total / freedom if freedom >= 1.0 else 1.0
    noise = max(misfit, min(1.0, max(LEAST_MISFIT, everything / max(1.0, count))))
    normal /= noise
    return misfit, noise


@compiled("f8(f8[::1], i8)")
def _scale(squares: Array, channels: int) -> float:
    """Return the median of the squares by channel, or 1 when it is less: mostly it is, and counting shows that."""
    small = 0
    for i in range(len(squares)):
        small += squares[i] <= channels
    return 1.0 if 2 * small > len(squares) else max(1.0, float(np.median(squares)) / channels)


@compiled("void(f8[::1], i8, f8[::1])")
def _doubt(squares: Array, channels: int, tukey: Array) -> None:
    """Fill in the weights of Tukey's biweight, square roots."""
    per = 1.0 / (channels * TUKEY**2 * _scale(squares, channels))
    for i in range(len(squares)):
        tukey[i] = max(LEAST_WEIGHT, 1.0 - squares[i] * per)


@compiled("f8(f8)")
def on_lattice(at: float) -> float:
    """Return the nearest place where balls are linearised, as far from the middle pixel as one may be."""
    return max(-FARTHEST_PX, min(FARTHEST_PX, round(at * LATTICE) / LATTICE))


@compiled(
    "void(f8[:, ::1], f8[:, ::1], Array(float32, 3, 'C', True), f8[::1], Array(float32, 3, 'C', True), f8[::1],"
    "f8[::1], f8, f8, f8[::1])"
)
def gauss_newton(
    bright: Array, colour: Array, luma: NDArray[np.float32], luma_made: Array, chroma: NDArray[np.float32],
    chroma_made: Array, ball: Array, u: float, v: float, fit: Array,
) -> None:  # fmt: skip
    """Fit from a start (u, v), pixels from the patch's middle.

    Fills in u, v, covariance uu, uv, vv, misfit, the evidence that a ball is there at all: by how much chi2 is less
    than without one; and from SHARES on how much of it is there, see `hiding.SHOWN`.
    """
    p, n_bright, n_colour = luma.shape[2], bright.shape[1], colour.shape[1]
    drawn_b, work_b, seen_b, tukey_b, squares_b = _laid_out(np.empty((_rows_of_sheet(p, 1), n_bright)), p, 1)
    drawn_c, work_c, seen_c, tukey_c, squares_c = _laid_out(np.empty((_rows_of_sheet(p, 2), n_colour)), p, 2)
    tukey_b[:], tukey_c[:] = 1.0, 1.0
    for i in range(n_bright):
        if bright[TRUST, i] < 0.0:
            tukey_b[i] = FULL_WEIGHT
    small, normals = np.empty((p + PLANE + 4, p + PLANE)), np.zeros((OCTANTS + 3, NORMAL))
    octants, normal = normals[:OCTANTS], normals[OCTANTS + 2]
    normal_b, normal_c = normals[OCTANTS], normals[OCTANTS + 1]
    misfit_b = misfit_c = at_u = at_v = 0.0
    noise_b = noise_c = 1.0
    from_u, from_v, drawn_u, drawn_v = u, v, np.inf, np.inf  # where the ball is drawn: nowhere yet
    for iteration in range(ITERATIONS):
        at_u, at_v = on_lattice(u), on_lattice(v)
        if at_u != drawn_u or at_v != drawn_v:
            draw_at(bright, luma, luma_made, ball, LUMA_VAR, at_u, at_v, drawn_b)
            draw_at(colour, chroma, chroma_made, ball, CHROMA_VAR, at_u, at_v, drawn_c)
            drawn_u, drawn_v = at_u, at_v
        _linearise(bright, drawn_b, tukey_b, work_b, seen_b, small[:-1], squares_b, normal_b)
        _linearise(colour, drawn_c, tukey_c, work_c, seen_c, small, squares_c, normal_c)
        misfit_b, noise_b = _misfit(bright, squares_b, tukey_b, 1, p, normal_b)
        misfit_c, noise_c = _misfit(colour, squares_c, tukey_c, 2, p, normal_c)
        for k in range(NORMAL):
            normal[k] = normal_b[k] + normal_c[k]
        det = normal[0] * normal[2] - normal[1] * normal[1]
        new_u = at_u + min(1.0, max(-1.0, (normal[2] * normal[3] - normal[1] * normal[4]) / det))
        new_v = at_v + min(1.0, max(-1.0, (normal[0] * normal[4] - normal[1] * normal[3]) / det))
        moved = max(abs(new_u - u), abs(new_v - v))
        u, v = new_u, new_v
        if moved < CONVERGED_PX and iteration > 0:
            break
        if moved <= ROUGH_PX:  # weights before that would hold the wrong place fast
            _doubt(squares_b, 1, tukey_b)
            _doubt(squares_c, 2, tukey_c)
        weigh_full(bright, work_b[p + PLANE + 1], tukey_b)
    fit[0], fit[1] = u, v
    add_octants(bright, work_b[p + PLANE + 1 :], at_u, at_v, 1.0 / noise_b, octants)
    add_octants(colour, work_c[p + PLANE + 1 :], at_u, at_v, 1.0 / noise_c, octants)
    doubted_covariance(normal, disagreement(normal_b, normal_c), octants, u - at_u, v - at_v, fit[2:5])
    measure_shown(colour, drawn_c, work_c, small[p + PLANE : p + PLANE + 2], ball, from_u, from_v, fit[SHARES:])
    fit[5] = (misfit_b * n_bright + misfit_c * 2 * n_colour) / (n_bright + 2 * n_colour)
    evidence = explained(bright, tukey_b, squares_b, work_b) + explained(colour, tukey_c, squares_c, work_c)
    fit[EVIDENCE] = evidence / max(TINY, fit[5])

"""How sure a fitted centre is, by how far the parts of the ball's image agree on it.

White noise alone makes a centre as sure as its Fisher information says. A tube across the ball, a look-alike beside it,
smear that is not quite as modelled or the blocks of a JPEG are no white noise: there neighbours err together. Then the
octants of the image ask for shifts that differ by more, or brightness and colour see the ball at two places, and that
is what the covariance must say. A pixel that the fit left out asks like any other: the ball may be what it shows.

Source: for estimating equations sum_k G_k = 0 over clusters k that err independently, the covariance is
    I^-1 (sum G_k G_k') I^-1 (1), whatever the noise within a cluster; Liang, Zeger, "Longitudinal data analysis using
    generalized linear models", Biometrika 73 (1986), eq. 9. For two means that differ by more than their covariances
    allow, those grow by d' S^-1 d / 2 (2), d the difference, S its covariance; Birge, "The calculation of errors by the
    method of least squares", Physical Review 40 (1932).
"""

from __future__ import annotations

from tracker.image.patch import TRUST, X, Y
from tracker.maths.compiled import compiled
from tracker.types import Array

OCTANTS = 8
CHANCE = 9.2  # of a chi-square of two degrees of freedom: 1 of 100 is larger
SPARED, STRAINED = 2.0, 3.0  # times what white noise asks for: what may be chance, and what is none
WHITE = 0.5  # of white noise, what is left where octants speak: they hold it too, unless they agree by chance
UU, UV, VV, UR, VR, NORMAL = range(6)
"""Of a normal equation in the centre: information and gradient."""


@compiled("void(f8[:, ::1], f8[:, ::1], f8, f8, f8, f8[:, ::1])")
def add_octants(pixels: Array, rows: Array, u: float, v: float, share: float, octants: Array) -> None:
    """Add to the normal equations (OCTANTS, NORMAL) of a centre (u, v) what the octants about it say of it.

    Args:
        pixels (..., n): the brightness or the colour of a patch.
        rows (3 channels, n): of each channel what the fit leaves, its slope by u and by v.
        share: what the patch's misfit leaves of its word.
    """
    for i in range(pixels.shape[1]):
        x, y = pixels[X, i] - u, pixels[Y, i] - v
        octant = octants[4 * (y < 0.0) + 2 * (x < 0.0) + (abs(y) > abs(x))]
        weight = share * pixels[TRUST, i] * pixels[TRUST, i]
        for k in range(0, len(rows), 3):
            rest, by_u, by_v = rows[k, i], weight * rows[k + 1, i], weight * rows[k + 2, i]
            octant[UU] += by_u * rows[k + 1, i]
            octant[UV] += by_u * rows[k + 2, i]
            octant[VV] += by_v * rows[k + 2, i]
            octant[UR] += by_u * rest
            octant[VR] += by_v * rest


@compiled("f8(f8[::1], f8[::1])")
def disagreement(one: Array, other: Array) -> float:
    """Return by how much two normal equations (NORMAL,) differ more on the centre than they allow, 1 by chance (2).

    Source: for d = A^-1 a - B^-1 b and S = A^-1 + B^-1, d' S^-1 d = (a - A c)' A^-1 (a - A c) + (b - B c)' B^-1
        (b - B c), c the centre that both together give.
    """
    det = (one[UU] + other[UU]) * (one[VV] + other[VV]) - (one[UV] + other[UV]) ** 2
    by_u, by_v = one[UR] + other[UR], one[VR] + other[VR]
    u = ((one[VV] + other[VV]) * by_u - (one[UV] + other[UV]) * by_v) / det
    v = ((one[UU] + other[UU]) * by_v - (one[UV] + other[UV]) * by_u) / det
    total = 0.0
    for each in (one, other):
        r, s = each[UR] - each[UU] * u - each[UV] * v, each[VR] - each[UV] * u - each[VV] * v
        spread = each[VV] * r * r - 2.0 * each[UV] * r * s + each[UU] * s * s
        total += spread / (each[UU] * each[VV] - each[UV] * each[UV])
    return total / 2.0 if total > CHANCE else 1.0


@compiled("f8(f8[:, ::1])")
def _strain(octants: Array) -> float:
    """Return the mean square that octants ask for, by their gradients (OCTANTS, NORMAL), over what white noise asks."""
    total = uu = uv = vv = 0.0
    for k in range(OCTANTS):
        uu, uv, vv = uu + octants[k, UU], uv + octants[k, UV], vv + octants[k, VV]
    for k in range(OCTANTS):
        r, s = octants[k, UR], octants[k, VR]
        total += vv * r * r - 2.0 * uv * r * s + uu * s * s
    return total / (uu * vv - uv * uv) / 2.0


@compiled("void(f8[::1], f8, f8[:, ::1], f8, f8, f8[::1])")
def doubted_covariance(normal: Array, factor: float, octants: Array, u: float, v: float, covariance: Array) -> None:
    """Fill in the covariance uu, uv, vv of a centre.

    Args:
        normal (NORMAL,): of the fit.  factor: what its white noise is multiplied by.
        octants (OCTANTS, NORMAL): of every octant, overwritten.
        u, v: the step from where all these are taken to the centre.
    """
    for k in range(OCTANTS):
        octants[k, UR] -= octants[k, UU] * u + octants[k, UV] * v
        octants[k, VR] -= octants[k, UV] * u + octants[k, VV] * v
    believed = min(1.0, max(0.0, (_strain(octants) - SPARED) / (STRAINED - SPARED)))
    det = normal[UU] * normal[VV] - normal[UV] * normal[UV]
    uu, uv, vv = normal[VV] / det, -normal[UV] / det, normal[UU] / det
    white = factor - (1.0 - WHITE) * believed
    covariance[0], covariance[1], covariance[2] = white * uu, white * uv, white * vv
    for k in range(OCTANTS):
        by_u, by_v = octants[k, UR], octants[k, VR]
        shift_u, shift_v = uu * by_u + uv * by_v, uv * by_u + vv * by_v
        covariance[0] += believed * shift_u * shift_u  # (1)
        covariance[1] += believed * shift_u * shift_v
        covariance[2] += believed * shift_v * shift_v

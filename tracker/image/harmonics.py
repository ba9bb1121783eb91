"""What any light can do to a matt ball: spherical harmonics, each as strong as Lambert's law lets it through.

Light L(d) that comes from far directions d falls on a surface with normal n as E(n) = sum over d of L(d) max(0, n.d).
That is a convolution on the sphere, so each degree of L reaches E by a factor of its own: 1, 2/3, 1/4, 0, -1/24, 0,
1/64 for the degrees 0 to 6. Eighteen, of the degrees 0, 1, 2 and 4, are all that a matt ball shows of any number of
lamps, windows and walls, to 1 or 2 %.
Source: Ramamoorthi, Hanrahan, "On the relationship between radiance and irradiance", JOSA A 18 (2001); Basri, Jacobs,
"Lambertian reflectance and linear subspaces", IEEE PAMI 25 (2003).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tracker.maths.compiled import compiled
from tracker.maths.sphere import spread
from tracker.types import Array

LAMBERT = np.repeat((1.0, 2.0 / 3.0, 1.0 / 4.0, -1.0 / 24.0), (1, 3, 5, 9))
"""The factor of each term."""
TERMS = len(LAMBERT)
"""1, x, y, z, five of degree 2 and nine of degree 4."""
_ONE = 2.0 / 3.0 * math.sqrt(3.0)
_TWO = 1.0 / 4.0 * math.sqrt(15.0)
_FLAT_TWO = 1.0 / 8.0 * math.sqrt(5.0)
_FOUR = tuple(-1.0 / 24.0 * factor for factor in (
    1.5 * math.sqrt(35.0), 1.5 * math.sqrt(17.5), 1.5 * math.sqrt(5.0), 1.5 * math.sqrt(2.5), 0.375,
    0.75 * math.sqrt(5.0), 0.375 * math.sqrt(35.0),
))  # fmt: skip
_SCALES = np.array((
    1.0, _ONE, _ONE, _ONE, _TWO, _TWO, _TWO, 0.5 * _TWO, _FLAT_TWO,
    _FOUR[0], _FOUR[1], _FOUR[2], _FOUR[3], _FOUR[4], _FOUR[3], _FOUR[5], _FOUR[1], _FOUR[6],
), np.float32)  # fmt: skip
_PLACES = 40  # where terms are compared to turn them: more than there are terms


@compiled("void(f4[::1], f4[:, ::1], f4[::1])", inline=True)
def lit(weights: NDArray[np.float32], normals: NDArray[np.float32], light: NDArray[np.float32]) -> None:
    """Fill in the sum of the terms with weights (TERMS,) at unit normals x, y, z (3, n): the light (n,).

    A term's mean square over the sphere is that of Lambert's factor.
    """
    three, seven, thirty, more = np.float32(3.0), np.float32(7.0), np.float32(30.0), np.float32(35.0)
    six, one = np.float32(6.0), np.float32(1.0)
    w = weights * _SCALES
    e, a, b, c, xy_, yz_, xz_, apart_, flat_ = w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8]
    q, r, s, t, u, v, p, k, m = w[9], w[10], w[11], w[12], w[13], w[14], w[15], w[16], w[17]
    for i in range(len(light)):
        x, y, z = normals[0, i], normals[1, i], normals[2, i]
        xx, yy, zz, xy = x * x, y * y, z * z, x * y
        apart, high, higher = xx - yy, seven * zz - one, seven * zz - three
        even = e + a * x + b * y + c * z
        second = xy_ * xy + yz_ * y * z + xz_ * x * z + apart_ * apart + flat_ * (three * zz - one)
        about_x = y * z * (r * (three * xx - yy) + t * higher) + x * z * (v * higher + k * (xx - three * yy))
        fourth = xy * (q * apart + s * high) + u * ((more * zz - thirty) * zz + three) + p * apart * high
        light[i] = even + second + about_x + fourth + m * (xx * xx - six * xx * yy + yy * yy)


@compiled("void(f4[:, ::1], f4[:, ::1])")
def _fill(normals: NDArray[np.float32], terms: NDArray[np.float32]) -> None:
    for k in range(TERMS):
        weights = np.zeros(TERMS, np.float32)
        weights[k] = np.float32(1.0)
        lit(weights, normals, terms[k])


def terms_at(normals: Array) -> Array:
    """Return each term at some unit normals (n, 3): (TERMS, n)."""
    terms = np.empty((TERMS, len(normals)), np.float32)
    _fill(np.ascontiguousarray(normals.T, np.float32), terms)
    return terms.astype(np.float64)


_SOME = spread(_PLACES)
_BACK = np.ascontiguousarray(np.linalg.pinv(terms_at(_SOME)))


@compiled("f8[:, ::1](Array(f8, 2, 'C', True))")
def turned(R_RtoW: Array) -> Array:
    """Return T (TERMS, TERMS): the terms at R_RtoW n are T times those at n, for any n and any orthogonal matrix."""
    normals, terms = np.empty((3, _PLACES), np.float32), np.empty((TERMS, _PLACES), np.float32)
    for i in range(3):
        for n in range(_PLACES):
            normals[i, n] = R_RtoW[i, 0] * _SOME[n, 0] + R_RtoW[i, 1] * _SOME[n, 1] + R_RtoW[i, 2] * _SOME[n, 2]
    _fill(normals, terms)
    turn = np.zeros((TERMS, TERMS))
    for k in range(TERMS):
        for n in range(_PLACES):
            for m in range(TERMS):
                turn[k, m] += terms[k, n] * _BACK[n, m]
    return turn

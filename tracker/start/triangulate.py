"""Rays to a point."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.maths.compiled import compiled
from tracker.types import Array, Point, Reason, Rejected, frozen_array

MISS_SIGMA = 4.0
PARALLAX_LIMIT_RAD = float(np.radians(2.0))
PARALLEL_COSINE = float(np.cos(PARALLAX_LIMIT_RAD))


def triangulate(u_inW: Array, p_CinW: Array, sigma_bearing: float) -> Point | Rejected:
    """Find the point nearest all rays.

    Args:
        u_inW: (n, 3) unit bearings from the cameras to the point, n >= 2.
        p_CinW: (n, 3) the cameras' centres [m].
        sigma_bearing: isotropic bearing noise, one sigma [rad].
    Returns:
        Point; Rejected PARALLAX when no two rays are PARALLAX_LIMIT_RAD apart, BEHIND when the point is not before
        every camera.
    Source: with M_i = I - u_i u_i', minimise sum |M_i (p - c_i)|^2: p = (sum M_i)^-1 sum M_i c_i (1). A bearing
        error e_i moves ray i by |p - c_i| e_i at the point, so cov p = (sum M_i)^-1 (sum s_i^2 M_i) (sum M_i)^-1
        with s_i = sigma |p - c_i| (2).
    """
    found, place, covariance = np.empty(3), np.empty(3), np.empty((3, 3))
    _nearest(np.ascontiguousarray(u_inW), np.ascontiguousarray(p_CinW), sigma_bearing, found, place, covariance)
    cosine, least_reach_m, miss_m = found.tolist()
    if cosine > PARALLEL_COSINE:
        angle = np.degrees(np.arccos(min(1.0, cosine)))
        return Rejected(Reason.PARALLAX, f"rays {angle:.2f} deg apart, least {np.degrees(PARALLAX_LIMIT_RAD):.0f} deg")
    if least_reach_m <= 0.0:
        return Rejected(Reason.BEHIND, "rays meet behind a camera")
    return Point(frozen_array(place), frozen_array(covariance), miss_m)


class Rays(NamedTuple):
    """What one camera sees: unit bearings u_inW (n, 3), and within_m (n, 2), how near and far along each it is [m]."""

    u_inW: Array
    within_m: Array


def meetings(a: Rays, b: Rays, p_CinW: Array, sigma_bearing: float, slack_m: float, most: int) -> list[Point]:
    """Find where rays of one camera meet rays of another: the epipolar constraint, in metres.

    Args:
        a, b: of one camera and of the other.
        p_CinW: (2, 3) the cameras' centres [m].  sigma_bearing: as `triangulate` takes it.
        slack_m: what rays may miss each other by beyond what their own uncertainty allows [m].
        most: how many points to return, those first where rays miss each other least.
    Returns:
        Those of their points that `triangulate` does not reject, where they miss each other by no more than that and
        where both may be.
    """
    pairs = np.empty((len(a.u_inW) * len(b.u_inW), 2), np.int64)
    pairs = pairs[: _may_meet(*a, *b, p_CinW, sigma_bearing, slack_m, pairs)]
    count = len(pairs)
    met, places, covariances = np.empty((count, 4)), np.empty((count, 3)), np.empty((count, 3, 3))
    _met(a.u_inW, b.u_inW, pairs, p_CinW, sigma_bearing, met, places, covariances)
    cosine, least_reach_m, miss_m, sigma_m = met.T
    good = (cosine <= PARALLEL_COSINE) & (least_reach_m > 0.0) & (miss_m <= slack_m + MISS_SIGMA * sigma_m)
    kept = np.flatnonzero(good)
    kept = kept[np.argsort(miss_m[kept], kind="stable")[:most]]
    return [
        Point(frozen_array(place), frozen_array(covariance), miss)
        for place, covariance, miss in zip(places[kept], covariances[kept], miss_m[kept].tolist(), strict=True)
    ]


@compiled("void(Array(f8, 2, 'C', readonly=True), Array(f8, 2, 'C', readonly=True), f8, f8[::1], f8[::1], f8[:, ::1])")
def _nearest(u: Array, c: Array, sigma: float, found: Array, p: Array, covariance: Array) -> None:
    """Fill in the point (3,) nearest the rays u (n, 3) from c (n, 3), and its covariance (3, 3), unless too parallel.

    found (3,): the least cosine between two rays, the least reach along one, the rms of what they miss the point by.
    """
    n, total, right, spread = len(u), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
    found[0], found[1], squares = 1.0, np.inf, 0.0
    for k in range(n):
        for other in range(k):
            found[0] = min(found[0], abs(u[k, 0] * u[other, 0] + u[k, 1] * u[other, 1] + u[k, 2] * u[other, 2]))
        for i in range(3):
            for j in range(3):
                M = (1.0 if i == j else 0.0) - u[k, i] * u[k, j]
                total[i, j] += M
                right[i] += M * c[k, j]
    if found[0] > PARALLEL_COSINE:
        return
    inverse = np.linalg.inv(total)
    p[:] = inverse @ right  # (1)
    for k in range(n):
        reach = p - c[k]
        along, distance2 = (reach * u[k]).sum(), (reach * reach).sum()
        found[1] = min(found[1], along)
        miss = reach - along * u[k]
        squares += (miss * miss).sum()
        spread += sigma * sigma * distance2 * (np.eye(3) - np.outer(u[k], u[k]))
    found[2] = np.sqrt(squares / n)
    covariance[:] = inverse @ spread @ inverse  # (2)


@compiled(
    "i8(Array(f8, 2, 'C', True), Array(f8, 2, 'C', True), Array(f8, 2, 'C', True), Array(f8, 2, 'C', True),"
    "Array(f8, 2, 'C', True), f8, f8, i8[:, ::1])"
)
def _may_meet(
    a: Array, a_within: Array, b: Array, b_within: Array, c: Array, sigma: float, slack: float, pairs: NDArray[np.int64]
) -> int:
    """Fill in the pairs (n, 2) of rays that come near each other where both may be, and return how many those are.

    Quick, since a room may hold hundreds of things of a ball's colour; nothing is left out that `_nearest` would keep.
    Source: the feet of the common perpendicular of two lines. Rays at an angle t cross within s |p - c| / sqrt(1 - cos
        t), one sigma, of where they seem to, in any direction.
    """
    w, count = c[0] - c[1], 0
    for i in range(len(a)):
        d = a[i, 0] * w[0] + a[i, 1] * w[1] + a[i, 2] * w[2]
        for j in range(len(b)):
            cosine = a[i, 0] * b[j, 0] + a[i, 1] * b[j, 1] + a[i, 2] * b[j, 2]
            if abs(cosine) > PARALLEL_COSINE:
                continue
            e = b[j, 0] * w[0] + b[j, 1] * w[1] + b[j, 2] * w[2]
            along_a = (cosine * e - d) / (1.0 - cosine * cosine)
            along_b = e + cosine * along_a
            if not (a_within[i, 0] <= along_a <= a_within[i, 1] and b_within[j, 0] <= along_b <= b_within[j, 1]):
                continue
            squares = 0.0
            for k in range(3):
                squares += (w[k] + along_a * a[i, k] - along_b * b[j, k]) ** 2
            sigma_m = sigma * max(along_a, along_b) / np.sqrt(1.0 - abs(cosine))
            if np.sqrt(squares) / 2.0 <= slack + MISS_SIGMA * sigma_m:
                pairs[count, 0], pairs[count, 1] = i, j
                count += 1
    return count


@compiled(
    "void(Array(f8, 2, 'C', True), Array(f8, 2, 'C', True), i8[:, ::1], Array(f8, 2, 'C', True), f8, f8[:, ::1],"
    "f8[:, ::1], f8[:, :, ::1])"
)
def _met(
    a: Array, b: Array, pairs: NDArray[np.int64], c: Array, sigma: float, met: Array, places: Array, covariances: Array
) -> None:
    """Fill in what `_nearest` does for pairs (n, 2), a ray of each; met (n, 4) has one sigma of the place besides."""
    pair = np.empty((2, 3))
    for k in range(len(pairs)):
        pair[0], pair[1] = a[pairs[k, 0]], b[pairs[k, 1]]
        covariances[k] = 0.0
        _nearest(pair, c, sigma, met[k, :3], places[k], covariances[k])
        met[k, 3] = np.sqrt(np.trace(covariances[k]) / 3.0)

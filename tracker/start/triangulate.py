"""Rays to a point."""

from __future__ import annotations

import numpy as np

from tracker.types import Array, Point, Reason, Rejected, frozen_array

PARALLAX_LIMIT_RAD = np.radians(2.0)


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
    cosine = float(np.min(np.abs(u_inW @ u_inW.T)))
    if cosine > np.cos(PARALLAX_LIMIT_RAD):
        angle = np.degrees(np.arccos(min(1.0, cosine)))
        return Rejected(Reason.PARALLAX, f"rays {angle:.2f} deg apart, least {np.degrees(PARALLAX_LIMIT_RAD):.0f} deg")
    M = np.eye(3) - u_inW[:, :, None] * u_inW[:, None, :]
    inverse = np.linalg.inv(M.sum(axis=0))
    p = inverse @ np.einsum("nij,nj->i", M, p_CinW)  # (1)
    reach = p - p_CinW
    if float((reach * u_inW).sum(axis=1).min()) <= 0.0:
        return Rejected(Reason.BEHIND, "rays meet behind a camera")
    miss = np.einsum("nij,nj->ni", M, reach)
    spread = sigma_bearing**2 * (reach**2).sum(axis=1)
    covariance = inverse @ np.einsum("n,nij->ij", spread, M) @ inverse  # (2)
    return Point(frozen_array(p), frozen_array(covariance), float(np.sqrt((miss**2).sum(axis=1).mean())))

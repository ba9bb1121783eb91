"""How far off two cameras can triangulate a point: the paper's section 2.2 and fig. 3."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.types import Array

PAPER_BASELINE_M = 4.5
PAPER_HALF_ANGLE_RAD = np.pi / 2000.0
"""Half of the paper's theta_A = theta_B = pi/1000, which are whole cones."""


def quadrilateral(points: Array, baseline_m: float, half_angles_rad: tuple[float, float]) -> Array:
    """Return the corners P1..P4 of the region in which two error cones meet, (n, 4, 2) [m].

    Args:
        points: (n, 2) in the epipolar plane [m]; camera A stands at (-baseline / 2, 0), B at (+baseline / 2, 0).
        half_angles_rad: between axis and edge of A's cone and of B's.
    Returns:
        Corners in order round the region: edges of A and B turned by (-, -), (-, +), (+, +), (+, -). NaN where two
        edges are parallel or meet behind a camera: the region is open there.
    Source: the paper, fig. 2. Edges a, b through A, B meet at A + s a with s = (B - A) x b / (a x b) (1).
    """
    A, B = np.array([-baseline_m / 2.0, 0.0]), np.array([baseline_m / 2.0, 0.0])
    corners = np.empty((len(points), 4, 2))
    for k, (sign_a, sign_b) in enumerate(((-1, -1), (-1, 1), (1, 1), (1, -1))):
        a = _turned(points - A, sign_a * half_angles_rad[0])
        b = _turned(points - B, sign_b * half_angles_rad[1])
        with np.errstate(divide="ignore", invalid="ignore"):
            s = _cross(B - A, b) / _cross(a, b)  # (1)
            t = _cross(B - A, a) / _cross(a, b)
        corners[:, k] = np.where(((s > 0.0) & (t > 0.0))[:, None], A + s[:, None] * a, np.nan)
    return corners


def triangulation_error(points: Array, baseline_m: float, half_angles_rad: tuple[float, float]) -> Array:
    """Return the paper's epsilon_P (n,) [m]: how far the region's farthest corner is; infinite if it is open."""
    corners = quadrilateral(points, baseline_m, half_angles_rad)
    distances = np.linalg.norm(corners - points[:, None, :], axis=2)
    return np.asarray(np.where(np.isnan(distances).any(axis=1), np.inf, distances.max(axis=1)))


def first_order_error(points: Array, baseline_m: float, half_angles_rad: tuple[float, float]) -> Array:
    """Return epsilon_P (n,) [m] for narrow cones, in closed form: what makes the half circle the best place.

    Source: an edge passes P at a = r_A h_A, b = r_B h_B. The corner d with d . n_A = +-a, d . n_B = +-b has
        |d|^2 = (a^2 + b^2 + 2 a b |cos theta|) / sin^2 theta at most (1). By the law of cosines and with equal cones it
        is baseline h / sin theta for theta >= pi/2, and more than baseline h for theta < pi/2.
    """
    A, B = np.array([-baseline_m / 2.0, 0.0]), np.array([baseline_m / 2.0, 0.0])
    a = np.linalg.norm(points - A, axis=1) * half_angles_rad[0]
    b = np.linalg.norm(points - B, axis=1) * half_angles_rad[1]
    theta = convergence_angle(points, baseline_m)
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(a**2 + b**2 + 2.0 * a * b * np.abs(np.cos(theta))) / np.sin(theta))  # (1)


def convergence_angle(points: Array, baseline_m: float) -> Array:
    """Return the angle (n,) at which the rays from both cameras meet [rad]."""
    half = np.array([baseline_m / 2.0, 0.0])
    a, b = points + half, points - half
    return np.asarray(np.abs(np.arctan2(_cross(a, b), (a * b).sum(axis=1))))


def half_circle(count: int, baseline_m: float, ends_rad: float = 0.0) -> Array:
    """Return points (count, 2) on the half circle over the baseline, where the convergence angle is pi/2 [m].

    ends_rad: how much of it is left out at either camera.
    """
    turn = np.linspace(ends_rad, np.pi - ends_rad, count)
    return np.asarray(baseline_m / 2.0 * np.column_stack((np.cos(turn), np.sin(turn))))


def grid(x_m: Array, y_m: Array) -> NDArray[np.float64]:
    """Return the points (len(y) * len(x), 2) of a grid, row by row."""
    xs, ys = np.meshgrid(x_m, y_m)
    return np.column_stack((xs.ravel(), ys.ravel()))


def _turned(v: Array, angle: float) -> Array:
    """Turn vectors (n, 2) to the left."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack((c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1]))


def _cross(a: Array, b: Array) -> Array:
    """Return a x b, along the last axis."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])

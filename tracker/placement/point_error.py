"""How far off the attitude is for points that are off: the paper's section 3.2, by its own equations 4-6."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from tracker.maths import so3
from tracker.start.pose3 import attitude
from tracker.types import Array, Rejected

PAPER_ERROR_M, PAPER_SIDE_M = 0.008, 0.160
PAPER_RANGE_DEG, PAPER_STEP_DEG = 20.0, 5.0
PAPER_RESULT_DEG = (4.45, 5.60, 5.30)
"""Largest error of roll, pitch and yaw that the paper states."""
STEP_M = 1e-6  # of the finite differences


def triangle(side_m: float) -> Array:
    """Return the corners (3, 3) in B of an equilateral marker: x from 1 to 2, y towards 3, the centroid at 0 [m]."""
    height = side_m * math.sqrt(0.75)
    return np.array([[-side_m / 2, -height / 3, 0.0], [side_m / 2, -height / 3, 0.0], [0.0, 2 * height / 3, 0.0]])


def attitudes(range_deg: float, step_deg: float, yaw_step_deg: float) -> Iterator[tuple[float, float, float]]:
    """Yield (roll, pitch, yaw) [rad], roll and pitch over +-range, yaw the full circle."""
    tilts = np.radians(np.arange(-range_deg, range_deg + step_deg / 2.0, step_deg)).tolist()
    yaws = np.radians(np.arange(-180.0, 180.0, yaw_step_deg)).tolist()
    yield from ((roll, pitch, yaw) for roll in tilts for pitch in tilts for yaw in yaws)


def worst_errors(poses: Iterable[tuple[float, float, float]], side_m: float, error_m: float) -> Array:
    """Return the largest error (3,) of roll, pitch and yaw [rad] with every point `error_m` off its place.

    Source: for each angle every point is moved by error_m along that angle's own gradient, all to raise it or all to
        lower it: to first order no other way of moving them by as much turns it further. The angle itself is then
        taken from the moved points, not from the gradient.
    """
    worst = np.zeros(3)
    for pose in poses:
        places = triangle(side_m) @ so3.from_euler(*pose).T
        slopes = _slopes(places)
        steepest = slopes / np.maximum(np.linalg.norm(slopes, axis=2, keepdims=True), 1e-12)
        for angle in range(3):
            for sign in (-1.0, 1.0):
                turned = _angles(places + sign * error_m * steepest[angle])
                worst[angle] = max(worst[angle], abs(math.remainder(turned[angle] - pose[angle], 2.0 * math.pi)))
    return worst


def drawn_errors(
    poses: Iterable[tuple[float, float, float]], side_m: float, error_m: float, rng: np.random.Generator
) -> Array:
    """Return the largest error (3,) [rad] when each point of each pose is drawn once within error_m of its place."""
    worst = np.zeros(3)
    for pose in poses:
        v = rng.normal(size=(3, 3))
        reach = error_m * np.cbrt(rng.uniform(size=(3, 1)))
        off = reach * v / np.linalg.norm(v, axis=1, keepdims=True)
        angles = _angles(triangle(side_m) @ so3.from_euler(*pose).T + off)
        errors = [abs(math.remainder(a - b, 2.0 * math.pi)) for a, b in zip(angles, pose, strict=True)]
        worst = np.maximum(worst, errors)
    return worst


def _slopes(places: Array) -> Array:
    """Return d (roll, pitch, yaw) / d points (3, 3 points, 3) by central differences [rad/m]."""
    slopes = np.empty((3, 3, 3))
    for point in range(3):
        for k in range(3):
            step = np.zeros((3, 3))
            step[point, k] = STEP_M
            ahead, behind = _angles(places + step), _angles(places - step)
            turns = [math.remainder(a - b, 2.0 * math.pi) for a, b in zip(ahead, behind, strict=True)]
            slopes[:, point, k] = np.array(turns) / (2.0 * STEP_M)
    return slopes


def _angles(places: Array) -> Sequence[float]:
    """Return roll, pitch and yaw of three points (3, 3).

    Raises:
        ValueError: no attitude: error or range so large that the marker stands on end or lies in a line.
    """
    found = attitude(*places)
    if not isinstance(found, Rejected):
        return found
    raise ValueError(f"no attitude from the displaced points: {found.detail}; give less error or range")

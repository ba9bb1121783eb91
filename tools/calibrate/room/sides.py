"""The marker measured by the cameras, against what the config says of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from tools.calibrate.room.bundle import adjust
from tools.calibrate.room.certainty import LEAST_BIAS_PX, metres_a_pixel
from tools.calibrate.room.solve import Found
from tools.calibrate.room.start import sides
from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.types import Array

SIDE_MM = 0.5  # what a ruler errs by
SURE = 3.0  # sigmas from which a difference is no chance


@dataclass(frozen=True, slots=True)
class Side:
    """A distance of two balls. names: theirs.  said_mm: the config's.  found_mm, sigma_mm: measured."""

    names: tuple[str, str]
    said_mm: float
    found_mm: float
    sigma_mm: float

    @property
    def off_mm(self) -> float:
        """Return by how much it is longer than said."""
        return self.found_mm - self.said_mm


def measured_sides(found: Found, rig: Rig) -> tuple[Side, ...]:
    """Measure the marker's sides against one another: their mean gives the room its scale, and is not told by it."""
    layout = replace(found.adjusted.layout, marker=True)
    result = adjust(found.adjusted.scene, found.seen, layout)
    points, at = result.scene.points_inB, layout.marker_at
    bias_m = metres_a_pixel(result.scene) * max(LEAST_BIAS_PX, result.rms_px)
    covariance = result.covariance[at, at] + bias_m**2 * np.eye(points.size)
    said = sides(rig.marker.points_inB)
    slopes = np.array([(_scaled(points + d, said) - _scaled(points - d, said)) / 2e-6 for d in _steps(points)])
    sigmas = np.sqrt(np.einsum("ki,kl,li->i", slopes, covariance, slopes))
    names = combinations([ball.name for ball in rig.marker.balls], 2)
    rows = zip(names, said.tolist(), _scaled(points, said).tolist(), sigmas.tolist(), strict=True)
    return tuple(Side(pair, 1e3 * was, 1e3 * now, 1e3 * sigma) for pair, was, now, sigma in rows)


def refuse_swapped(measured: tuple[Side, ...], rig: Rig) -> None:
    """Refuse a marker whose sides are the config's, but between other balls.

    Raises:
        OperatorError: balls are in each other's places. Where all sides are alike, nothing tells.
    """
    found_mm, places = np.array([side.found_mm for side in measured]), rig.marker.points_inB
    ways = [list(way) for way in permutations(range(len(places)))]
    off_mm = [float(np.abs(1e3 * sides(places[way]) - found_mm).max()) for way in ways]
    best = int(np.argmin(off_mm))
    allowed_mm = max(SIDE_MM, SURE * max(side.sigma_mm for side in measured))
    if off_mm[0] > allowed_mm > off_mm[best]:
        names = [ball.name for ball in rig.marker.balls]
        stray = [f"{names[k]} is where it has {names[place]}" for k, place in enumerate(ways[best]) if place != k]
        raise OperatorError(
            f"calibrate room: balls are swapped: the marker's sides are the config's, but {', '.join(stray)}; correct "
            "position_mm or the colours in [[marker.balls]]"
        )


def _scaled(points: Array, said: Array) -> Array:
    """Return the sides of points (balls, 3), scaled so that their mean is that of those said."""
    found = sides(points)
    return np.asarray(found * said.mean() / found.mean())


def _steps(points: Array) -> Array:
    """Return a step of a micrometre along each coordinate (3 balls, balls, 3)."""
    return 1e-6 * np.eye(points.size).reshape(-1, *points.shape)

"""Which of the triangulated points are the marker: its own shape tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from tracker.rig import Marker
from tracker.types import Point, Reason, Rejected

MAX_COMBINATIONS = 20_000
SIDE_SIGMA = 4.0


def associate(points: Sequence[Sequence[Point]], marker: Marker, slack_m: float) -> tuple[Point, ...] | Rejected:
    """Choose one point per ball so that together they form the marker.

    Args:
        points: for each ball of the marker, in its order, where it may be, best first.
        slack_m: error of a side beyond the points' covariance, for cameras that did not see the same instant [m].
    Returns:
        One point per ball; Rejected NOT_FOUND when a ball has none, GEOMETRY when no choice has the marker's sides.
    Source: the choice whose sides differ least from the marker's, in sigma, none by more than SIDE_SIGMA.
    """
    for ball, places in zip(marker.balls, points, strict=True):
        if not places:
            return Rejected(Reason.NOT_FOUND, f"{ball.name} is not seen by two cameras in one place")
    count = int(np.prod([len(places) for places in points]))
    limit = len(max(points, key=len)) if count <= MAX_COMBINATIONS else int(MAX_COMBINATIONS ** (1.0 / len(points)))
    best, least = None, np.inf
    for choice in product(*(places[:limit] for places in points)):
        misfit = _side_misfit(choice, marker, slack_m)
        if misfit < least:
            best, least = choice, misfit
    return best if best is not None else Rejected(Reason.GEOMETRY, "no choice of balls has the marker's side lengths")


def _side_misfit(choice: tuple[Point, ...], marker: Marker, slack_m: float) -> float:
    """Return the sum of squared side errors in sigma, infinite when one is beyond SIDE_SIGMA."""
    total = 0.0
    for a, b in combinations(range(len(choice)), 2):
        side = choice[a].p_inW - choice[b].p_inW
        length = math.sqrt(side @ side)
        if length == 0.0:
            return np.inf
        along = side / length
        variance = float(along @ (choice[a].covariance + choice[b].covariance) @ along) + slack_m**2
        edge = marker.points_inB[a] - marker.points_inB[b]
        wanted = math.sqrt(edge @ edge)
        error2 = (length - wanted) ** 2 / variance
        if error2 > SIDE_SIGMA**2:
            return np.inf
        total += error2
    return total

"""Which of the triangulated points are the marker: its own shape tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.maths.compiled import compiled
from tracker.rig import Marker
from tracker.types import Array, Point, Reason, Rejected

MAX_CHOICES = 1_024  # of a place for some of the balls, those first that fit best
SIDE_SIGMA = 4.0


def associate(points: Sequence[Sequence[Point]], marker: Marker, slack_m: float) -> tuple[Point, ...] | Rejected:
    """Choose one point per ball so that together they form the marker.

    Args:
        points: for each ball of the marker, in its order, where it may be.
        slack_m: error of a side beyond the points' covariance, for cameras that did not see the same instant [m].
    Returns:
        One point per ball; Rejected NOT_FOUND when a ball has none, GEOMETRY when no choice has the marker's sides.
    Source: the choice whose sides differ least from the marker's, in sigma, none by more than SIDE_SIGMA.
    """
    for ball, places in zip(marker.balls, points, strict=True):
        if not places:
            return Rejected(Reason.NOT_FOUND, f"{ball.name} is not seen by two cameras in one place")
    choices, misfits = _choices([_Places.of(places) for places in points], marker, slack_m)
    if not len(choices):
        return Rejected(Reason.GEOMETRY, "no choice of balls has the marker's side lengths")
    best = choices[np.argmin(misfits)].tolist()
    return tuple(places[k] for places, k in zip(points, best, strict=True))


class _Places(NamedTuple):
    """Where one ball may be: p_inW (n, 3) [m] and their covariances (n, 3, 3) [m^2]."""

    p_inW: Array
    covariances: Array

    @classmethod
    def of(cls, points: Sequence[Point]) -> _Places:
        """Return the places of points."""
        return cls(np.stack([point.p_inW for point in points]), np.stack([point.covariance for point in points]))


def _choices(places: Sequence[_Places], marker: Marker, slack_m: float) -> tuple[NDArray[np.int64], Array]:
    """Return the choices (n, balls) of a place for each ball that have the marker's sides, and their misfits (n,).

    Ball is added to ball, those with the fewest places first, and what fits least is dropped when there are too many.
    """
    order = sorted(range(len(places)), key=lambda ball: len(places[ball].p_inW))
    choices, misfits = np.arange(len(places[order[0]].p_inW))[:, None], np.zeros(len(places[order[0]].p_inW))
    for k, ball in enumerate(order[1:], start=1):
        total = np.repeat(misfits[:, None], len(places[ball].p_inW), axis=1)
        for column, other in enumerate(order[:k]):
            side_m = float(np.linalg.norm(marker.points_inB[ball] - marker.points_inB[other]))
            _add_misfits(*places[other], choices[:, column], *places[ball], side_m, slack_m, total)
        rows, columns = np.nonzero(np.isfinite(total))
        choices, misfits = np.column_stack((choices[rows], columns)), total[rows, columns]
        if len(choices) > MAX_CHOICES:
            least = np.argpartition(misfits, MAX_CHOICES)[:MAX_CHOICES]
            choices, misfits = choices[least], misfits[least]
    return choices[:, np.argsort(order)], misfits


@compiled("void(f8[:, ::1], f8[:, :, ::1], i8[:], f8[:, ::1], f8[:, :, ::1], f8, f8, f8[:, ::1])")
def _add_misfits(
    a: Array, a_covariances: Array, chosen: NDArray[np.int64], b: Array, b_covariances: Array, side_m: float,
    slack_m: float, total: Array,
) -> None:  # fmt: skip
    """Add to total (n, m) the squared errors, in sigma, of the sides from chosen (n,) places of one ball to another's.

    They are infinite beyond SIDE_SIGMA, and for two balls in one place; what is infinite already is not looked at.
    """
    along = np.empty(3)
    for i in range(len(chosen)):
        first = chosen[i]
        for j in range(len(b)):
            if total[i, j] == np.inf:
                continue
            along[0], along[1], along[2] = a[first, 0] - b[j, 0], a[first, 1] - b[j, 1], a[first, 2] - b[j, 2]
            length = math.sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2])
            if length == 0.0:
                total[i, j] = np.inf
                continue
            variance = slack_m * slack_m
            for k in range(3):
                for m in range(3):
                    covariance = a_covariances[first, k, m] + b_covariances[j, k, m]
                    variance += along[k] * covariance * along[m] / (length * length)
            error2 = (length - side_m) ** 2 / variance
            total[i, j] = total[i, j] + error2 if error2 <= SIDE_SIGMA**2 else np.inf

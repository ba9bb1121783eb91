"""Whether the rays of all cameras still meet as they did, and if not, whose do not.

    a sample now and then -> held against what the room file and the samples before tell of the calibration's own faults
    -> evidence by camera

Each sample is weighed alone and none counts beyond a limit, so a hand or a false ball in one of them is no alarm.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tracker.health.sample import MOTION, Sample
from tracker.maths.compiled import compiled
from tracker.maths.covariance import factor, forward, inverse_of, propagated
from tracker.maths.solve import dot
from tracker.rig import Rig
from tracker.types import Array

RECENT = 3  # samples that are judged together
FIRST = 3  # older ones that it takes to know the calibration's own faults, where no room file tells them
FADING = 0.98  # of the older ones, with each that joins them
CALIBRATED_M, CALIBRATED_RAD = 0.003, math.radians(0.1)  # one sigma: what a calibration leaves
DRIFT_M, DRIFT_RAD = 0.0003, math.radians(0.01)  # one sigma: what comes and goes with light, lens and place
KNOCKS = (0.01, math.radians(0.5)), (0.003, math.radians(0.12))  # one sigma [m], [rad]: of a hard one, of a slight one
MOST_EVIDENCE = 7.4  # of one sample [nats]
AT_ODDS = 15.0  # of all recent ones: more than two can give [nats]
NAMED = 6.0  # by which any story that leaves a camera out is worse than the best one [nats]
TWO_AT_ONCE = 3.0  # where one camera was bumped, in one of twenty rooms a second was too [nats]
LEAST_PX = 0.03  # no calibration is believed to fit balls better
Hypothesis = tuple[int, ...]
"""The cameras that have moved."""


@dataclass(frozen=True, slots=True)
class Odds:
    """The verdict.

    at_odds: some camera has moved.  suspects: which, none where that cannot be told.
    from_start: it had when the flight began: it does not stand where the room file has it.
    """

    at_odds: bool
    suspects: Hypothesis = ()
    from_start: bool = False


class Agreement:
    """Samples of a flight, old and recent.

    faults: (6 cameras, 6 cameras) covariance of those that the room file owns up to, see `left_open`; None for no file.
    """

    def __init__(self, cameras: int, faults: Array | None = None) -> None:
        self._cameras = cameras
        usual = np.diag(_spread(cameras, CALIBRATED_M, CALIBRATED_RAD))
        self._prior = np.asarray(np.linalg.inv(usual if faults is None else faults))
        self._first = FIRST if faults is None else 0
        self._N = self._prior.copy()
        self._g = np.zeros(MOTION * cameras)
        self._older = 0
        self._recent: deque[tuple[Sample, list[float]]] = deque()

    def add(self, sample: Sample) -> Odds:
        """Weigh a sample, and say what all recent ones come to. Once at odds, what was learned before stays."""
        told = self._older >= self._first
        self._recent.append((sample, self._evidence(sample, self._alone) if told else [0.0] * self._cameras))
        odds = self._odds()
        if len(self._recent) > RECENT:
            self._recent.popleft() if odds.at_odds else self._grow_old()
        return odds

    @property
    def _alone(self) -> list[Hypothesis]:
        return [(camera,) for camera in range(self._cameras)]

    def _grow_old(self) -> None:
        sample, _ = self._recent.popleft()
        self._N = self._prior + FADING * (self._N - self._prior) + sample.N
        self._g = FADING * self._g + sample.g
        self._older += 1

    def _odds(self) -> Odds:
        evidence = np.array([each for _, each in self._recent])
        if np.minimum(evidence, MOST_EVIDENCE).sum(axis=0).max() <= AT_ODDS:
            return Odds(at_odds=False)
        return Odds(True, self._suspects(), from_start=self._older < FIRST)

    def _suspects(self) -> Hypothesis:
        """Return the cameras without which neither one that moved nor two explain the recent samples nearly as well."""
        whole = Sample(
            np.sum([sample.N for sample, _ in self._recent], axis=0),
            np.sum([sample.g for sample, _ in self._recent], axis=0),
        )
        hypotheses = self._alone + list(combinations(range(self._cameras), 2))
        evidence = np.array(self._evidence(whole, hypotheses))
        evidence[len(self._alone) :] -= TWO_AT_ONCE
        by_others = [
            max(found for found, moved in zip(evidence.tolist(), hypotheses, strict=True) if camera not in moved)
            for camera in range(self._cameras)
        ]
        return tuple(camera for camera, found in enumerate(by_others) if evidence.max() - found > NAMED)

    def _evidence(self, sample: Sample, hypotheses: list[Hypothesis]) -> list[float]:
        """Return by how much a knock of some cameras explains a sample better than none [nats]."""
        moved = np.array([[camera in one for camera in range(self._cameras)] for one in hypotheses])
        found: list[float] = _explained(sample.N, sample.g, self._N, self._g, moved).tolist()
        return found


def left_open(residual_px: float, rig: Rig) -> Array:
    """Return the covariance (6 cameras, 6 cameras) of faults in the cameras' stand that residuals would show so large.

    residual_px: by how much balls missed about the room's origin, one sigma [px].
    """
    turns_rad = [max(residual_px, LEAST_PX) / camera.focal_px for camera in rig.cameras]
    places_m = [turn * np.linalg.norm(camera.p_CinW) for turn, camera in zip(turns_rad, rig.cameras, strict=True)]
    return np.diag(np.repeat(np.column_stack((places_m, turns_rad)).reshape(-1), 3) ** 2)


@compiled("f8(i8, f8, f8)")
def _variance(index: int, place_m: float, turn_rad: float) -> float:
    """Return the variance of one of the cameras' motions by its index, for sigmas of their places and turns."""
    return place_m * place_m if index % MOTION < MOTION // 2 else turn_rad * turn_rad


@compiled("f8(f8[::1], f8[:, ::1], f8[:, ::1])")
def _log_likelihood(e: Array, N: Array, Q: Array) -> float:
    """Return the logarithm of a sample's likelihood, see `_explained`."""
    B = factor(Q).T.copy()
    S = factor(propagated(B, N, np.eye(len(e))))
    seen = np.zeros((len(e), 1))
    for i in range(len(e)):
        seen[i, 0] = dot(B[i], e)
    total = 0.0
    for i, white in enumerate(forward(S, seen)[:, 0]):
        total += 0.5 * white * white - math.log(S[i, i])
    return total


@compiled("f8[::1](f8[:, ::1], f8[::1], f8[:, ::1], f8[::1], b1[:, ::1])")
def _explained(N: Array, g: Array, known: Array, known_g: Array, moved: NDArray[np.bool_]) -> Array:
    """Return by how much a knock of the cameras that moved explains a sample better than none (hypotheses,) [nats].

    Args:
        N, g: of the sample.  known, known_g: of the calibration's own faults.
        moved (hypotheses, cameras): which are supposed to.
    Source: the motions c have a mean m and covariance Q, with or without a knock's own variance; the likelihood
        of a sample is exp(e' B (I + B' N B)^-1 B' e / 2) / sqrt(det(I + B' N B)), e = g - N m, B B' = Q. A hard
        knock and a slight one are as likely.
    """
    Q, e, found = inverse_of(known), g.copy(), np.full(len(moved), -math.inf)
    for j in range(len(g)):
        mean = dot(Q[j], known_g)
        for i in range(len(g)):
            e[i] -= N[i, j] * mean
    for i in range(len(g)):
        Q[i, i] += _variance(i, DRIFT_M, DRIFT_RAD)
    without = _log_likelihood(e, N, Q)
    for h in range(len(moved)):
        for place_m, turn_rad in KNOCKS:
            wider = Q.copy()
            for i in range(len(g)):
                if moved[h, i // MOTION]:
                    wider[i, i] += _variance(i, place_m, turn_rad)
            one = _log_likelihood(e, N, wider) - without - math.log(len(KNOCKS))
            found[h] = max(found[h], one) + math.log1p(math.exp(-abs(found[h] - one)))
    return found


def _spread(cameras: int, place_m: float, turn_rad: float) -> Array:
    """Return the variances (6 cameras,) of motions of these sigmas."""
    return np.tile(np.repeat([place_m**2, turn_rad**2], 3), cameras)

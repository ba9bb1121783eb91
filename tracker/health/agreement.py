"""Whether the rays of all cameras still meet as they did, and if not, whose do not.

    a sample now and then -> held against what those before tell of the calibration's own faults -> evidence by camera

Each sample is weighed alone and none counts beyond a limit, so a hand or a false ball in one of them is no alarm.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from tracker.health.sample import MOTION, Sample
from tracker.types import Array

RECENT = 3  # samples that are judged together
FIRST = 3  # older ones that it takes to know the calibration's own faults
FADING = 0.98  # of the older ones, with each that joins them
CALIBRATED_M, CALIBRATED_RAD = 0.003, math.radians(0.1)  # one sigma: what a calibration leaves
DRIFT_M, DRIFT_RAD = 0.0003, math.radians(0.01)  # one sigma: what comes and goes with light, lens and place
KNOCK_M, KNOCK_RAD = 0.01, math.radians(0.5)  # one sigma of a camera that was knocked
MOST_EVIDENCE = 7.4  # of one sample [nats]
AT_ODDS = 15.0  # of all recent ones: more than two can give [nats]
NAMED = 5.0  # by which a sample usually speaks more against one camera than against any other [nats]


@dataclass(frozen=True, slots=True)
class Odds:
    """The verdict. at_odds: some camera has moved.  suspect: which one, None where that cannot be told."""

    at_odds: bool
    suspect: int | None


class Agreement:
    """Samples of a flight, old and recent."""

    def __init__(self, cameras: int) -> None:
        self._cameras = cameras
        self._N = np.diag(1.0 / _spread(cameras, CALIBRATED_M, CALIBRATED_RAD))
        self._g = np.zeros(MOTION * cameras)
        self._older = 0
        self._recent: deque[tuple[Sample, list[float]]] = deque()

    def add(self, sample: Sample) -> Odds:
        """Weigh a sample, and say what all recent ones come to. Once at odds, what was learned before stays."""
        self._recent.append((sample, self._evidence(sample) if self._older >= FIRST else [0.0] * self._cameras))
        odds = self._odds()
        if len(self._recent) > RECENT:
            self._recent.popleft() if odds.at_odds else self._grow_old()
        return odds

    def _grow_old(self) -> None:
        sample, _ = self._recent.popleft()
        prior = np.diag(1.0 / _spread(self._cameras, CALIBRATED_M, CALIBRATED_RAD))
        self._N = prior + FADING * (self._N - prior) + sample.N
        self._g = FADING * self._g + sample.g
        self._older += 1

    def _odds(self) -> Odds:
        evidence = np.array([each for _, each in self._recent])
        at_odds = bool(np.minimum(evidence, MOST_EVIDENCE).sum(axis=0).max() > AT_ODDS)
        usual = np.median(evidence, axis=0)
        second, best = np.argsort(usual)[-2:].tolist()
        return Odds(at_odds, best if at_odds and usual[best] - usual[second] > NAMED else None)

    def _evidence(self, sample: Sample) -> list[float]:
        """Return by how much each camera's knock explains a sample better than none [nats].

        Source: the motions c have a mean m and covariance Q, with or without a knock's own variance; the likelihood
            of a sample is exp(e' B (I + B' N B)^-1 B' e / 2) / sqrt(det(I + B' N B)), e = g - N m, B B' = Q.
        """
        P = np.asarray(np.linalg.inv(self._N), dtype=np.float64)
        e = sample.g - sample.N @ (P @ self._g)
        Q = P + np.diag(_spread(self._cameras, DRIFT_M, DRIFT_RAD))
        without = _log_likelihood(e, sample.N, Q)
        knock = _spread(1, KNOCK_M, KNOCK_RAD)
        found = []
        for camera in range(self._cameras):
            wider = Q.copy()
            k = np.arange(MOTION * camera, MOTION * (camera + 1))
            wider[k, k] += knock
            found.append(_log_likelihood(e, sample.N, wider) - without)
        return found


def _log_likelihood(e: Array, N: Array, Q: Array) -> float:
    B = np.linalg.cholesky(Q)
    S = np.eye(len(N)) + B.T @ N @ B
    seen = B.T @ e
    return 0.5 * (float(seen @ np.linalg.solve(S, seen)) - float(np.linalg.slogdet(S)[1]))


def _spread(cameras: int, place_m: float, turn_rad: float) -> Array:
    """Return the variances (6 cameras,) of motions of these sigmas."""
    return np.tile(np.repeat([place_m**2, turn_rad**2], 3), cameras)

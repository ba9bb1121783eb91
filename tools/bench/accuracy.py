"""How far estimates are from the truth, on recordings that know it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from bridge.settings import Settings, rig_of
from tools.request import Clocks
from tools.session import tracker_of
from tracker import so3
from tracker.errors import OperatorError
from tracker.sources.groundtruth import GroundTruth, read_ground_truth
from tracker.sources.recording import RecordingSource
from tracker.types import Array, Estimate


@dataclass(frozen=True, slots=True)
class Spread:
    """Mean, standard deviation and largest of absolute errors."""

    mean: float
    sd: float
    max: float


@dataclass(frozen=True, slots=True)
class Accuracy:
    """One recording through one method.

    estimates, pairs: how many estimates for how many true poses.
    position_mm: of the distance.  attitude_deg: of the angle of the rotation between estimate and truth.
    axes_mm: mean absolute error along x, y, z of W.  angles_deg: mean absolute error of roll, pitch, yaw.
    nees, nees_band: mean normalised squared error of the six pose components, and where 95 % of such means lie when
        the covariance is honest and the errors are independent.
    """

    recording: str
    method: str
    estimates: int
    pairs: int
    position_mm: Spread
    attitude_deg: Spread
    axes_mm: tuple[float, float, float]
    angles_deg: tuple[float, float, float]
    nees: float
    nees_band: tuple[float, float]


def measure_accuracy(directory: Path, settings: Settings, clocks: Clocks) -> Accuracy:
    """Run a recording through the tracker and compare with its ground truth.

    Raises:
        OperatorError: no recording, no ground truth, or nothing found in it.
    """
    truth = read_ground_truth(directory)
    with RecordingSource(directory, clocks.stopwatch) as source:
        tracker = tracker_of(settings, rig_of(settings, source.cameras, source.camera_count).rig, clocks)
        steps = [*(tracker.step(event) for event in source), tracker.finish()]
    estimates = [estimate for step in steps for estimate in step.estimates]
    return compare(directory.name, settings.tracker.method, estimates, truth)


def compare(recording: str, method: str, estimates: Sequence[Estimate], truth: GroundTruth) -> Accuracy:
    """Compare estimates with the truth at the same instants.

    Raises:
        OperatorError: no estimate has a true pose at its time.
    """
    index = {int(t_ns): i for i, t_ns in enumerate(truth.t_ns)}
    pairs = [(estimate, index[estimate.t_ns]) for estimate in estimates if estimate.t_ns in index]
    if not pairs:
        raise OperatorError(f"{recording}: no estimate at the time of a true pose; check the ground truth's times")
    errors = np.array([_error(estimate, truth, i) for estimate, i in pairs])
    angles = np.array([_angle_errors(estimate, truth, i) for estimate, i in pairs])
    nees = [float(e @ np.linalg.solve(s.covariance[:6, :6], e)) for e, (s, _) in zip(errors, pairs, strict=True)]
    low, high = chi2.ppf((0.025, 0.975), 6 * len(pairs)) / len(pairs)
    return Accuracy(
        recording,
        method,
        len(pairs),
        len(truth.t_ns),
        _spread(np.linalg.norm(errors[:, :3], axis=1) * 1e3),
        _spread(np.degrees(np.linalg.norm(errors[:, 3:], axis=1))),
        _triple(np.abs(errors[:, :3]).mean(axis=0) * 1e3),
        _triple(np.degrees(np.abs(angles).mean(axis=0))),
        float(np.mean(nees)),
        (float(low), float(high)),
    )


def _error(estimate: Estimate, truth: GroundTruth, i: int) -> Array:
    """Return the error (6,) that the estimate's covariance speaks of: true position less estimated, rotation in B."""
    turn = so3.log(estimate.R_BtoW.T @ truth.R_BtoW[i])
    return np.concatenate((truth.p_BinW[i] - estimate.p_BinW, turn))


def _angle_errors(estimate: Estimate, truth: GroundTruth, i: int) -> Array:
    """Return the errors of roll, pitch and yaw (3,), each within +/-pi [rad]."""
    difference = np.array(so3.to_euler(estimate.R_BtoW)) - np.array(so3.to_euler(truth.R_BtoW[i]))
    return np.asarray((difference + np.pi) % (2.0 * np.pi) - np.pi)


def _spread(values: Array) -> Spread:
    return Spread(float(values.mean()), float(values.std()), float(values.max()))


def _triple(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])

"""How far estimates are from the truth, on recordings that know it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from bridge.settings import Settings, rig_of
from tools.bench.limits import Key, centre_bounds, pose_bounds, truth_about
from tools.request import Clocks
from tools.session import tracker_of
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.rig import Rig
from tracker.sources.groundtruth import GroundTruth, read_ground_truth
from tracker.sources.recording import RecordingSource
from tracker.types import Array, Estimate, Frame, Step


@dataclass(frozen=True, slots=True)
class Spread:
    """Mean, standard deviation and largest of absolute errors."""

    mean: float
    sd: float
    max: float


@dataclass(frozen=True, slots=True)
class Limit:
    """An rms error beside its Cramer-Rao bound, also rms, over the same images; ratio: error by bound, 1 at best."""

    rms: float
    bound: float
    ratio: float


@dataclass(frozen=True, slots=True)
class Accuracy:
    """One recording through one method.

    estimates, pairs: how many estimates for how many true poses.
    position_mm: of the distance.  attitude_deg: of the angle of the rotation between estimate and truth.
    axes_mm: mean absolute error along x, y, z of W.  angles_deg: mean absolute error of roll, pitch, yaw.
    nees, nees_band: mean normalised squared error of the six pose components, and where 95 % of such means lie when
        the covariance is honest and the errors are independent.
    balls_px: of each ball's centre, by name, its error against the truth's projection in both directions together.
    position_limit_mm, attitude_limit_deg: of the pose, from all balls and cameras of its instant alone.
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
    balls_px: dict[str, Limit]
    position_limit_mm: Limit
    attitude_limit_deg: Limit


@dataclass(frozen=True, slots=True, eq=False)
class Yardstick:
    """What estimates of a recording are held against: its truth and the bounds of its own images and poses."""

    recording: str
    rig: Rig
    truth: GroundTruth
    frames: tuple[Frame, ...]
    centres: dict[Key, Array]
    poses: dict[int, Array]


def measure_accuracy(directory: Path, methods: Sequence[Settings], clocks: Clocks) -> list[Accuracy]:
    """Run a recording through the tracker by each method and compare with its ground truth.

    Raises:
        OperatorError: no recording, no ground truth, or nothing found in it.
    """
    truth = read_ground_truth(directory)
    with RecordingSource(directory, clocks.stopwatch) as source:
        rig = rig_of(methods[0], source.cameras, source.camera_count).rig
        frames = tuple(event for event in source if isinstance(event, Frame))
    centres = centre_bounds(frames, rig, truth)
    yardstick = Yardstick(directory.name, rig, truth, frames, centres, pose_bounds(centres, rig, truth))
    return [_through(yardstick, settings, clocks) for settings in methods]


def _through(yardstick: Yardstick, settings: Settings, clocks: Clocks) -> Accuracy:
    tracker = tracker_of(settings, yardstick.rig, clocks)
    steps = [*(tracker.step(frame) for frame in yardstick.frames), tracker.finish()]
    return compare(yardstick, settings.tracker.method, steps)


def compare(yardstick: Yardstick, method: str, steps: Sequence[Step]) -> Accuracy:
    """Compare estimates with the truth at the same instants.

    Raises:
        OperatorError: no estimate, or none that has a true pose at its time.
    """
    recording, truth = yardstick.recording, yardstick.truth
    index = {int(t_ns): i for i, t_ns in enumerate(truth.t_ns)}
    estimates = [estimate for step in steps for estimate in step.estimates]
    if not estimates:
        remedy = "check colours (`posebridge colours`) and calibration"
        raise OperatorError(f"{recording}: method {method} found no pose in any frame; {remedy}")
    pairs = [(estimate, index[estimate.t_ns]) for estimate in estimates if estimate.t_ns in index]
    if not pairs:
        raise OperatorError(f"{recording}: no estimate at the time of a true pose; check the ground truth's times")
    errors = np.array([_error(estimate, truth, i) for estimate, i in pairs])
    angles = np.array([_angle_errors(estimate, truth, i) for estimate, i in pairs])
    nees = [float(e @ np.linalg.solve(s.covariance[:6, :6], e)) for e, (s, _) in zip(errors, pairs, strict=True)]
    low, high = chi2.ppf((0.025, 0.975), 6 * len(pairs)) / len(pairs)
    bounded = [k for k, (estimate, _) in enumerate(pairs) if estimate.t_ns in yardstick.poses]
    bounds = np.array([yardstick.poses[pairs[k][0].t_ns] for k in bounded]).reshape(-1, 6, 6)
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
        _balls(yardstick, steps),
        _limit(errors[bounded, :3] * 1e3, bounds[:, :3, :3] * 1e6),
        _limit(np.degrees(errors[bounded, 3:]), bounds[:, 3:, 3:] * np.degrees(1.0) ** 2),
    )


def _balls(yardstick: Yardstick, steps: Sequence[Step]) -> dict[str, Limit]:
    """Compare each ball's sightings with where the truth says it is seen."""
    places = {
        (seen.t_ns, seen.camera, seen.ball): seen.uv_px
        for frame in yardstick.frames
        for seen in truth_about(frame, yardstick.rig, yardstick.truth)
    }
    found: dict[int, list[tuple[Array, Array]]] = {b: [] for b in range(len(yardstick.rig.marker))}
    for sighting in (sighting for step in steps for sighting in step.sightings):
        key = (sighting.t_ns, sighting.camera, sighting.ball)
        if key in yardstick.centres:
            found[sighting.ball].append((sighting.uv_px - places[key], yardstick.centres[key]))
    return {
        yardstick.rig.marker.balls[b].name: _limit(
            np.array([error for error, _ in each]).reshape(-1, 2), np.array([c for _, c in each]).reshape(-1, 2, 2)
        )
        for b, each in found.items()
    }


def _limit(errors: Array, bounds: Array) -> Limit:
    """Set errors (n, m) beside the bounds (n, m, m) of their covariances; not a number where there are none."""
    if not len(errors):
        return Limit(float("nan"), float("nan"), float("nan"))
    rms = float(np.sqrt((errors**2).sum(axis=1).mean()))
    bound = float(np.sqrt(np.trace(bounds, axis1=1, axis2=2).mean()))
    return Limit(rms, bound, rms / bound)


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

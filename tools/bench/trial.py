"""One simulated flight through rendered cameras and the tracker, with the truth about every instant of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from bridge.settings import load_settings, rig_of
from tools.request import Clocks
from tools.session import tracker_of
from tracker.maths import so3
from tracker.rig import Rig
from tracker.scene import Look
from tracker.sources.paths import ScriptedPath, scripted_path
from tracker.sources.sim import START_NS, SimSource, SimTiming, Troubles
from tracker.types import Array, Estimate, Event, Frame, Step

SIGMAS = 5.0
WRONG = float(2.0 * norm.sf(SIGMAS))
"""Chance of a normal error beyond 5 sigma, 5.7e-7."""
POSE_LIMIT = float(chi2.isf(WRONG, 6))
"""Squared Mahalanobis distance of a pose's six errors that is exceeded by the same chance: 39.5. Beyond is `wrong`."""

Spoil = Callable[[list[Event]], Iterable[Event]]
"""Drop, delay or change frames on their way from the cameras to the tracker."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What is flown and how it is seen.

    path: a path of `sim:` by its name, or one of its own.  timing: the truth about when the pictures
        are taken.
    look, seed: how the pictures look.
    stamp_errors_ns: by how much later than the truth each camera's stamps are; empty for none. The first camera's
        clock is that of the estimates, so its own should be 0.
    config: settings of the tracker, and of rig and marker where `rig` is None.
    lag_rounds: the tracker's.
    """

    path: str | ScriptedPath
    timing: SimTiming = field(default_factory=SimTiming)
    look: Look = field(default_factory=Look)
    seed: int = 0
    stamp_errors_ns: tuple[int, ...] = ()
    config: str = "lab"
    rig: Rig | None = None
    lag_rounds: int = 0

    def vehicle(self) -> ScriptedPath:
        """Return the truth."""
        return scripted_path(self.path, START_NS) if isinstance(self.path, str) else self.path


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """What came of a trial: plain arrays, one row for each of n estimates.

    times_ns (n,), errors (n, 12): true less estimated: position in W [m], rotation in B [rad], velocity in W [m/s],
        rate in B [rad/s], as the estimate's covariance speaks of them.
    covariances: (n, 12, 12).  nis, nis_dof (n,): of the update.  resets (n,): the reset counter.
    rejected: how often each reason was given.
    """

    times_ns: Array
    errors: Array
    covariances: Array
    nis: Array
    nis_dof: Array
    resets: Array
    rejected: dict[str, int]

    def __len__(self) -> int:
        return len(self.times_ns)

    @property
    def seconds(self) -> Array:
        """Return the times since the start (n,) [s]."""
        return np.asarray((self.times_ns - START_NS) * 1e-9)

    @property
    def position_mm(self) -> Array:
        """Return the distances from the truth (n,) [mm]."""
        return np.asarray(np.linalg.norm(self.errors[:, :3], axis=1) * 1e3)

    @property
    def attitude_deg(self) -> Array:
        """Return the angles from the truth (n,) [deg]."""
        return np.asarray(np.degrees(np.linalg.norm(self.errors[:, 3:6], axis=1)))

    def nees(self, part: slice) -> Array:
        """Return the normalised squared errors (n,) of some components."""
        return nees(self.errors[:, part], self.covariances[:, part, part])

    def wrong(self) -> dict[str, str]:
        """Return the poses outside 5 sigma: when, and how many sigmas of one error would be as unlikely."""
        distances = self.nees(slice(0, 6))
        return {
            f"{t_s:.3f} s": f"{norm.isf(max(chi2.sf(distance, 6), 1e-300) / 2.0):.1f} sigma"
            for t_s, distance in zip(self.seconds, distances, strict=True)
            if not distance <= POSE_LIMIT
        }

    def between(self, first_s: float, last_s: float) -> Flown:
        """Return the part from one time since the start to another [s]."""
        return self.rows(np.flatnonzero((self.seconds >= first_s - 1e-6) & (self.seconds <= last_s + 1e-6)))

    def rows(self, k: NDArray[np.intp]) -> Flown:
        """Return some of the estimates."""
        return Flown(
            self.times_ns[k],
            self.errors[k],
            self.covariances[k],
            self.nis[k],
            self.nis_dof[k],
            self.resets[k],
            self.rejected,
        )


def nees(errors: Array, covariances: Array) -> Array:
    """Return e' P^-1 e (n,) of errors (n, m) with covariances (n, m, m)."""
    return np.asarray((errors * np.linalg.solve(covariances, errors[:, :, None])[:, :, 0]).sum(axis=1))


def fly(trial: Trial, troubles: Troubles | None = None, spoil: Spoil | None = None) -> Flown:
    """Render a flight, track it and compare with the truth.

    Args:
        troubles: what spoils the pictures.  spoil: what befalls the frames on their way.
    """
    settings = load_settings(trial.config)
    rig = trial.rig or rig_of(settings, None).rig
    events = footage(trial, rig, troubles)
    return tracked(trial, rig, spoil(list(events)) if spoil else events)


def tracked(trial: Trial, rig: Rig, events: Iterable[Event]) -> Flown:
    """Track what a trial's cameras gave, with a rig as the tracker is told of it, and compare with the truth."""
    settings = load_settings(trial.config)
    late = settings.tracker.model_copy(update={"lag_rounds": trial.lag_rounds})
    tracker = tracker_of(settings.model_copy(update={"tracker": late}), rig, _CLOCKS)
    steps = [*(tracker.step(event) for event in events), tracker.finish()]
    return compared(steps, trial.vehicle())


def footage(trial: Trial, rig: Rig, troubles: Troubles | None) -> Iterable[Event]:
    """Yield the frames of a trial, stamped as its cameras' clocks have it."""
    late_ns = trial.stamp_errors_ns or (0,) * len(rig.cameras)
    with SimSource(rig, trial.vehicle(), _no_time, trial.timing, trial.look, trial.seed, troubles) as source:
        for event in source:
            if isinstance(event, Frame):
                yield replace(event, t_ns=event.t_ns + late_ns[event.camera])


def compared(steps: Sequence[Step], vehicle: ScriptedPath) -> Flown:
    """Compare all estimates of some steps with the truth."""
    estimates = tuple(estimate for step in steps for estimate in step.estimates)
    return Flown(
        np.array([estimate.t_ns for estimate in estimates], dtype=np.float64),
        np.array([error(estimate, vehicle) for estimate in estimates]).reshape(-1, 12),
        np.array([estimate.covariance for estimate in estimates]).reshape(-1, 12, 12),
        np.array([estimate.nis for estimate in estimates], dtype=np.float64),
        np.array([estimate.nis_dof for estimate in estimates], dtype=np.float64),
        np.array([estimate.reset_counter for estimate in estimates], dtype=np.float64),
        dict(Counter(str(rejected.reason) for step in steps for rejected in step.rejections)),
    )


def error(estimate: Estimate, vehicle: ScriptedPath) -> Array:
    """Return the twelve errors of an estimate (12,), true less estimated."""
    (p_BinW, R_BtoW), (v_BinW, w_BinB) = vehicle.pose_at(estimate.t_ns), vehicle.motion_at(estimate.t_ns)
    turn = so3.log(estimate.R_BtoW.T @ R_BtoW)
    return np.concatenate((p_BinW - estimate.p_BinW, turn, v_BinW - estimate.v_BinW, w_BinB - estimate.w_BinB))


def _no_time() -> int:
    """Stand still: a trial gives the same figures on every machine."""
    return 0


def _no_sleep(_seconds: float) -> None:
    """Wait for nothing."""


_CLOCKS = Clocks(_no_time, _no_time, _no_time, _no_sleep)

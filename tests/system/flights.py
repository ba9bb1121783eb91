"""Simulated flights with a fault in the middle, flown once each, and what is asked of every one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from bridge.settings import load_settings, rig_of
from tools.bench.trial import Flown, Spoil, Trial, fly
from tracker.rig import Rig
from tracker.scene import Look, Trouble
from tracker.sources.paths import ScriptedPath, scripted_path
from tracker.sources.sim import START_NS, SimTiming
from tracker.types import Array

RATE_HZ = 15.0
DURATION_S = 4.4
FIRST_S, LAST_S = 2.0, 3.0  # of a fault that lasts a second
LINEAR = Look(gamma=1.0)
TIMING = SimTiming(RATE_HZ, DURATION_S)
FRAMES = round(RATE_HZ * DURATION_S)
DARK = (38, 36, 35)
RIG: Rig = rig_of(load_settings("lab"), None).rig
VEHICLE: ScriptedPath = scripted_path("random-1", START_NS)

Fault = Callable[[int, float], Trouble]
"""What is wrong with the picture of a camera (index) at a time since the start [s]."""


@dataclass(frozen=True)
class Case:
    """A flight with a fault.

    least: estimates there must be.  resets: the reset counter at the end.
    first_s, last_s: the fault; soon after it the track must be back.  ends: whether all is well again then.
    """

    name: str
    fault: Fault | None = None
    spoil: Spoil | None = None
    first_s: float = FIRST_S
    last_s: float = LAST_S
    least: int = FRAMES
    resets: int = 0
    ends: bool = True
    trial: Trial = field(default_factory=lambda: Trial(VEHICLE, TIMING, LINEAR, seed=1))

    def __hash__(self) -> int:
        return hash(self.name)

    def __str__(self) -> str:
        return self.name.replace(" ", "-")


@cache
def flown(case: Case) -> Flown:
    """Fly a case, once for all tests on it."""
    return fly(case.trial, None if case.fault is None else by_seconds(case.fault), case.spoil)


def by_seconds(fault: Fault) -> Callable[[int, int], Trouble]:
    """Return what the simulator asks for, by camera and stream time [ns]."""
    return lambda camera, t_ns: fault(camera, (t_ns - START_NS) * 1e-9)


def during(
    trouble: Trouble, cameras: Iterable[int] = (0, 1), *, first_s: float = FIRST_S, last_s: float = LAST_S
) -> Fault:
    """Return a fault that lasts from one time to another [s] in some cameras."""
    chosen = tuple(cameras)
    return lambda camera, t_s: trouble if camera in chosen and first_s <= t_s < last_s else Trouble()


def place(t_s: float) -> Array:
    """Return where the vehicle is (3,) [m] at a time since the start [s]."""
    return VEHICLE.path(t_s)[0]


def assert_no_pose_is_wrong(case: Case) -> None:
    """Every estimate lies within 5 sigma of the truth, as `tools.bench.trial.POSE_LIMIT` defines it."""
    assert flown(case).wrong() == {}


def assert_the_track_is_kept(case: Case) -> None:
    """Enough estimates go out, in order, and 0.3 s after the fault there is one again."""
    run = flown(case)
    assert (np.diff(run.times_ns) > 0).all()
    assert len(run) >= case.least
    after = run.seconds[run.seconds >= case.last_s]
    assert len(after)
    assert after[0] - case.last_s <= 0.3


def assert_the_counter_tells_jumps(case: Case) -> None:
    """The reset counter starts at 0 and ends where it should."""
    resets = flown(case).resets
    assert resets[0] == 0
    assert resets[-1] == case.resets
    assert (np.diff(resets) >= 0).all()


def assert_accuracy_returns(case: Case) -> None:
    """0.6 s after the fault the mean error is less than half a millimetre again."""
    assert flown(case).between(case.last_s + 0.6, np.inf).position_mm.mean() < 0.5

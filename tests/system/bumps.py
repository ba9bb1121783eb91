"""Flights in which a camera is bumped, each flown once: what was said of the calibration, and the poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from bridge.heard import NOTHING
from bridge.settings import load_settings
from tests.system.flights import RIG, by_seconds
from tools.bench.ring import ring_rig
from tools.bench.trial import Flown, Trial, compared, footage
from tools.request import Clocks
from tools.session import recorder_of, tracker_of
from tracker.rig import Rig
from tracker.scene import Knock, Look, Trouble
from tracker.sources.sim import START_NS, SimTiming
from tracker.standing import Health
from tracker.types import Event, Frame, Step

BUMP_S, DURATION_S, WITHIN_S = 7.0, 17.5, 10.0
CLOCKS = Clocks(lambda: 0, lambda: 0, lambda: 0, lambda _: None)
SETTINGS = load_settings("lab")


@dataclass(frozen=True)
class Bump:
    """A flight. knock: what befalls a camera from a time on, None for nothing.  other: what else spoils it."""

    knock: Knock | None
    cameras: int = 2
    seed: int = 1
    gamma: float = 1.0
    other: Callable[[int, float], Trouble] | None = None
    from_s: float = BUMP_S

    def rig(self) -> Rig:
        return RIG if self.cameras == 2 else ring_rig(RIG.marker, self.cameras)

    def trouble(self, camera: int, t_s: float) -> Trouble:
        if self.other is not None:
            return self.other(camera, t_s)
        return Trouble(knocks=(self.knock,)) if self.knock is not None and t_s >= self.from_s else Trouble()

    def trial(self) -> Trial:
        timing = SimTiming(15.0, DURATION_S)
        return Trial(f"random-{self.seed}", timing, Look(gamma=self.gamma), seed=self.seed, rig=self.rig())


@dataclass(frozen=True, eq=False)
class Told:
    """Every event, its step, and the poses held against the truth, None where there is none."""

    events: list[Event]
    steps: list[Step]
    flown: Flown | None

    def health(self) -> list[tuple[float, Health]]:
        """Return what was said of the calibration, by seconds since the start."""
        return [((each.t_ns - START_NS) * 1e-9, each) for step in self.steps if (each := step.health) is not None]

    def named(self) -> dict[str, float]:
        """Return when each camera was first said to have moved [s]."""
        found: dict[str, float] = {}
        for t_s, health in self.health():
            for camera in health.cameras:
                if camera.moved:
                    found.setdefault(camera.name, t_s)
        return found


@cache
def flown(bump: Bump) -> Told:
    """Fly it."""
    tracker = tracker_of(SETTINGS, bump.rig(), CLOCKS)
    events, steps = [], []
    for event in footage(bump.trial(), bump.rig(), by_seconds(bump.trouble)):
        steps.append(tracker.step(event))
        events.append(Frame(event.camera, event.t_ns, event.image[:0].copy()) if isinstance(event, Frame) else event)
    return Told(events, steps, compared(steps, bump.trial().vehicle()))


def log_of(told: Told, rig: Rig, path: Path) -> Path:
    """Write the log that such a flight leaves."""
    recorder = recorder_of(path, SETTINGS, rig, {"source": "sim:test"}, CLOCKS, block_when_full=True)
    for event, step in zip(told.events, told.steps, strict=True):
        assert isinstance(event, Frame)
        recorder.take(event, step, (), event.t_ns, NOTHING)
    recorder.close()
    return path

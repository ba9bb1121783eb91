"""A rehearsal in the air: what may go wrong, done to a hovering vehicle, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from tools.simulate.autopilot.reports import LAND
from tools.sitl.flight import Flight
from tools.sitl.relay import Relay
from tools.sitl.world import Sample, World
from tracker.scene.trouble import NO_TROUBLE, Occluder, Trouble
from tracker.types import Array, Estimate, Event, Frame, Step, frozen_array

_SETTLE_S, _WATCH_S = 3.0, 5.0
_ARRIVAL_S = 0.5
"""Within this after a switch the autopilot need not have heard of it."""

_WHOLE_PICTURE = (0, 0, 8192, 8192)


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that goes wrong for `lasts_s`.

    moves_mm: how far a vehicle that rightly believes its poses goes: to where they say the target is.
    """

    name: str
    what: str
    lasts_s: float
    moves_mm: float = 0.0


FAULTS = (
    Fault("occlusion", "a hand before one camera", 2.0),
    Fault("blind", "both cameras covered", 1.0),
    Fault("dropout", "no frames from any camera", 0.6),
    Fault("clock step", "the host's calendar set back by an hour", 2.0),
    Fault("packet loss", "three of ten datagrams lost, both ways", 5.0),
    Fault("jump", "pose 0.3 m aside, told by reset_counter", 5.0, moves_mm=300.0),
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a fault did.

    excursion_mm: farthest from where the vehicle stood when it began.  quiet_mm: the same of the quiet hover before.
    ekf_error_mm: the autopilot's worst error of its own position, in the frame it is told.  worst_ratio: of its
    EKF_STATUS_REPORT.  failsafe: whether it left guided flight.  texts: what it said.
    """

    fault: Fault
    quiet_mm: float
    excursion_mm: float
    ekf_error_mm: float
    worst_ratio: float
    failsafe: bool
    texts: tuple[str, ...]


class Faults:
    """Spoil pictures, frames, calendar, wire and estimates while a fault is on.

    It stands in for the tracker in the loop, and filters its events. relay: the wire.
    """

    def __init__(self, relay: Relay) -> None:
        self._relay = relay
        self._shift_inW: Array = np.zeros(3)
        self._counts = 0
        self.now = ""
        self.outcomes: list[Outcome] = []

    def troubles(self, camera: int, _t_ns: int) -> Trouble:
        """Return what spoils a camera's picture now."""
        covered = self.now == "blind" or (self.now == "occlusion" and camera == 0)
        return Trouble(occluders=(Occluder(camera, *_WHOLE_PICTURE),)) if covered else NO_TROUBLE

    def wall_ns(self, wall: Callable[[], int]) -> Callable[[], int]:
        """Return a calendar that goes wrong with the rest."""
        return lambda: wall() - (3_600_000_000_000 if self.now == "clock step" else 0)

    def events(self, events: Iterable[Event]) -> Iterator[Event]:
        """Pass events on, but for frames that do not arrive."""
        for event in events:
            if not (self.now == "dropout" and isinstance(event, Frame)):
                yield event

    def spoiled(self, step: Step) -> Step:
        """Move estimates aside while they are to jump; each way counts as one discontinuity."""
        if not self._counts or not step.estimates:
            return step
        return step._replace(estimates=tuple(self._moved(estimate) for estimate in step.estimates))

    def rehearse(self, world: World, flight: Flight) -> Iterator[None]:
        """Do one fault after the other, with a quiet hover before each."""
        for fault in FAULTS:
            yield from flight.hold(world, _SETTLE_S)
            quiet_mm = _reach_mm(world, round(_SETTLE_S / 2 * 50))
            yield from self._suffer(world, flight, fault, quiet_mm)

    def _suffer(self, world: World, flight: Flight, fault: Fault, quiet_mm: float) -> Iterator[None]:
        world.phase = fault.name
        said, first = len(world.ground.texts), len(world.history)
        self._switch(fault, on=True)
        yield from flight.hold(world, fault.lasts_s)
        self._switch(fault, on=False)
        yield from flight.hold(world, _WATCH_S)
        samples = world.history[first:]
        place = samples[0].p_BinW
        errors_mm = _errors_mm(samples, (0.0, fault.lasts_s) if fault.moves_mm else ())
        self.outcomes.append(
            Outcome(
                fault,
                quiet_mm,
                max(1e3 * float(np.linalg.norm(each.p_BinW - place)) for each in samples),
                max(errors_mm, default=0.0),
                max(each.worst_ratio for each in samples),
                any(each.mode == LAND for each in samples),
                tuple(text for _, text in world.ground.texts[said:]),
            )
        )

    def _switch(self, fault: Fault, *, on: bool) -> None:
        self.now = fault.name if on else ""
        self._relay.loss = 0.3 if self.now == "packet loss" else 0.0
        if fault.name == "jump":
            self._shift_inW = np.array([0.3, 0.0, 0.0]) if on else np.zeros(3)
            self._counts += 1

    def _moved(self, estimate: Estimate) -> Estimate:
        place = frozen_array(estimate.p_BinW + self._shift_inW)
        return replace(estimate, p_BinW=place, reset_counter=(estimate.reset_counter + self._counts) % 256)

    @property
    def shift_inW(self) -> Array:
        """Return how far aside poses are told now [m]."""
        return self._shift_inW


def _errors_mm(samples: list[Sample], switched_s: tuple[float, ...]) -> list[float]:
    """Return the autopilot's errors, but for those just after poses went aside or back, before it can have heard."""
    errors_mm = []
    for sample in samples:
        t_s = (sample.t_ns - samples[0].t_ns) / 1e9
        unheard = any(0.0 <= t_s - at_s < _ARRIVAL_S for at_s in switched_s)
        if sample.ekf_error_mm is not None and not unheard:
            errors_mm.append(sample.ekf_error_mm)
    return errors_mm


def _reach_mm(world: World, samples: int) -> float:
    """Return how far the vehicle was from the first of the last so many samples."""
    places = np.array([each.p_BinW for each in world.history[-samples:]])
    return 1e3 * float(np.linalg.norm(places - places[0], axis=1).max())

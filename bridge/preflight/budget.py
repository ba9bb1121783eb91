"""From photon to filter: where the time goes, what the autopilot must be told of it, and whether it was."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.dialogue.peer import Autopilot
from bridge.dialogue.timesync import SyncState
from bridge.preflight import ardupilot, px4
from bridge.preflight.delay import Delay, TooLittle
from bridge.preflight.parameters import Parameter
from bridge.preflight.poses import Timing
from bridge.preflight.rules import figure, set_to
from bridge.preflight.verdict import Line, Mark, Write

GOOD_MS, MOST_MS = 10.0, 25.0  # 50 ms wrong put the EKF 37 mm off in a square of 1.7 m/s
GOOD_STAMPS_MS = 10.0
MOST_DELAY_MS = 250.0  # ArduPilot's own limit
MOST_TURNED_DEG = 15.0
LINK = "link, half the round trip"
STAMPS = "stamps late, by the wiggle"
NAMES: Mapping[Autopilot, str] = {Autopilot.ARDUPILOT: ardupilot.DELAY, Autopilot.PX4: px4.DELAY}


@dataclass(frozen=True, slots=True)
class Stage:
    """One part of the way. least_ms, usual_ms, worst_ms: smallest, median and largest [ms]."""

    name: str
    least_ms: float
    usual_ms: float
    worst_ms: float


@dataclass(frozen=True, slots=True)
class Budget:
    """The whole way from mid-exposure to the autopilot.

    stages: in order.  least_ms, usual_ms: of the sum, which no stage's own least or median need add up to [ms].
    """

    stages: tuple[Stage, ...]
    least_ms: float
    usual_ms: float

    def rows(self) -> Iterator[str]:
        """Yield the budget as a table."""
        yield f"{'from photon to filter, ms':<28}{'least':>8}{'median':>8}{'worst':>8}"
        for stage in self.stages:
            yield f"{stage.name:<28}{stage.least_ms:8.1f}{stage.usual_ms:8.1f}{stage.worst_ms:8.1f}"
        yield f"{'altogether':<28}{self.least_ms:8.1f}{self.usual_ms:8.1f}"


def budget_of(timings: Sequence[Timing], sync: SyncState | None, late_ms: float | None) -> Budget | None:
    """Add up the way of every pose.

    late_ms: by how much stamps were found late, None where no wiggle was made [ms].
    """
    if not timings:
        return None
    names = [name for name, _ in timings[0].stages_ns]
    table = np.array([[dict(timing.stages_ns).get(name, 0) for name in names] for timing in timings]) / 1e6
    stages = [
        Stage(name, float(each.min()), float(np.median(each)), float(each.max()))
        for name, each in zip(names, table.T, strict=True)
    ]
    beyond = []
    if sync is not None:
        beyond.append(Stage(LINK, sync.rtt_ms / 2.0, sync.rtt_ms / 2.0, sync.rtt_ms / 2.0))
    if late_ms is not None:
        beyond.append(Stage(STAMPS, late_ms, late_ms, late_ms))
    more_ms = sum(stage.usual_ms for stage in beyond)
    total = table.sum(axis=1)
    return Budget((*stages, *beyond), float(total.min()) + more_ms, float(np.median(total)) + more_ms)


def recommended_ms(budget: Budget, autopilot: Autopilot, sync: SyncState | None, late_ms: float | None) -> float:
    """Return what the autopilot's delay parameter should be [ms].

    ArduPilot learns the least (arrival - stamp) of a link and takes that instant for the stamp's: it must be told the
    least delay. PX4 goes by the stamps themselves once its own TIMESYNC has converged, which takes round trips below
    10 ms: then only what the stamps are late remains; else it takes the arrival, and must be told the whole way.
    """
    if autopilot is not Autopilot.PX4:
        return max(budget.least_ms, 0.0)
    return max(late_ms or 0.0, 0.0) if sync is not None else max(budget.usual_ms, 0.0)


def delay_lines(
    budget: Budget | None,
    autopilot: Autopilot,
    sync: SyncState | None,
    wiggle: Delay | TooLittle | None,
    lag_s: float,
    known: Mapping[str, Parameter],
) -> Iterator[Line]:
    """Yield the lines on delay.

    wiggle: what it showed, None where none was made.  lag_s: by how much the gyro's report lags [s].
    """
    if wiggle is not None:
        yield from _wiggle_lines(wiggle, lag_s, sync)
    name = NAMES.get(autopilot)
    if name is None:
        return
    if budget is None or name not in known:
        what = "no poses to time" if budget is None else "not told"
        yield Line(Mark.UNKNOWN, name, what, "the measured delay", "see the lines on poses and parameters")
        return
    late_ms = None if not isinstance(wiggle, Delay) else 1e3 * (wiggle.late_s + lag_s)
    yield _parameter_line(name, known[name].value, recommended_ms(budget, autopilot, sync, late_ms), late_ms)


def _parameter_line(name: str, held_ms: float, wanted_ms: float, late_ms: float | None) -> Line:
    how = "by stage times" if late_ms is None else "by stages and wiggle"
    found, needed = f"{figure(held_ms)} ms", f"{wanted_ms:.0f} +- {GOOD_MS:g} ms, {how}"
    if wanted_ms > MOST_DELAY_MS:
        fix = "the way is too long for any autopilot: see the stages, quicken the slowest"
        return Line(Mark.FAIL, name, found, f"below {MOST_DELAY_MS:g} ms; it is {wanted_ms:.0f} ms", fix)
    wrong_ms = abs(held_ms - wanted_ms)
    if wrong_ms <= GOOD_MS:
        return Line(Mark.PASS, name, found, needed)
    write = Write(name, float(round(wanted_ms)), reboot=True)
    fix = set_to(name, write.value, reboot=True)
    return Line(Mark.WARN if wrong_ms <= MOST_MS else Mark.FAIL, name, found, needed, fix, write)


def _wiggle_lines(wiggle: Delay | TooLittle, lag_s: float, sync: SyncState | None) -> Iterator[Line]:
    """Yield what the wiggle showed.

    The clocks are known to half a round trip at worst, wherever in it the autopilot's instant lay: evenly spread, that
    is a sigma of the half over root 3.
    """
    what, needed = "stamps", f"true within {GOOD_STAMPS_MS:g} ms"
    if isinstance(wiggle, TooLittle):
        yield Line(Mark.UNKNOWN, what, wiggle.why, needed, "repeat --wiggle, turning it briskly about all axes")
        return
    clock_ms = 0.0 if sync is None else math.hypot(sync.rtt_ms / math.sqrt(12.0), sync.spread_ms)
    late_ms, sigma_ms = 1e3 * (wiggle.late_s + lag_s), math.hypot(1e3 * wiggle.sigma_s, clock_ms)
    found = f"{abs(late_ms):.1f} +- {sigma_ms:.1f} ms {'late' if late_ms >= 0 else 'early'}"
    found += f", agreement {100 * wiggle.correlation:.0f} %"
    if abs(late_ms) <= GOOD_STAMPS_MS:
        yield Line(Mark.PASS, what, found, needed)
    else:
        way = "raise" if late_ms > 0 else "lower"
        fix = f"{way} latency_ms of the cameras by {abs(late_ms):.0f}, or, if it has none, give it one"
        yield Line(Mark.WARN, what, found, needed, fix)
    if wiggle.turned_deg is None:
        return
    turned = f"{wiggle.turned_deg:.0f} deg apart"
    needed = f"within {MOST_TURNED_DEG:g} deg"
    if wiggle.turned_deg <= MOST_TURNED_DEG:
        yield Line(Mark.PASS, "marker and gyro axes", turned, needed)
    else:
        fix = "the balls' x axis is not the nose: turn position_mm in [marker]; --frame says by how much"
        yield Line(Mark.FAIL, "marker and gyro axes", turned, needed, fix)

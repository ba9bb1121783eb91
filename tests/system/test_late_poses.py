"""Poses that wait for later rounds: none is lost, each leaves once and in order; free-running cameras do no harm."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bridge.settings import load_settings
from bridge.settings.tuning import tuning_of
from tests.system.flights import DURATION_S, RIG, VEHICLE, by_seconds, during
from tools.bench.trial import Flown, Trial, fly, footage
from tracker.pipeline import Tracker
from tracker.scene import Look, Trouble
from tracker.sources.sim import START_NS, SimTiming
from tracker.types import Event, Frame, Silence, Step, TrackState

LINEAR = Look(gamma=1.0)
HALF_A_FRAME_NS = (0, 33_333_333)
SETTLED_S = 0.5
SEEDS = (1, 2, 3)
MOST = 15  # rounds
AS_GOOD = 1.3  # times the error of triggered cameras
BLIND_S = (2.0, 3.0)
ROUND_S, COAST_NS = 1 / 15, 200_000_000
TICK_NS = 1_000


@cache
def flown(seed: int, lag_rounds: int, offsets_ns: tuple[int, ...] = ()) -> Flown:
    timing = SimTiming(15.0, DURATION_S, offsets_ns=offsets_ns)
    return fly(Trial(f"random-{seed}", timing, LINEAR, seed, lag_rounds=lag_rounds))


def error_mm(lag_rounds: int, offsets_ns: tuple[int, ...]) -> float:
    """Return the mean error of all flights."""
    return float(
        np.mean([flown(seed, lag_rounds, offsets_ns).between(SETTLED_S, np.inf).position_mm.mean() for seed in SEEDS])
    )


def test_a_round_late_cameras_that_run_free_are_as_good_as_triggered_ones() -> None:
    assert error_mm(1, HALF_A_FRAME_NS) <= AS_GOOD * error_mm(0, ())
    assert error_mm(1, HALF_A_FRAME_NS) <= AS_GOOD * error_mm(1, ())


@pytest.mark.parametrize("offsets_ns", [(), HALF_A_FRAME_NS], ids=["triggered", "free-running"])
@pytest.mark.parametrize("lag_rounds", [1, 4])
def test_late_poses_are_those_of_the_same_instants_and_none_is_wrong(
    lag_rounds: int, offsets_ns: tuple[int, ...]
) -> None:
    for seed in SEEDS:
        at_once, late = flown(seed, 0, offsets_ns), flown(seed, lag_rounds, offsets_ns)
        assert np.array_equal(late.times_ns, at_once.times_ns)
        assert late.wrong() == {}


def test_a_round_late_speeds_and_rates_err_half_as_much() -> None:
    for part in (slice(6, 9), slice(9, 12)):
        at_once, late = (
            np.mean(
                [np.square(flown(seed, lag).between(SETTLED_S, np.inf).errors[:, part]).sum(1).mean() for seed in SEEDS]
            )
            for lag in (0, 1)
        )
        assert late <= at_once / 4.0


def steps(lag_rounds: int, events: Iterable[Event]) -> Iterator[tuple[Event | None, Step]]:
    """Yield what each event did to a tracker whose stopwatch ticks at each reading, then the end."""
    ticks = iter(range(0, 10**12, TICK_NS))
    tuning = replace(tuning_of(load_settings("lab").tracker), lag_rounds=lag_rounds)
    tracker = Tracker(RIG, tuning, lambda: next(ticks))
    for event in events:
        yield event, tracker.step(event)
    yield None, tracker.finish()


@pytest.fixture(scope="module")
def blinded() -> Sequence[Event]:
    """Return a flight of which no camera sees anything for a second."""
    trial = Trial(VEHICLE, SimTiming(15.0, 3.6), LINEAR, seed=1)
    blind = during(Trouble(light_gain=0.0), first_s=BLIND_S[0], last_s=BLIND_S[1])
    return list(footage(trial, RIG, by_seconds(blind)))


def seconds(t_ns: int) -> float:
    return (t_ns - START_NS) * 1e-9


@pytest.mark.parametrize("lag_rounds", [1, 3])
def test_poses_wait_for_rounds_whatever_these_show_and_leave_at_the_end(
    blinded: Sequence[Event], lag_rounds: int
) -> None:
    at_once = [one.t_ns for _, step in steps(0, blinded) for one in step.estimates]
    left = [
        (np.inf if event is None else seconds(event.t_ns), one.t_ns)
        for event, step in steps(lag_rounds, blinded)
        for one in step.estimates
    ]
    assert [t_ns for _, t_ns in left] == at_once
    assert not any(BLIND_S[0] <= seconds(t_ns) < BLIND_S[1] for t_ns in at_once)
    waited_s = [left_s - seconds(t_ns) for left_s, t_ns in left if np.isfinite(left_s)]
    assert max(waited_s) <= (lag_rounds + 0.5) * ROUND_S
    assert [left_s for left_s, _ in left[-lag_rounds:]] == [np.inf] * lag_rounds


def test_poses_that_wait_leave_when_the_track_is_lost_in_silence(blinded: Sequence[Event]) -> None:
    until = [event for event in blinded if seconds(event.t_ns) < BLIND_S[0]]
    silence = Silence(until[-1].t_ns + 2 * COAST_NS)
    left = {event: step for event, step in steps(3, [*until, silence]) if isinstance(event, Silence)}
    assert left[silence].state is TrackState.LOST
    assert [one.t_ns for one in left[silence].estimates][-1] == until[-1].t_ns
    assert [one.state for one in left[silence].estimates] == [TrackState.TRACKING] * 3


@pytest.mark.parametrize("lag_rounds", [0, 2])
def test_the_time_that_a_pose_waited_is_one_of_its_stages(blinded: Sequence[Event], lag_rounds: int) -> None:
    """So latency, budgets and alarms count it."""
    for _, step in steps(lag_rounds, blinded):
        for one in step.estimates:
            assert ("held" in one.stages_ns) == (lag_rounds > 0)
            assert one.stages_ns.get("held", TICK_NS) >= TICK_NS


def exchanged(events: Sequence[Event]) -> list[Event]:
    """Return a flight in which a camera's frame comes two rounds late, after newer ones."""
    late = next(event for event in events if isinstance(event, Frame) and event.camera and seconds(event.t_ns) > 1.0)
    others = [event for event in events if event is not late]
    after = next(k for k, event in enumerate(others) if seconds(event.t_ns) > seconds(late.t_ns) + 1.5 * ROUND_S)
    return [*others[:after], late, *others[after:]]


@pytest.mark.parametrize("lag_rounds", [1, 3])
def test_with_a_late_frame_each_pose_still_leaves_once_and_in_order(blinded: Sequence[Event], lag_rounds: int) -> None:
    events = exchanged(blinded)
    at_once, late = ([one.t_ns for _, step in steps(lag, events) for one in step.estimates] for lag in (0, lag_rounds))
    assert late == at_once
    assert late == sorted(set(late))


def overtaken(events: Sequence[Event]) -> list[Event]:
    """Return a flight in which every frame of the second camera comes after the first one's next."""
    first, second = ([event for event in events if isinstance(event, Frame) and event.camera == c] for c in (0, 1))
    return [event for pair in zip(first[1:], second, strict=False) for event in pair]


def test_where_every_second_frame_is_overtaken_no_pose_is_lost_however_many_rounds_it_waits() -> None:
    trial = Trial(VEHICLE, SimTiming(15.0, 3.0, offsets_ns=HALF_A_FRAME_NS), LINEAR, seed=1)
    events = overtaken(list(footage(trial, RIG, None)))
    at_once, late = ([one.t_ns for _, step in steps(lag, events) for one in step.estimates] for lag in (0, MOST))
    assert len(at_once) > 2 * MOST
    assert late == at_once

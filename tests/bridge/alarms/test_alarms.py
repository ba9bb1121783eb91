"""Alarms: raised by what lasts, silent for what passes, over when it is over."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from bridge.alarms import RULES, Alarm, BallReading, CameraReading, Level, Limits, Readings, advance, standing_alarms
from bridge.alarms.watch import NOTHING
from bridge.telemetry.states import LogState, PeerState, Surroundings, TimeSyncState
from bridge.wire import LinkState
from tracker.types import TrackState

SECOND_NS = 1_000_000_000
LINK = "udpout:127.0.0.1:14550"
WELL = Readings(
    t_ns=0,
    running_s=60.0,
    state=TrackState.TRACKING,
    state_s=50.0,
    rate_hz=30.0,
    gap_ms=40.0,
    age_ms=20.0,
    latency_p99_ms=8.0,
    nis_ratio=1.0,
    cameras=(CameraReading("cam0", 30.0), CameraReading("cam1", 30.0)),
    balls=(BallReading("red", 0.1),),
    around=Surroundings(
        (LinkState(LINK, True, "", 9, 0, 0),), time_syncs=(TimeSyncState(LINK, True),),
        peers=(PeerState(LINK, "ArduPilot", 1, 1, "ardupilot"),),
    ),
    limits=Limits(),
)  # fmt: skip
BAD: dict[str, dict[str, Any]] = {
    "track_lost": {"state": TrackState.LOST},
    "marker_not_found": {"state": TrackState.SEARCHING},
    "rate": {"rate_hz": 9.0},
    "gap_severe": {"gap_ms": 400.0},
    "gap": {"gap_ms": 150.0},
    "latency": {"latency_p99_ms": 90.0},
    "age": {"age_ms": 300.0},
    "nis_high": {"nis_ratio": 3.0},
    "nis_low": {"nis_ratio": 0.2},
    "camera_silent": {"cameras": (CameraReading("cam0", 900.0),)},
    "camera_blind": {"cameras": (CameraReading("cam0", 10.0, blind_s=6.0),)},
    "ball_unseen": {"balls": (BallReading("red", 4.0),)},
    "clock_offset": {"cameras": (CameraReading("cam1", 10.0, 0.0, 5.0, 0.2),)},
    "link_down": {"around": Surroundings((LinkState(LINK, False, "refused", 0, 0, 0),))},
    "log_stopped": {"around": Surroundings(log=LogState("a", 1, 1, 0, "log a: No space left"))},
    "log_dropping": {"around": Surroundings(log=LogState("a", 1, 1, 3))},
    "time_sync": {"around": Surroundings(time_syncs=(TimeSyncState(LINK, False),))},
}


def after(*seconds: tuple[Readings, float]) -> tuple[Alarm, ...]:
    """Return what stands after readings that each last so many seconds, ten looks a second."""
    standing, t_ns = NOTHING, 0
    for reading, lasted_s in seconds:
        for _ in range(round(lasted_s * 10)):
            t_ns += SECOND_NS // 10
            standing = advance(standing, replace(reading, t_ns=t_ns))
    return standing_alarms(standing, t_ns)


def test_there_is_no_alarm_when_all_is_well() -> None:
    assert after((WELL, 60.0)) == ()


def test_each_rule_has_a_case_here() -> None:
    assert set(BAD) == {rule.name for rule in RULES}


@pytest.mark.parametrize("name", BAD)
def test_each_alarm_is_raised_by_its_cause_alone_and_says_what_to_do(name: str) -> None:
    (alarm,) = after((replace(WELL, **BAD[name]), 10.0))
    assert alarm.name == name
    assert len(alarm.cause) > 10
    assert len(alarm.remedy) > 10


@pytest.mark.parametrize("name", BAD)
def test_each_alarm_is_over_once_its_cause_is(name: str) -> None:
    assert after((replace(WELL, **BAD[name]), 10.0), (WELL, 5.0)) == ()


def test_what_passes_at_once_raises_no_rate_alarm() -> None:
    slow = replace(WELL, rate_hz=9.0)
    assert after(*[(slow, 0.5), (WELL, 0.5)] * 20) == ()


def test_a_figure_between_the_edges_keeps_an_alarm_and_raises_none() -> None:
    between = replace(WELL, rate_hz=14.7)
    assert after((between, 20.0)) == ()
    assert [alarm.name for alarm in after((replace(WELL, rate_hz=9.0), 5.0), (between, 20.0))] == ["rate"]


def test_those_that_matter_most_come_first() -> None:
    found = after((replace(WELL, nis_ratio=3.0, rate_hz=9.0), 10.0))
    assert [alarm.level for alarm in found] == [Level.ALARM, Level.WARNING]

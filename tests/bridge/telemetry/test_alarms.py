"""Alarms: each is raised by its own fault and by no other, says what to do, and is over when the fault is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bridge.alarms import RULES, Alarm, CameraReading, Level, Limits, Readings, advance, standing_alarms
from bridge.alarms.readings import BallReading
from bridge.alarms.rule import Rule
from bridge.alarms.watch import NOTHING
from bridge.dialogue import DialogueState
from bridge.dialogue.peer import Autopilot, Peer
from bridge.dialogue.timesync import SyncState
from bridge.telemetry.states import LogState, Surroundings
from bridge.wire import LinkState
from tracker.types import TrackState

SECOND_NS = 1_000_000_000
UP = LinkState("serial:/dev/a:1", True, "", 5, 0, 0)
SYNC = SyncState(5, 0.1, 2.0, 0.1, 600, 0, 0)
TALKING = DialogueState(Peer(1, 1, Autopilot.ARDUPILOT), False, "ardupilot", SYNC, "set", "", 0, 0, 0)
LOG = LogState("a.mcap", 1000, 10, 0)
WELL = Readings(
    t_ns=0,
    running_s=60.0,
    state=TrackState.TRACKING,
    state_s=50.0,
    rate_hz=30.0,
    gap_ms=40.0,
    age_ms=30.0,
    latency_p99_ms=10.0,
    nis_ratio=1.0,
    cameras=(CameraReading("left", 20.0), CameraReading("right", 20.0, 0.0, 0.1, 0.1)),
    balls=(BallReading("green", 0.0),),
    around=Surroundings((UP,), LOG, (TALKING,)),
    limits=Limits(),
)


def around(links: tuple[LinkState, ...] = (UP,), log: LogState = LOG, far_end: DialogueState = TALKING) -> Readings:
    return replace(WELL, around=Surroundings(links, log, (far_end,)))


FAULTS: dict[str, Readings] = {
    "yaw_wrong": around(far_end=replace(TALKING, yaw="yaw is +90 +/- 3 deg off")),
    "track_lost": replace(WELL, state=TrackState.LOST, state_s=2.0, rate_hz=0.0),
    "marker_not_found": replace(WELL, state=TrackState.SEARCHING, rate_hz=0.0),
    "rate": replace(WELL, rate_hz=12.0),
    "gap_severe": replace(WELL, gap_ms=400.0),
    "gap": replace(WELL, gap_ms=120.0),
    "latency": replace(WELL, latency_p99_ms=80.0),
    "age": replace(WELL, age_ms=130.0),
    "nis_high": replace(WELL, nis_ratio=3.0),
    "nis_low": replace(WELL, nis_ratio=0.2),
    "camera_silent": replace(WELL, cameras=(CameraReading("left", 900.0),)),
    "camera_blind": replace(WELL, cameras=(CameraReading("left", 20.0, 8.0),)),
    "overexposed": replace(WELL, cameras=(CameraReading("left", 20.0, full_share=0.6),)),
    "camera_moved": replace(WELL, cameras=(CameraReading("left", 20.0, moved=True, shift_px=4.2, at_vehicle_mm=11.0),)),
    "cameras_at_odds": replace(WELL, at_odds=True, epipolar_px=2.1),
    "ball_unseen": replace(WELL, balls=(BallReading("green", 5.0),)),
    "clock_offset": replace(WELL, cameras=(CameraReading("left", 20.0, 0.0, 8.0, 0.2, 5.0),)),
    "link_down": around(links=(replace(UP, up=False, reason="no such device"),)),
    "link_full": around(far_end=replace(TALKING, full=True)),
    "autopilot_silent": around(far_end=replace(TALKING, away=True)),
    "poses_held": around(far_end=replace(TALKING, holding="origin: waiting for the autopilot's EKF")),
    "autopilot_unheard": around(far_end=replace(TALKING, peer=None, sync=None)),
    "log_stopped": around(log=replace(LOG, error="log a.mcap: No space left")),
    "log_dropping": around(log=replace(LOG, dropped=3)),
    "time_sync": around(far_end=replace(TALKING, sync=None)),
}


def judged(*spells: tuple[Readings, float]) -> tuple[Alarm, ...]:
    """Return what stands after each reading has lasted for so many seconds, one after the other."""
    standing, t_ns = NOTHING, 0
    for readings, lasting_s in spells:
        for _ in range(round(lasting_s / 0.2) + 1):
            t_ns += SECOND_NS // 5
            standing = advance(standing, replace(readings, t_ns=t_ns))
    return standing_alarms(standing, t_ns)


def test_every_rule_has_its_fault_here() -> None:
    assert set(FAULTS) == {rule.name for rule in RULES}


def test_a_run_that_goes_well_raises_nothing() -> None:
    assert not judged((WELL, 60.0))


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_that_lasts_raises_its_own_alarm_alone_with_cause_and_remedy(name: str) -> None:
    (alarm,) = judged((WELL, 5.0), (FAULTS[name], 10.0))
    assert alarm.name == name
    assert len(alarm.cause) > 15
    assert len(alarm.remedy) > 15


@pytest.mark.parametrize("name", FAULTS)
def test_an_alarm_is_over_once_its_fault_is(name: str) -> None:
    assert not judged((FAULTS[name], 10.0), (WELL, 5.0))


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule.raise_s > 0.2], ids=lambda rule: rule.name)
def test_a_fault_shorter_than_its_rule_asks_raises_nothing(rule: Rule) -> None:
    assert not judged((WELL, 1.0), (FAULTS[rule.name], rule.raise_s - 0.4))


@pytest.mark.parametrize(
    ("between", "name"),
    [
        (replace(WELL, rate_hz=14.65), "rate"),
        (replace(WELL, latency_p99_ms=57.0), "latency"),
        (replace(WELL, nis_ratio=1.9), "nis_high"),
        (replace(WELL, cameras=(CameraReading("left", 20.0, full_share=0.35),)), "overexposed"),
    ],
)
def test_a_figure_that_dances_on_its_limit_neither_raises_nor_ends_an_alarm(between: Readings, name: str) -> None:
    assert not judged((WELL, 5.0), (between, 30.0))
    assert [alarm.name for alarm in judged((FAULTS[name], 10.0), (between, 30.0))] == [name]


def test_what_matters_most_stands_first() -> None:
    faulty = replace(FAULTS["nis_high"], state=TrackState.LOST, state_s=2.0, rate_hz=0.0, gap_ms=2000.0)
    levels = [alarm.level for alarm in judged((faulty, 10.0))]
    assert levels == sorted(levels, key=lambda level: level is not Level.ALARM)
    assert Level.WARNING in levels


def test_the_remedy_for_a_late_camera_names_the_whole_offset_to_set() -> None:
    """5 ms are in the config already, 8 ms were found beyond them."""
    (alarm,) = judged((FAULTS["clock_offset"], 10.0))
    assert "clock_offset_ms = 13.0 for left" in alarm.remedy


@pytest.mark.parametrize(
    ("shift_px", "said"), [(4.2, "4.2 px off in its picture, 11 mm"), (0.01, "rays miss the balls")]
)
def test_a_camera_that_moved_is_told_by_what_shows_it(shift_px: float, said: str) -> None:
    camera = CameraReading("left", 20.0, moved=True, shift_px=shift_px, at_vehicle_mm=11.0)
    (alarm,) = judged((replace(WELL, cameras=(camera,)), 10.0))
    assert said in alarm.cause


def test_time_that_an_alarm_has_stood_counts_from_its_raising() -> None:
    (alarm,) = judged((FAULTS["rate"], 11.0))
    assert alarm.since_s == pytest.approx(10.0, abs=0.4)


def test_any_order_of_faults_keeps_what_is_remembered_bounded() -> None:
    generator, standing = np.random.default_rng(1), NOTHING
    choices = (*FAULTS.values(), WELL)
    for k in range(2000):
        readings = choices[int(generator.integers(len(choices)))]
        standing = advance(standing, replace(readings, t_ns=k * SECOND_NS // 5))
        assert len(standing) <= 2 * len(RULES)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_a_rule_does_not_mention_what_is_well(rule: Rule) -> None:
    assert list(rule.judge(WELL)) == []

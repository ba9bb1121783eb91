"""Lines of the page from what was heard and sent, one matter each."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from bridge.dialogue import DialogueState
from bridge.dialogue.origin import OriginState
from bridge.dialogue.peer import Autopilot, Peer
from bridge.dialogue.profile import PROFILES
from bridge.dialogue.timesync import SyncState
from bridge.preflight.ardupilot import rules
from bridge.preflight.budget import LINK, STAMPS, budget_of, recommended_ms
from bridge.preflight.far_end import origin_line, port_line, port_note, who_lines
from bridge.preflight.fusion import fusion_lines
from bridge.preflight.hearing import Hearing
from bridge.preflight.parameters import Parameter
from bridge.preflight.poses import PoseWatch, Timing
from bridge.preflight.requests import ATTITUDE, POSITION
from bridge.preflight.rules import Accepts, exactly, judge, with_bits, within
from bridge.preflight.said import said
from bridge.preflight.streams import camera_lines, link_line, pose_lines, time_line
from bridge.preflight.verdict import Line, Mark, Section, Write, good, writes
from bridge.wire import LinkState, Received
from tests.bridge.dialogue.far_autopilot import from_autopilot
from tracker.standing import CameraHealth, Health, Witness

HELI = Peer(1, 1, Autopilot.ARDUPILOT)
SECOND_NS = 1_000_000_000
SYNC = SyncState(2 * SECOND_NS, 0.0, 4.0, 0.2, 600, 0, 0)
STATE = DialogueState(HELI, False, "ardupilot", SYNC, str(OriginState.SET), "", 0, 0, 0)
STATUS = "EKF_STATUS_REPORT"


def heard(*messages: Received) -> Hearing:
    """Return a hearing that took these messages."""
    hearing = Hearing((POSITION, ATTITUDE, STATUS, "ESTIMATOR_STATUS", "COMMAND_ACK"))
    for message in messages:
        hearing.take(message, HELI)
    return hearing


def by_what(lines: Iterable[Line]) -> dict[str, Line]:
    return {line.what: line for line in lines}


def timings(steps_ms: Iterable[float], age_ms: float = 40.0) -> list[Timing]:
    """Return timings whose stamps follow each other by steps."""
    stamps = np.cumsum([0.0, *steps_ms]) * 1e6
    camera = round((age_ms - 6.0) * 1e6)
    return [
        Timing(SECOND_NS + round(t), (("camera", camera), ("find", 5_000_000), ("send", 1_000_000))) for t in stamps
    ]


def watching(timed: Iterable[Timing]) -> PoseWatch:
    watch = PoseWatch(0.0)
    watch.timings.extend(timed)
    return watch


def judged(timed: list[Timing], profile: str = "ardupilot") -> dict[str, Line]:
    window = (SECOND_NS, timed[-1].t_ns + timed[-1].age_ns)
    return by_what(pose_lines(watching(timed), PROFILES[profile], "", window, 100.0))


def test_a_page_is_good_only_if_nothing_failed_and_nothing_stayed_unseen() -> None:
    lines = {mark: Line(mark, "a", "b", "c") for mark in Mark}
    assert good([lines[Mark.PASS], lines[Mark.WARN]])
    assert not good([lines[Mark.PASS], lines[Mark.FAIL]])
    assert not good([lines[Mark.PASS], lines[Mark.UNKNOWN]])


def test_cameras_that_do_not_stand_as_calibrated_fail_and_are_named_if_they_can_be() -> None:
    watch = PoseWatch(0.0)
    assert list(camera_lines(watch)) == []
    both = tuple(CameraHealth(name, False, Witness.STILL) for name in ("left", "right"))
    for cameras, at_odds, mark, fix in (
        (both, False, Mark.PASS, ""),
        ((both[0], replace(both[1], moved=True)), False, Mark.FAIL, "right was moved"),
        (both, True, Mark.FAIL, "nothing tells which"),
    ):
        watch.health = Health(0, cameras, at_odds, 1.2, 0.3, from_start=True)
        (line,) = camera_lines(watch)
        assert line.mark is mark
        assert fix in line.fix


def test_a_parameter_that_two_lines_want_is_written_once() -> None:
    write = Write("A", 1.0, False)
    assert writes([Line(Mark.FAIL, "x", "", "", "", write), Line(Mark.FAIL, "y", "", "", "", write)]) == (write,)


@pytest.mark.parametrize(
    ("accepts", "yes", "no"),
    [
        (exactly(6), [6.0], [5.0, 6.1]),
        (within(1, 3), [1.0, 3.0], [0.9, 3.1]),
        (with_bits(11), [11.0, 15.0], [3.0, 9.0]),
    ],
)
def test_what_a_rule_accepts(accepts: Accepts, yes: list[float], no: list[float]) -> None:
    assert all(accepts(value) for value in yes)
    assert not any(accepts(value) for value in no)


def test_an_older_firmwares_name_serves_as_well_and_none_at_all_is_unknown() -> None:
    (gps,) = (rule for rule in rules(velocity=True) if "GPS_TYPE" in rule.names)
    (old,) = judge([gps], {"GPS_TYPE": Parameter("GPS_TYPE", 1.0, 2)})
    assert old.write == Write("GPS_TYPE", 0, True)
    (lacking,) = judge([gps], {"OTHER": Parameter("OTHER", 1.0, 2)})
    assert lacking.mark is Mark.UNKNOWN


def test_without_velocity_no_velocity_is_asked_for() -> None:
    wanted = {rule.names[0]: rule.value for rule in rules(velocity=False)}
    assert (wanted["EK3_SRC1_VELXY"], wanted["EK3_SRC1_VELZ"]) == (0, 0)


def test_rate_gap_and_age_of_a_quiet_stream_pass() -> None:
    assert {line.mark for line in judged(timings([66.7] * 60)).values()} == {Mark.PASS}


def test_a_slow_stream_is_a_doubt_and_one_too_slow_for_the_autopilot_a_failure() -> None:
    assert judged(timings([125.0] * 60))["rate"].mark is Mark.WARN
    assert judged(timings([290.0] * 60))["rate"].mark is Mark.FAIL


@pytest.mark.parametrize(("gap_ms", "profile", "mark"), [
    (140.0, "ardupilot", Mark.PASS), (200.0, "ardupilot", Mark.WARN), (310.0, "ardupilot", Mark.FAIL),
    (140.0, "px4", Mark.WARN), (210.0, "px4", Mark.FAIL),
])  # fmt: skip
def test_the_worst_gap_is_judged_by_what_the_autopilot_bears(gap_ms: float, profile: str, mark: Mark) -> None:
    assert judged(timings([*[33.0] * 60, gap_ms, *[33.0] * 60]), profile)["worst gap"].mark is mark


def test_poses_that_are_too_old_are_a_doubt() -> None:
    assert judged(timings([66.7] * 60, age_ms=120.0))["age when sent"].mark is Mark.WARN


def test_a_link_that_loses_messages_says_so() -> None:
    assert link_line(LinkState("a", True, "", 1000, 0, 3)).mark is Mark.PASS
    assert link_line(LinkState("a", True, "", 1000, 0, 100)).mark is Mark.WARN
    assert link_line(LinkState("a", False, "unplugged", 1000, 0, 0)).mark is Mark.FAIL


def test_a_clock_that_is_not_known_is_a_doubt() -> None:
    assert time_line(SYNC).mark is Mark.PASS
    assert time_line(None).mark is Mark.WARN


def test_the_budget_adds_up_and_each_autopilot_is_told_its_own_part() -> None:
    timed = timings([33.0] * 50, age_ms=40.0) + timings([33.0] * 50, age_ms=60.0)
    budget = budget_of(timed, SYNC, late_ms=3.0)
    assert budget is not None
    assert [stage.name for stage in budget.stages] == ["camera", "find", "send", LINK, STAMPS]
    assert budget.least_ms == pytest.approx(40.0 + 2.0 + 3.0)
    assert budget.usual_ms == pytest.approx(50.0, abs=10.1)
    assert recommended_ms(budget, Autopilot.ARDUPILOT, SYNC, 3.0) == pytest.approx(45.0)
    assert recommended_ms(budget, Autopilot.PX4, SYNC, 3.0) == pytest.approx(3.0)
    assert recommended_ms(budget, Autopilot.PX4, SYNC, -3.0) == 0.0
    assert recommended_ms(budget, Autopilot.PX4, None, 3.0) == pytest.approx(budget.usual_ms)


def test_an_armed_autopilot_is_not_checked() -> None:
    hearing = heard(from_autopilot("HEARTBEAT", 1, type=4, autopilot=3, base_mode=128))
    assert by_what(who_lines(hearing, HELI, None))["autopilot"].mark is Mark.FAIL


@pytest.mark.parametrize(
    ("version", "mark"), [((4, 8, 0, 0), Mark.PASS), ((4, 1, 0, 255), Mark.PASS), ((4, 0, 7, 255), Mark.FAIL)]
)
def test_firmware_older_than_its_parameters_is_refused(version: tuple[int, int, int, int], mark: Mark) -> None:
    major, minor, patch, kind = version
    number = major << 24 | minor << 16 | patch << 8 | kind
    hearing = heard(from_autopilot("AUTOPILOT_VERSION", 1, flight_sw_version=number))
    assert by_what(who_lines(hearing, HELI, None))["firmware"].mark is mark


def test_an_origin_counts_only_once_the_global_position_proves_it() -> None:
    place = from_autopilot("GLOBAL_POSITION_INT", 1, lat=321_000_000, lon=348_000_000)
    nowhere = from_autopilot("GLOBAL_POSITION_INT", 1)
    position = from_autopilot(POSITION, 1)
    assert origin_line(STATE, heard(place), True).mark is Mark.PASS
    assert origin_line(STATE, heard(nowhere, position), True).mark is Mark.FAIL
    assert origin_line(STATE, heard(nowhere), True).mark is Mark.UNKNOWN


@pytest.mark.parametrize(
    ("altitude_m", "version", "mark"),
    [(489.0, (1, 16), Mark.FAIL), (489.0, (1, 15), Mark.PASS), (0.0, (1, 17), Mark.PASS), (489.0, None, Mark.FAIL)],
)
def test_an_origin_whose_altitude_a_px4_would_climb_by_is_refused(
    altitude_m: float, version: tuple[int, int] | None, mark: Mark
) -> None:
    state = replace(STATE, peer=Peer(1, 1, Autopilot.PX4), profile="px4", origin="")
    place = from_autopilot("GPS_GLOBAL_ORIGIN", 1, latitude=473_977_420, altitude=round(1e3 * altitude_m))
    told = [place]
    if version is not None:
        number = version[0] << 24 | version[1] << 16
        told.append(from_autopilot("AUTOPILOT_VERSION", 1, flight_sw_version=number))
    assert origin_line(state, heard(*told), configured=True).mark is mark


@pytest.mark.parametrize(
    ("flags", "mark"),
    [
        (0x1FF, Mark.PASS),  # at rest on the ground with poses
        (0x17F, Mark.PASS),  # in flight
        (0xE5, Mark.FAIL),  # without poses
        (0x7F, Mark.FAIL),  # in flight, poses gone a second ago
    ],
)
def test_the_flags_that_a_real_px4_showed_are_read_rightly(flags: int, mark: Mark) -> None:
    report = from_autopilot("ESTIMATOR_STATUS", SECOND_NS, flags=flags)
    lines = by_what(fusion_lines(heard(report), [], SYNC, Autopilot.PX4, 0))
    assert lines["filter"].mark is mark


def test_a_filter_without_a_position_innovation_is_not_a_good_one() -> None:
    report = from_autopilot("ESTIMATOR_STATUS", SECOND_NS, vel_ratio=math.nan, pos_horiz_ratio=math.nan)
    line = by_what(fusion_lines(heard(report), [], SYNC, Autopilot.PX4, 0))["innovations"]
    assert (line.mark, line.found) == (Mark.UNKNOWN, "v none, xy none, z 0.00, yaw 0.00")


def test_a_px4_that_would_not_arm_and_gives_no_reason_is_no_pass() -> None:
    (line,) = said([], asked=True, answered=True, ready=False).lines
    assert (line.mark, line.found) == (Mark.WARN, "it will not arm, and says no reason here")
    (line,) = said([], asked=True, answered=True, ready=True).lines
    assert line.mark is Mark.PASS


def test_a_slow_port_is_told_where_it_may_matter() -> None:
    values = {"SERIAL1_PROTOCOL": 2, "SERIAL1_BAUD": 57, "SERIAL2_PROTOCOL": -1, "SERIAL2_BAUD": 57}
    known = {name: Parameter(name, float(value), 2) for name, value in values.items()}
    line = port_line(known)
    assert line is not None
    assert line.found == "SERIAL1 57600"
    assert "34 ms early: set SERIAL1_BAUD 921" in port_note(known)
    known["SERIAL1_BAUD"] = Parameter("SERIAL1_BAUD", 921.0, 2)
    assert port_note(known) == ""


def test_a_text_of_no_meaning_to_us_that_forbids_arming_is_a_doubt_and_others_are_left_out() -> None:
    hearing = heard(
        *(
            from_autopilot("STATUSTEXT", 1, text=text)
            for text in ("PreArm: RC not found", "Frame: HELI", "EKF variance")
        )
    )
    section: Section = said(hearing.texts, asked=True, answered=True)
    assert [(line.mark, line.what) for line in section.lines] == [
        (Mark.WARN, '"PreArm: RC not found"'), (Mark.FAIL, '"EKF variance"'),
    ]  # fmt: skip

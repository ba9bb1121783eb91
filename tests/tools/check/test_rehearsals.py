"""Each mistake that people make, rehearsed against the simulated autopilot: the page names it and its fix."""

from __future__ import annotations

import numpy as np
import pytest

from bridge.preflight.verdict import Mark
from tests.tools.check.rehearsal import AS_DELAYED, Mistake, Rehearsal
from tools.check.page import plain, to_text
from tracker.errors import OperatorError


def refused(mistake: Mistake, **asked: bool) -> Rehearsal:
    """Check with a mistake; return what came of it."""
    rehearsal = Rehearsal(mistake)
    assert not rehearsal.check(**asked)
    return rehearsal


def test_nothing_wrong_passes_every_line_and_exits_well() -> None:
    rehearsal = Rehearsal(Mistake())
    assert rehearsal.check(frame=True, wiggle=True)
    assert rehearsal.lines(Mark.FAIL, Mark.WARN, Mark.UNKNOWN) == {}
    assert [section.title for section in rehearsal.sections] == [
        "Autopilot", "Parameters", "Poses", "Fusion", "Delay", "What it says", "Frames",
    ]  # fmt: skip
    assert rehearsal.unchecked == ()
    assert "Nothing speaks against flying" in plain(to_text(rehearsal.sections, rehearsal.unchecked))


def test_what_was_not_looked_at_is_said() -> None:
    rehearsal = Rehearsal(Mistake())
    assert rehearsal.check()
    assert rehearsal.unchecked == ("axes and yaw (--frame)", "the stamps' truth (--wiggle)")


def test_the_wiggle_finds_true_stamps_true_and_splits_the_way_into_its_stages() -> None:
    rehearsal = Rehearsal(Mistake())
    assert rehearsal.check(wiggle=True)
    stamps = rehearsal.lines(Mark.PASS)["stamps"]
    assert float(stamps.found.split()[0]) < 4.0  # the simulated gyro's readings are means over 5 ms
    delay = next(section for section in rehearsal.sections if section.title == "Delay")
    rows = {row[:28].strip(): [float(word) for word in row[28:].split()] for row in delay.notes[1:]}
    assert rows["camera"][0] == pytest.approx(30.0, abs=2.0)  # time goes by steps of 2 ms
    assert rows["track"] == pytest.approx([5.0, 5.0, 5.0], abs=2.0)
    assert rows["altogether"][0] == pytest.approx(35.0, abs=4.0)


@pytest.mark.parametrize(
    ("name", "value", "fix"),
    [
        ("VISO_TYPE", 0, "set VISO_TYPE 1 and reboot the autopilot"),
        ("EK3_SRC1_POSXY", 3, "set EK3_SRC1_POSXY 6"),
        ("EK3_SRC1_VELXY", 3, "set EK3_SRC1_VELXY 6"),
        ("EK3_SRC1_YAW", 1, "set EK3_SRC1_YAW 6"),
        ("GPS1_TYPE", 1, "set GPS1_TYPE 0 and reboot the autopilot"),
    ],
)
def test_a_wrong_parameter_is_named_with_its_fix(name: str, value: float, fix: str) -> None:
    failed = refused(Mistake(parameters={name: value})).lines(Mark.FAIL)
    assert fix in failed[name].fix


def test_a_wrong_delay_is_named_with_the_measured_one() -> None:
    (line,) = refused(Mistake(parameters={"VISO_DELAY_MS": 100})).lines(Mark.FAIL).values()
    assert line.write is not None
    assert (line.what, line.write.name, line.write.reboot) == ("VISO_DELAY_MS", "VISO_DELAY_MS", True)
    assert line.write.value == pytest.approx(36.0, abs=3.0)


def test_a_source_that_is_not_vision_shows_as_a_filter_without_a_position_and_in_plain_words() -> None:
    failed = refused(Mistake(parameters={"EK3_SRC1_POSXY": 3, "EK3_SRC1_VELXY": 3})).lines(Mark.FAIL)
    assert "sends no LOCAL_POSITION_NED" in failed["its position"].found
    assert "level position" in failed["filter"].found
    assert "told to use GPS" in failed['"PreArm: AHRS: EK3 sources require GPS"'].found


def test_a_parameter_that_is_merely_poor_is_a_doubt_and_no_failure() -> None:
    rehearsal = Rehearsal(Mistake(parameters={"VISO_POS_M_NSE": 0.2}))
    assert rehearsal.check()
    assert "set VISO_POS_M_NSE 0.1" in rehearsal.lines(Mark.WARN)["VISO_POS_M_NSE"].fix


def test_no_origin_is_named_with_its_fix() -> None:
    failed = refused(Mistake(origin=False)).lines(Mark.FAIL)
    assert "[origin]" in failed["origin"].fix
    assert "where on Earth" in failed['"PreArm: AHRS: waiting for home"'].found


@pytest.mark.parametrize(
    ("mirror", "wrong"),
    [
        (np.diag([1.0, -1.0, 1.0]), "y of the room has the wrong sign"),
        (np.diag([1.0, 1.0, -1.0]), "z is upside down"),
    ],
)
def test_a_mirrored_room_is_refused(mirror: np.ndarray, wrong: str) -> None:
    failed = refused(Mistake(mirror=mirror), frame=True).lines(Mark.FAIL)
    assert "mirrored" in failed["axes"].found
    assert wrong in failed["axes"].fix


def test_a_marker_turned_by_90_deg_is_refused_by_push_and_by_wiggle() -> None:
    failed = refused(Mistake(marker_deg=90.0), frame=True, wiggle=True).lines(Mark.FAIL)
    assert "by -90 deg about z" in failed["yaw against motion"].fix
    assert failed["marker and gyro axes"].found == "90 deg apart"


def test_a_room_turned_by_90_deg_as_a_whole_is_named_with_its_fix() -> None:
    failed = refused(Mistake(room_yaw_deg=90.0), frame=True).lines(Mark.FAIL)
    assert list(failed) == ["north"]
    assert "lower it by 90" in failed["north"].fix


def test_late_stamps_are_found_and_the_delay_is_right_all_the_same() -> None:
    """A stamp 40 ms late makes the pose look 40 ms younger: the recommendation must not change."""
    rehearsal = Rehearsal(Mistake(late_ns=40_000_000))
    assert rehearsal.check(wiggle=True)
    (line,) = rehearsal.lines(Mark.WARN).values()
    assert line.what == "stamps"
    assert float(line.found.split()[0]) == pytest.approx(40.0, abs=4.0)
    assert "raise latency_ms" in line.fix
    assert rehearsal.lines(Mark.PASS)["VISO_DELAY_MS"].found == "35 ms"


def test_an_autopilot_that_is_silent_is_one_clear_line() -> None:
    with pytest.raises(OperatorError, match="no autopilot heard within 6 s"):
        Rehearsal(Mistake(silent=True)).check()


def test_a_second_autopilot_is_named() -> None:
    failed = refused(Mistake(second=True)).lines(Mark.FAIL)
    assert "set [mavlink] system_id" in failed["other autopilots"].fix


def test_a_track_that_is_not_found_is_named_and_blames_no_origin() -> None:
    rehearsal = refused(Mistake(blind=True))
    failed = rehearsal.lines(Mark.FAIL)
    assert {"track", "poses sent"} <= failed.keys()
    assert "origin" not in failed
    assert "VISO_DELAY_MS" in rehearsal.lines(Mark.UNKNOWN)


def test_apply_asks_writes_reads_back_and_says_that_a_reboot_is_needed() -> None:
    wrong = {"VISO_TYPE": 0, "EK3_SRC1_YAW": 1, "VISO_POS_M_NSE": 0.2}
    rehearsal = Rehearsal(Mistake(parameters=wrong))
    assert not rehearsal.check(apply=True)
    assert {write.name: write.value for write in rehearsal.asked} == {
        "VISO_TYPE": 1, "EK3_SRC1_YAW": 6, "VISO_POS_M_NSE": 0.1,
    }  # fmt: skip
    assert rehearsal.autopilot.parameters["VISO_TYPE"] == 1
    assert rehearsal.autopilot.parameters["EK3_SRC1_YAW"] == 6
    assert rehearsal.told[-1] == "apply: reboot the autopilot, then check again"


def test_apply_writes_nothing_against_the_operators_will() -> None:
    rehearsal = Rehearsal(Mistake(parameters={"VISO_TYPE": 0}))
    rehearsal.answer = False
    assert not rehearsal.check(apply=True)
    assert rehearsal.autopilot.parameters["VISO_TYPE"] == 0


def test_apply_with_yes_does_not_ask_and_the_next_check_passes() -> None:
    rehearsal = Rehearsal(Mistake(parameters={"EK3_SRC1_POSZ": 1, "VISO_DELAY_MS": 10}))
    assert not rehearsal.check(apply=True, yes=True)
    assert rehearsal.asked == ()
    written = {name: rehearsal.autopilot.parameters[name] for name in AS_DELAYED}
    assert Rehearsal(Mistake(parameters=written)).check()

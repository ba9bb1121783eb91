"""The check of a PX4, against a stand-in that talks as PX4 is documented to."""

from __future__ import annotations

from bridge.preflight.verdict import Mark
from tests.tools.check.px4_stand_in import StandIn
from tests.tools.check.rehearsal import START_NS, Mistake, Rehearsal

BOOTED_NS = START_NS - 30_000_000_000


def rehearsed(**parameters: float) -> Rehearsal:
    """Return a rehearsal with a PX4 in the autopilot's place."""
    return Rehearsal(Mistake(origin=False), autopilot=StandIn(parameters, BOOTED_NS))


def test_a_px4_as_the_file_sets_it_passes_with_frame_check_and_wiggle() -> None:
    rehearsal = rehearsed()
    assert rehearsal.check(frame=True, wiggle=True), rehearsal.lines(Mark.FAIL, Mark.UNKNOWN)
    passed = rehearsal.lines(Mark.PASS)
    assert passed["firmware"].found == "1.15.4 official"
    assert passed["origin"].found == "not needed by profile px4"
    assert passed["EKF2_EV_DELAY"].found == "0 ms"
    assert float(passed["stamps"].found.split()[0]) < 4.0


def test_whole_numbers_are_read_and_written_bytewise() -> None:
    rehearsal = rehearsed(EKF2_EV_CTRL=0, EKF2_HGT_REF=1)
    assert not rehearsal.check(apply=True)
    failed = rehearsal.lines(Mark.FAIL)
    assert failed["EKF2_HGT_REF"].found == "1"
    assert "set EKF2_EV_CTRL 15" in failed["EKF2_EV_CTRL"].fix
    assert "it sends no LOCAL_POSITION_NED" in failed["its position"].found
    assert rehearsal.autopilot.parameters["EKF2_EV_CTRL"] == 15
    assert rehearsal.autopilot.parameters["EKF2_HGT_REF"] == 3


def test_the_whole_way_given_as_delay_is_refused_where_the_stamps_are_true() -> None:
    failed_at_35 = rehearsed(EKF2_EV_DELAY=35.0)
    assert not failed_at_35.check(wiggle=True)
    line = failed_at_35.lines(Mark.FAIL)["EKF2_EV_DELAY"]
    assert line.write is not None
    assert line.write.value < 4.0

"""A flight for excitation: its reference, and which stick is moved."""

from __future__ import annotations

import numpy as np
import pytest

from tools.excite.hover import ExcitedHover
from tools.excite.manoeuvre import Kind, Manoeuvre, Sequence
from tools.simulate.control import PilotSticks, added
from tools.simulate.mission import Phase
from tools.simulate.world import wired
from tools.sysid.parameters import AXES, Axis

GROUND_Z_M = -0.7


def _hover(axis: Axis = Axis.ROLL) -> ExcitedHover:
    return ExcitedHover(Sequence((Manoeuvre(axis, Kind.DOUBLET, 1.0, 2.0, 0.4, 0.5, 0.5),)), GROUND_Z_M)


def test_it_climbs_hovers_for_the_whole_sequence_and_lands() -> None:
    hover = _hover()
    times_s = np.arange(0.0, hover.duration_s + 1.0, 0.02)
    phases = [hover.reference_at(float(t_s)).phase for t_s in times_s]
    assert [phase for k, phase in enumerate(phases) if k == 0 or phase is not phases[k - 1]] == [
        Phase.TAKE_OFF, Phase.HOVER, Phase.LAND, Phase.DONE,
    ]  # fmt: skip
    moved = [hover.excitation(float(t_s)) != PilotSticks(0.0, -0.0, -0.0, 0.0) for t_s in times_s]
    assert {phase for phase, moves in zip(phases, moved, strict=True) if moves} == {Phase.HOVER}
    assert sum(moved) * 0.02 == pytest.approx(2.0, abs=0.05)


def test_the_reference_never_jumps() -> None:
    hover = _hover()
    places = np.array([hover.reference_at(float(t_s)).p for t_s in np.arange(0.0, hover.duration_s, 0.02)])
    assert np.abs(np.diff(places, axis=0)).max() < 0.01
    assert places[0, 2] == pytest.approx(GROUND_Z_M)
    assert np.abs(places).max(axis=0)[:2].max() == 0.0


@pytest.mark.parametrize("axis", AXES)
def test_each_axis_reaches_its_own_servo_about_the_bodys_axes(axis: Axis) -> None:
    hover = _hover(axis)
    given = next(
        stick
        for stick in (hover.excitation(float(t_s)) for t_s in np.arange(0.0, 30.0, 0.02))
        if stick != PilotSticks(0.0, -0.0, -0.0, 0.0)
    )
    servos = wired(given)
    sticks = dict(zip(AXES, (servos.roll, servos.pitch, servos.yaw, servos.collective), strict=True))
    assert sticks.pop(axis) == pytest.approx(0.4)
    assert not any(sticks.values())


def test_sticks_go_no_farther_than_their_stops() -> None:
    both = added(PilotSticks(0.8, -0.8, 0.1, 0.2, True), PilotSticks(0.5, -0.5, 0.1, -0.1))
    assert (both.right, both.nose_up, both.nose_right, both.up) == pytest.approx((1.0, -1.0, 0.2, 0.1))
    assert both.motor

"""The simulated helicopter against its own closed-form steady states and the paper's envelope."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tools.simulate.dynamics import GRAVITY
from tools.simulate.helicopter import (
    Helicopter,
    State,
    Sticks,
    full_climb_m_s,
    full_tilt,
    full_yaw_rate,
    standing,
    step,
)
from tools.simulate.wind import Wind
from tracker.maths import so3
from tracker.types import frozen_array

IN_TRIM = Helicopter(trim=(0.0, 0.0, 0.0, 0.0))
CALM = frozen_array(np.zeros(3))
DT_S = 0.0025
NO_FLOOR = -1000.0


def in_the_air(helicopter: Helicopter, roll: float = 0.0, pitch: float = 0.0) -> State:
    """Return a vehicle that hangs still in the air with its weight carried."""
    still = np.zeros(3)
    lift_n = helicopter.mass_kg * GRAVITY
    return State(still, so3.from_euler(roll, pitch, 0.0), still, still, np.zeros(2), lift_n)


def fly(helicopter: Helicopter, state: State, sticks: Sticks, seconds: float, floor_z_m: float = NO_FLOOR) -> State:
    for _ in range(round(seconds / DT_S)):
        state = step(helicopter, state, sticks, CALM, floor_z_m, DT_S)
    return state


def test_in_trim_it_hangs_where_it_is() -> None:
    state = fly(IN_TRIM, in_the_air(IN_TRIM), Sticks(motor=True), 5.0)
    np.testing.assert_allclose(state.p_BinW, 0.0, atol=1e-9)
    np.testing.assert_allclose(state.R_BtoW, np.eye(3), atol=1e-9)


@pytest.mark.parametrize(("roll", "pitch"), [(0.3, 0.0), (0.0, -0.3), (-0.2, 0.25)])
def test_left_alone_it_rights_itself(roll: float, pitch: float) -> None:
    state = fly(IN_TRIM, in_the_air(IN_TRIM, roll, pitch), Sticks(motor=True), 3.0)
    assert state.R_BtoW[2, 2] > math.cos(math.radians(0.2))


@pytest.mark.parametrize(
    ("sticks", "axis", "sign"), [(Sticks(roll=1.0, motor=True), 1, -1), (Sticks(pitch=1.0, motor=True), 0, 1)]
)
def test_full_cyclic_gives_the_papers_level_speed_and_less_than_20_degrees(
    sticks: Sticks, axis: int, sign: int
) -> None:
    """Rolled right it goes to the right, which is -y; nosed down it goes forwards."""
    state = fly(IN_TRIM, in_the_air(IN_TRIM), sticks, 8.0)
    assert math.acos(state.R_BtoW[2, 2]) == pytest.approx(full_tilt(IN_TRIM), rel=0.01)
    assert math.degrees(full_tilt(IN_TRIM)) < 20.0
    assert sign * state.v_BinW[axis] == pytest.approx(1.5, rel=0.12)


def test_both_cyclic_channels_together_tilt_it_no_farther_than_one() -> None:
    state = fly(IN_TRIM, in_the_air(IN_TRIM), Sticks(roll=1.0, pitch=1.0, motor=True), 8.0)
    assert math.acos(state.R_BtoW[2, 2]) == pytest.approx(full_tilt(IN_TRIM), rel=0.01)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_full_collective_gives_the_papers_climb(up: float) -> None:
    state = fly(IN_TRIM, in_the_air(IN_TRIM), Sticks(collective=up, motor=True), 6.0)
    assert state.v_BinW[2] == pytest.approx(up * full_climb_m_s(IN_TRIM), rel=0.01)
    assert full_climb_m_s(IN_TRIM) == pytest.approx(2.5, rel=0.02)


def test_full_yaw_gives_the_papers_90_degrees_a_second() -> None:
    state = fly(IN_TRIM, in_the_air(IN_TRIM), Sticks(yaw=1.0, motor=True), 4.0)
    assert state.w_BinB[2] == pytest.approx(full_yaw_rate(IN_TRIM), rel=1e-3)
    assert math.degrees(full_yaw_rate(IN_TRIM)) == pytest.approx(90.0, rel=0.01)


def test_sticks_beyond_full_do_no_more() -> None:
    held, beyond = (
        fly(IN_TRIM, in_the_air(IN_TRIM), Sticks(yaw=stick, collective=stick, motor=True), 1.0) for stick in (1.0, 9.0)
    )
    np.testing.assert_array_equal(held.v_BinW, beyond.v_BinW)
    np.testing.assert_array_equal(held.w_BinB, beyond.w_BinB)


def test_with_the_motor_off_it_stands_on_the_floor() -> None:
    helicopter = Helicopter()
    start = standing(helicopter, -0.75)
    state = fly(helicopter, start, Sticks(roll=1.0, collective=1.0), 2.0, floor_z_m=-0.75)
    np.testing.assert_allclose(state.p_BinW, start.p_BinW, atol=0.006)
    np.testing.assert_allclose(state.R_BtoW, np.eye(3), atol=1e-3)


def test_dropped_it_comes_to_rest_on_its_skids() -> None:
    state = fly(IN_TRIM, in_the_air(IN_TRIM, roll=0.2), Sticks(), 4.0, floor_z_m=-0.5)
    assert state.p_BinW[2] == pytest.approx(-0.5 + IN_TRIM.skid_m, abs=0.006)
    assert np.linalg.norm(state.v_BinW) < 0.01
    assert state.R_BtoW[2, 2] > math.cos(math.radians(1.0))


def test_halving_the_step_changes_a_second_of_hard_manoeuvre_by_less_than_a_tenth_of_a_millimetre() -> None:
    sticks = Sticks(roll=0.8, pitch=-0.5, yaw=1.0, collective=0.5, motor=True)
    coarse, fine = in_the_air(IN_TRIM), in_the_air(IN_TRIM)
    for _ in range(400):
        coarse = step(IN_TRIM, coarse, sticks, CALM, NO_FLOOR, DT_S)
        for _ in range(2):
            fine = step(IN_TRIM, fine, sticks, CALM, NO_FLOOR, DT_S / 2)
    np.testing.assert_allclose(coarse.p_BinW, fine.p_BinW, atol=1e-4)


def test_attitude_stays_a_rotation() -> None:
    state = fly(Helicopter(), in_the_air(Helicopter()), Sticks(roll=0.4, yaw=1.0, motor=True), 20.0)
    np.testing.assert_allclose(state.R_BtoW @ state.R_BtoW.T, np.eye(3), atol=1e-9)


def test_gusts_have_the_deviation_and_memory_they_were_given_and_follow_their_seed() -> None:
    winds = [Wind(0.05, 0.2, DT_S, np.random.default_rng(3)) for _ in range(2)]
    blown = [np.array([wind.blow() for _ in range(40_000)]) for wind in winds]
    np.testing.assert_array_equal(blown[0], blown[1])
    np.testing.assert_allclose(blown[0].std(axis=0), [0.05, 0.05, 0.05 / 3], rtol=0.12)
    lag = round(0.2 / DT_S)
    assert np.corrcoef(blown[0][:-lag, 0], blown[0][lag:, 0])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.1)

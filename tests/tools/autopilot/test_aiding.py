"""How long the simulated filter goes on without poses, what it takes instead, and how far behind it runs."""

from __future__ import annotations

import math

import pytest

from tests.tools.autopilot.conversation import Conversation
from tools.simulate.autopilot.aiding import HEIGHT, LEVEL, SPEED, Aiding, horizon_ms, is_fresh


@pytest.mark.parametrize(("delay_ms", "expected_ms"), [(0, 72), (30, 72), (120, 132), (250, 252), (400, 252)])
def test_the_filter_runs_at_least_a_barometers_delay_behind_and_never_more_than_a_quarter_second(
    delay_ms: float, expected_ms: int
) -> None:
    assert horizon_ms(delay_ms) == expected_ms


def passing(*what: str, until_ms: int) -> Aiding:
    """Return the timers after these alone have passed, ten times a second."""
    aiding = Aiding(0)
    aiding.note_passed(SPEED)
    for now_ms in range(0, until_ms + 1, 100):
        aiding.advance(now_ms)
        for each in what:
            aiding.note_passed(each)
    return aiding


def test_without_anything_position_is_lost_after_7_s_and_given_up_after_15() -> None:
    assert not passing(until_ms=7000).lost_level
    assert passing(until_ms=7100).lost_level
    assert passing(until_ms=7100).lost_speed
    assert not passing(until_ms=15_000).over
    assert passing(until_ms=15_100).over


def test_while_velocity_is_believed_position_is_lost_after_10_s_and_never_given_up() -> None:
    assert not passing(SPEED, until_ms=10_000).lost_level
    late = passing(SPEED, until_ms=20_000)
    assert late.lost_level
    assert not late.lost_speed
    assert not late.over


def test_height_is_lost_after_10_s_where_velocity_is_sent_and_after_5_where_it_is_not() -> None:
    assert not passing(LEVEL, SPEED, until_ms=10_000).lost_height
    assert passing(LEVEL, SPEED, until_ms=10_100).lost_height
    without = Aiding(0)
    without.advance(5100)
    assert without.lost_height
    assert not passing(LEVEL, HEIGHT, until_ms=20_000).lost_height


def test_height_is_visions_while_its_stamps_are_younger_than_half_a_second() -> None:
    assert is_fresh(1000, 1499)
    assert not is_fresh(1000, 1500)


def height_m(talk: Conversation) -> float:
    state = talk.autopilot.navigation.state_now()
    assert state is not None
    return -float(state.p_BinN[2])


def test_silence_of_a_second_steps_the_height_and_the_next_pose_steps_it_back() -> None:
    with Conversation() as talk:
        talk.wait(10.0, vision=True)
        assert abs(height_m(talk)) < 0.01
        talk.wait(11.0)
        assert abs(height_m(talk)) > 0.02
        talk.wait(11.5, vision=True)
        assert abs(height_m(talk)) < 0.01


def test_on_the_ground_a_heading_far_beyond_its_gate_is_followed() -> None:
    with Conversation() as talk:
        talk.wait(10.0, vision=True)
        for _ in range(100):
            talk.say("VISION_POSITION_ESTIMATE", usec=talk.now_ns // 1000 + 1, yaw=math.pi / 2.0)
            for _ in range(3):
                talk.tick()
        state = talk.autopilot.navigation.state_now()
    assert state is not None
    assert state.euler[2] > 1.0

"""The simulated autopilot, over a real socket: what it flies on, and what it does without."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tools.closed_loop import BOTH, START_NS, ClosedLoop
from tools.simulate.autopilot.navigation import NavState
from tools.simulate.autopilot.vessel import Mode
from tools.simulate.control import Cascade, Tuning
from tools.simulate.flight import Flight, flight_of
from tools.simulate.mission import SHORTEST_S, Mission, Phase, Reference
from tools.simulate.verdict import distance_to_path, judge
from tools.simulate.world import Moment
from tracker.errors import OperatorError
from tracker.types import Array

HOME = np.zeros(3)
LEVEL = (0.0, 0.0, 0.0)


def flown(loop: ClosedLoop) -> Flight:
    landed = loop.world.autopilot.mode is Mode.LANDED
    return flight_of(loop.world.history, [], [], loop.mission.corners_inW, landed)


@pytest.mark.parametrize("room_yaw_deg", [0.0, 90.0, -135.0])
def test_it_flies_the_whole_mission_on_poses_alone_wherever_north_is(room_yaw_deg: float) -> None:
    with ClosedLoop(16.0, seed=2, room_yaw_deg=room_yaw_deg) as loop:
        loop.fly(16.0)
        lines = {line.what: line for line in judge(flown(loop)).lines}
    assert {moment.phase for moment in loop.world.history} == set(Phase)
    for what in ("mission flown to its end", "hover, off the point, RMS", "square, off the path, max"):
        assert lines[what].passed, lines[what]


@pytest.mark.parametrize("message", ["VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP"])
def test_either_pose_message_is_enough_to_hover(message: str) -> None:
    with ClosedLoop(30.0, messages=(message,)) as loop:
        loop.fly(7.0)
        last = loop.world.history[-1]
    assert last.phase is Phase.HOVER
    assert np.linalg.norm(last.p_BinW - last.commanded_inW) < 0.1


def test_the_second_message_of_the_same_instant_is_dropped() -> None:
    with ClosedLoop() as loop:
        loop.fly(1.0)
        vision = loop.world.autopilot.vision
    assert vision.accepted == vision.dropped
    assert vision.accepted >= 14


def test_the_same_seed_gives_the_same_flight() -> None:
    ends = []
    for _ in range(2):
        with ClosedLoop(20.0, seed=5) as loop:
            loop.fly(4.0)
            ends.append(loop.world.history[-1].p_BinW)
    np.testing.assert_array_equal(ends[0], ends[1])


def test_without_a_heartbeat_it_never_starts() -> None:
    with ClosedLoop() as loop:
        loop.heartbeats = False
        loop.fly(3.0)
        assert loop.world.autopilot.mode is Mode.WAITING


def test_counters_that_differ_between_two_messages_look_like_a_reset_at_every_message() -> None:
    """ATT_POS_MOCAP has no counter: as soon as VISION_POSITION_ESTIMATE says 1, the real one flew 200 m away."""
    resets = []
    for messages in (BOTH, BOTH[:1]):
        with ClosedLoop(30.0, messages=messages) as loop:
            loop.fly(6.0)
            loop.reset_counter = 1
            loop.fly(2.0)
            resets.append(loop.world.autopilot.vision.resets)
    assert resets[0] >= 28
    assert resets[1] == 1


def test_two_seconds_of_silence_are_flown_through_by_the_own_imu_and_ill_health_is_said() -> None:
    with ClosedLoop(60.0) as loop:
        loop.fly(10.0)
        loop.poses = False
        loop.fly(2.0)
        autopilot, last = loop.world.autopilot, loop.world.history[-1]
        assert autopilot.mode is Mode.FLYING
        assert not autopilot.vision.healthy(10**9)
    assert np.linalg.norm(last.p_BinW - last.commanded_inW) < 0.3


def test_long_silence_ends_in_the_failsafe_that_lands() -> None:
    with ClosedLoop(60.0) as loop:
        loop.fly(10.0)
        loop.poses = False
        loop.fly(14.0)
        assert loop.world.autopilot.mode is Mode.LANDING


def test_a_gap_of_half_a_second_is_survived_and_the_mission_goes_on() -> None:
    with ClosedLoop(40.0) as loop:
        loop.fly(8.0)
        loop.poses = False
        loop.fly(0.5)
        loop.poses = True
        loop.fly(3.0)
        last = loop.world.history[-1]
        assert loop.world.autopilot.mode is Mode.FLYING
    assert np.linalg.norm(last.p_BinW - last.commanded_inW) < 0.15


@pytest.mark.parametrize(
    ("p", "yaw", "right", "nose_up"),
    [((1, 0, 0), 0.0, 0, -1), ((0, 1, 0), 0.0, 1, 0), ((1, 0, 0), np.pi / 2, -1, 0), ((0, 1, 0), np.pi / 2, 0, -1)],
)
def test_the_sticks_go_towards_the_reference_whatever_the_heading(
    p: tuple[float, float, float], yaw: float, right: int, nose_up: int
) -> None:
    still = np.zeros(3)
    reference = Reference(Phase.HOVER, np.array(p, dtype=float), still, still, yaw, 0.0)
    sticks = Cascade(Tuning()).fly(reference, NavState(HOME, HOME, (0.0, 0.0, yaw), HOME), 0.02)
    assert np.sign(np.round([sticks.right, sticks.nose_up], 6)).tolist() == [right, nose_up]


@pytest.mark.parametrize("duration_s", [SHORTEST_S, 20.0, 60.0, 600.0])
def test_the_mission_asks_for_no_jump_and_for_no_more_than_half_the_envelope(duration_s: float) -> None:
    mission = Mission(duration_s, -0.692)
    times = np.linspace(0.0, duration_s, 4001)
    references = [mission.reference_at(t_s) for t_s in times]
    p = np.array([reference.p for reference in references])
    v = np.array([reference.v for reference in references])
    np.testing.assert_allclose(np.diff(p, axis=0), v[:-1] * np.diff(times)[:, None], atol=4 * (times[1] ** 2) + 1e-9)
    assert np.linalg.norm(v[:, :2], axis=1).max() <= 0.81
    assert np.abs(v[:, 2]).max() <= 1.25


def test_given_a_minute_the_square_measures_one_metre() -> None:
    corners = Mission(60.0, -0.692).corners_inW[1:5]
    np.testing.assert_allclose(np.linalg.norm(np.diff(corners, axis=0), axis=1), 1.0)


def test_a_mission_too_short_is_refused() -> None:
    with pytest.raises(OperatorError, match=r"5 s are too short.*at least 15 s"):
        Mission(5.0, -0.7)


def test_the_distance_to_a_path_is_that_to_its_nearest_leg() -> None:
    corners: Array = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    points: Array = np.array([[0.5, 0.2, 0.0], [1.3, 0.5, 0.4], [-3.0, 4.0, 0.0]])
    np.testing.assert_allclose(distance_to_path(points, corners), [0.2, 0.5, 5.0])


def test_a_flight_that_never_left_the_ground_does_not_pass() -> None:
    still = Moment(START_NS, Phase.TAKE_OFF, Mode.WAITING, HOME, np.eye(3), HOME, 0.0)
    verdict = judge(flight_of([still], [], [], Mission(60.0, -0.7).corners_inW, landed=False))
    assert not verdict.passed
    assert '"passed": false' in verdict.to_json()

"""A ball seen by one camera alone is believed less while a turn is open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.rigs import TUNING
from tracker.filter.witness import DOUBT_PX, OPEN_RAD, Quarrel, doubted_alone, too_lonely, unforeseen
from tracker.state import ATTITUDE, State, mean_of, start_covariance
from tracker.types import BallSighting, frozen_array

SIGMA_PX = 0.05


def state(attitude_rad: float) -> State:
    P = start_covariance(TUNING.process, np.zeros(1), 1e-3, attitude_rad)
    return State(0, mean_of(np.zeros(3), np.eye(3)), P)


def seen(*pairs: tuple[int, int], t_ns: int = 0) -> list[BallSighting]:
    cov_px = frozen_array(SIGMA_PX**2 * np.eye(2))
    return [BallSighting(camera, ball, t_ns, frozen_array((320.0, 240.0)), cov_px) for camera, ball in pairs]


ALL_TWICE = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2))
WITH_ONE_ALONE = seen((0, 0), (1, 0), (0, 1), (1, 1), (1, 2))


def test_while_a_turn_is_open_what_one_camera_sees_alone_is_doubted_and_nothing_else() -> None:
    *borne_out, alone = doubted_alone(WITH_ONE_ALONE, state(10.0 * OPEN_RAD))
    assert borne_out == WITH_ONE_ALONE[:4]
    assert alone.cov_px.diagonal() == pytest.approx(DOUBT_PX**2 + SIGMA_PX**2)


def test_while_the_attitude_is_well_known_nothing_is_doubted() -> None:
    assert doubted_alone(WITH_ONE_ALONE, state(0.3 * OPEN_RAD)) == tuple(WITH_ONE_ALONE)


def test_a_camera_that_sees_alone_needs_no_other() -> None:
    sightings = seen((1, 0), (1, 1), (1, 2))
    assert doubted_alone(sightings, state(10.0 * OPEN_RAD)) == tuple(sightings)


def test_a_camera_that_sees_a_single_ball_bears_no_witness_against_one_that_sees_all() -> None:
    """What shows but one ball is as likely lost itself, on a thing of that ball's colour."""
    sightings = seen((0, 0), (0, 1), (0, 2), (1, 2))
    assert doubted_alone(sightings, state(10.0 * OPEN_RAD)) == tuple(sightings)


def test_one_open_axis_is_enough() -> None:
    known = state(0.3 * OPEN_RAD)
    P = known.P.copy()
    P[ATTITUDE.start + 2, ATTITUDE.start + 2] = (10.0 * OPEN_RAD) ** 2
    assert doubted_alone(WITH_ONE_ALONE, replace(known, P=P))[-1].cov_px[0, 0] > 1.0


@pytest.mark.parametrize(
    ("used", "looking", "lonely"),
    [
        (seen((1, 0), (1, 2)), (0, 1), True),
        (seen((1, 0), (1, 1), (1, 2)), (0, 1), False),
        (seen((1, 0), (1, 2)), (1,), False),
        (seen((0, 1), (1, 0), (1, 2)), (0, 1), False),
        (seen((2, 0)), (0, 1, 2), True),
        (seen((1, 0), (2, 2)), (0, 1, 2), True),
        (seen((1, 0), (2, 2)), (1, 2), False),
        (seen((0, 1), (1, 0), (2, 2)), (0, 1, 2, 3), False),
    ],
    ids=[
        "another saw none",
        "all balls",
        "no other looked",
        "another saw one",
        "one of three",
        "two of three cameras",
        "two cameras",
        "three of four cameras",
    ],
)
def test_some_balls_in_one_camera_are_no_pose_while_another_sees_none(
    used: list[BallSighting], looking: tuple[int, ...], lonely: bool
) -> None:
    assert too_lonely(used, looking, 3) is lonely


def test_of_two_cameras_that_contradict_each_other_none_is_believed_the_first_time() -> None:
    quarrel = Quarrel()
    first, second = (seen(*ALL_TWICE, t_ns=t_ns) for t_ns in (0, 66_000_000))
    assert quarrel.is_new(first, first[:3])
    assert quarrel.is_new(first, first[:3])  # the same images looked at again
    assert not quarrel.is_new(second, second[:3])


def test_cameras_that_agree_again_or_change_sides_begin_another_quarrel() -> None:
    quarrel = Quarrel()
    first, second, third, fourth = (seen(*ALL_TWICE, t_ns=k * 66_000_000) for k in range(4))
    assert quarrel.is_new(first, first[:3])
    assert not quarrel.is_new(second, second)
    assert quarrel.is_new(third, third[:3])
    assert quarrel.is_new(fourth, fourth[3:])


def test_one_ball_left_out_and_a_camera_that_two_others_leave_out_are_no_quarrel() -> None:
    one_ball, outvoted = seen((0, 0), (0, 1), (0, 2), (1, 2)), seen(*ALL_TWICE, (2, 0), (2, 1))
    assert not Quarrel().is_new(one_ball, one_ball[:3])
    assert not Quarrel().is_new(outvoted, outvoted[:6])


@pytest.mark.parametrize(
    ("used", "gap_s", "sigmas_m", "anything"),
    [
        (seen((0, 2), (1, 1), (1, 2)), 0.2, (0.13, 0.13, 0.13), True),
        (seen((0, 0), (0, 1), (0, 2)), 0.2, (0.13, 0.13, 0.54), True),
        (seen((0, 0), (0, 1), (0, 2)), 0.2, (0.01, 0.02, 0.54), False),
        (seen((0, 0), (0, 2), (1, 1), (1, 2)), 0.2, (0.13, 0.13, 0.13), False),
        (seen((0, 0), (0, 1), (0, 2)), 0.067, (0.13, 0.13, 0.54), False),
        (seen((0, 1), (1, 0), (1, 1)), 0.067, (0.05, 0.06, 0.08), True),
        (seen((0, 1), (1, 0), (1, 1)), 0.067, (0.01, 0.02, 0.04), False),
    ],
    ids=[
        "track knows no place",
        "one camera",
        "only the depth is open",
        "more than a pose needs",
        "a track's start",
        "some balls each",
        "near where they are expected",
    ],
)
def test_a_pose_s_sightings_are_not_believed_where_they_might_be_anything(
    used: list[BallSighting], gap_s: float, sigmas_m: tuple[float, float, float], anything: bool
) -> None:
    P_ahead = np.zeros((12, 12))
    P_ahead[:3, :3] = np.diag(np.square(sigmas_m))
    assert unforeseen(used, 3, gap_s, P_ahead, reach_m=0.08) is anything

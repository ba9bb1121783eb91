"""A vehicle that was put elsewhere by hand, and a ball that lies in every camera: no single sighting tells which."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.rigs import PROCESS, covariance, ring_rig, sightings, state
from tracker.filter.ekf import Update, update
from tracker.filter.manoeuvre import LEVELS
from tracker.filter.matern import MOTIONS
from tracker.filter.predict import predict
from tracker.maths import so3
from tracker.state import State
from tracker.types import BallSighting, Reason, Rejected, frozen_array

RIG = ring_rig(2)
POINTS_INB = RIG.marker.points_inB
LATER_NS = 66_666_667
QUIET = np.tile(np.eye(LEVELS)[0], (MOTIONS, 1))
KNOWN = replace(
    state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), P=covariance(2e-4, 1e-3, 1e-3, 5e-3)), levels=QUIET
)  # fmt: skip
STRANGE_PX = ((14.0, -9.0), (-11.0, 8.0))  # in either camera: rays that do not meet


def turned_about_two(ball: int, angle_deg: float, known: State = KNOWN) -> State:
    """Turn the vehicle so that one ball moves and the two others stay where they are."""
    first, second = (POINTS_INB[other] for other in range(3) if other != ball)
    axis = (second - first) / np.linalg.norm(second - first)
    turn = so3.exp(np.radians(angle_deg) * axis)
    p_BinW = known.p_BinW + known.R_BtoW @ (first - turn @ first)
    return known.with_parts(p_BinW=p_BinW, R_BtoW=known.R_BtoW @ turn)


def seen(truth: State, cameras: tuple[int, ...] = (0, 1)) -> list[BallSighting]:
    still = truth.with_parts(v_BinW=np.zeros(3), w_BinB=np.zeros(3))
    return list(sightings(still, RIG, [(c, LATER_NS) for c in cameras], 0.1, np.random.default_rng(1)))


def found(shown: list[BallSighting], known: State = KNOWN) -> Update | Rejected:
    return update(predict(known, LATER_NS, PROCESS), tuple(shown), RIG, 0.999)


@pytest.mark.parametrize("ball", range(3))
def test_a_marker_that_was_turned_by_hand_gives_no_pose_by_the_two_balls_that_stayed(ball: int) -> None:
    """The track explains four sightings of six; but the six show the marker as it is."""
    one = found(seen(turned_about_two(ball, 15.0)))
    assert isinstance(one, Rejected)
    assert one.reason is Reason.FRAME_GATE
    assert one.detail == "the marker stands elsewhere, or a ball lies in several cameras"


@pytest.mark.parametrize("angle_deg", [11.0, 13.0, 15.0])
def test_nor_where_the_moved_ball_went_towards_a_camera_which_sees_it_where_it_was(angle_deg: float) -> None:
    """A marker square to camera 1's view: what camera 0 alone sees move, camera 1 bears out nevertheless."""
    across = KNOWN.with_parts(R_BtoW=RIG.cameras[1].R_CtoW)
    shown = seen(turned_about_two(1, angle_deg, across))
    one = found(shown, across)
    assert isinstance(one, Rejected)
    assert one.reason is Reason.FRAME_GATE
    without = found([each for each in shown if (each.camera, each.ball) != (0, 1)], across)
    assert isinstance(without, Update), without
    assert (1, 1) in {(each.camera, each.ball) for each in without.used}


@pytest.mark.parametrize("ball", range(3))
def test_what_lies_in_both_cameras_and_makes_no_marker_is_left_out(ball: int) -> None:
    shown = [
        one._replace(uv_px=frozen_array(one.uv_px + STRANGE_PX[one.camera])) if one.ball == ball else one
        for one in seen(KNOWN)
    ]
    one = found(shown)
    assert isinstance(one, Update), one
    assert {sighting.ball for sighting in one.used} == {0, 1, 2} - {ball}


@pytest.mark.parametrize("ball", range(3))
def test_a_ball_that_only_one_camera_sees_elsewhere_is_left_out(ball: int) -> None:
    """One ray fits some turn of the marker, whatever it is: nothing bears it out against the track."""
    there = {(one.camera, one.ball): one for one in seen(turned_about_two(ball, 15.0))}
    shown = [there[0, ball] if (one.camera, one.ball) == (0, ball) else one for one in seen(KNOWN)]
    one = found([one for one in shown if (one.camera, one.ball) != (1, ball)])
    assert isinstance(one, Update), one
    assert ball not in {sighting.ball for sighting in one.used}

"""The paper's own method: each round by itself."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.drawing import frame
from tests.tracker.rigs import TUNING, at, difference, ring_rig, state
from tracker.start.paper import PaperTracker
from tracker.state import State, mean_of
from tracker.types import Estimate, Event, Frame, Reason, Silence, TrackState

RIG = ring_rig(2)
PERIOD_NS = 66_666_667
FLYING = state(0, (-0.2, -0.1, 0.1), (5.0, -8.0, 130.0), (0.5, 0.2, 0.1), (0.1, -0.1, 0.6))


def tracker() -> PaperTracker:
    return PaperTracker(RIG, TUNING, lambda: 0)


def pair(k: int, truth: State = FLYING, hidden: tuple[int, ...] = ()) -> list[Frame]:
    return [frame(truth, RIG, camera, k * PERIOD_NS, hidden) for camera in (0, 1)]


def flown(one: PaperTracker, events: list[Event]) -> list[Estimate]:
    return [estimate for event in events for estimate in one.step(event).estimates]


def test_every_pair_gives_a_pose_with_velocity_and_rate_from_the_one_before() -> None:
    found = flown(tracker(), [event for k in range(4) for event in pair(k)])
    assert [e.t_ns for e in found] == [k * PERIOD_NS for k in range(4)]
    for estimate in found:
        truth = at(FLYING, estimate.t_ns)
        mean = mean_of(estimate.p_BinW, estimate.R_BtoW, estimate.v_BinW, estimate.w_BinB)
        error = difference(truth, State(estimate.t_ns, mean, FLYING.P))
        assert np.linalg.norm(error[:3]) < 0.004
        assert np.linalg.norm(error[3:6]) < np.radians(3.0)
        if estimate.t_ns:
            assert np.linalg.norm(error[6:9]) < 0.1
            assert np.linalg.norm(error[9:]) < 1.5


def test_the_rate_is_the_bodys_own_with_its_sign() -> None:
    turning = state(0, (0.0, 0.0, 0.1), (10.0, 0.0, 130.0), w_BinB=(0.0, 0.0, 4.0))
    found = flown(tracker(), [event for k in range(4) for event in pair(k, turning)])
    assert np.mean([estimate.w_BinB for estimate in found[1:]], axis=0) == pytest.approx([0.0, 0.0, 4.0], abs=0.6)


def test_its_covariance_is_that_of_many_measurements() -> None:
    """The attitude's covariance goes through the slope of eq. 4-6: against the spread under pixel noise of 0.7 px."""
    one = tracker()
    (estimate,) = flown(one, list(pair(0)))
    sigma_m = np.sqrt(np.diag(estimate.covariance)[:3])
    # 0.7 px are 1.9 mm at 3.18 m; the mean of three balls seen by two cameras at a right angle.
    assert sigma_m == pytest.approx(np.full(3, 0.7 / 1194.3 * 3.18 / np.sqrt(3.0)), rel=0.35)
    sigma_rad = np.sqrt(np.diag(estimate.covariance)[3:6])
    # Two ball ends 160 mm apart, then one against the middle of two 139 mm away; each with 1.9 mm.
    assert sigma_rad.min() > 0.005
    assert sigma_rad.max() < 0.03
    assert np.allclose(estimate.covariance, estimate.covariance.T)
    assert np.linalg.eigvalsh(estimate.covariance).min() > 0.0


def test_a_hidden_ball_gives_no_pose_and_is_named() -> None:
    one = tracker()
    steps = [one.step(event) for event in pair(0, hidden=(1,))]
    assert all(step.estimates == () for step in steps)
    (rejected,) = steps[1].rejections
    assert rejected.reason is Reason.NOT_FOUND
    assert "green" in rejected.detail


def test_after_a_gap_velocity_and_rate_are_unknown_and_said_to_be() -> None:
    one = tracker()
    before = flown(one, [*pair(0), *pair(1)])[-1]
    after = flown(one, list(pair(9)))[0]
    assert before.v_BinW.any()
    assert not after.v_BinW.any()
    assert after.covariance[6, 6] == TUNING.process.initial_speed_m_s**2
    assert after.covariance[9, 9] == TUNING.process.initial_rate_rad_s**2


def test_it_knows_when_it_has_lost_the_vehicle() -> None:
    one = tracker()
    assert one.step(Silence(0)).state is TrackState.SEARCHING
    flown(one, list(pair(0)))
    assert one.step(Silence(200_000_000)).state is TrackState.TRACKING
    assert one.step(Silence(200_000_001)).state is TrackState.LOST


def test_a_marker_on_end_is_singular() -> None:
    upright = state(0, euler_deg=(0.0, 90.0, 0.0))
    one = tracker()
    steps = [one.step(event) for event in pair(0, upright)]
    assert [r.reason for step in steps for r in step.rejections] in ([Reason.SINGULAR], [Reason.NOT_FOUND])


def test_the_frame_that_waits_at_the_end_is_worked_off() -> None:
    one = tracker()
    flown(one, list(pair(0)))
    one.step(pair(1)[0])
    (rejected,) = one.finish().rejections
    assert rejected.reason is Reason.NOT_FOUND

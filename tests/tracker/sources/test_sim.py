"""The simulated source: paths inside the paper's envelope, frames in order, a vehicle that goes on meanwhile."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.rig import Rig
from tracker.sources.paths import PATHS, PathFunction, Pose, motion, scripted_path
from tracker.sources.sim import START_NS, SimSource, SimTiming
from tracker.types import Array, Event, Frame, frozen_array

DT_S = 1e-3
TIMES_S = np.arange(0.0, 16.0, 0.05)
RANDOM = tuple(f"random-{seed}" for seed in range(8))
SMOOTH = (*(name for name in PATHS if name != "protocol"), *RANDOM)
ALL = (*PATHS, *RANDOM)
SLACK = 1.01


@pytest.fixture(scope="module")
def rig() -> Rig:
    return paper_rig()


def ticks() -> int:
    return 0


def path(name: str) -> PathFunction:
    return scripted_path(name, 0).path


def speeds(name: str) -> tuple[Array, Array]:
    """Return velocity (n, 3) [m/s] and body rates (n, 3) [rad/s] along a path, by finite differences."""
    velocity, rate = [], []
    for t_s in TIMES_S:
        (p0, R0), (p1, R1) = (path(name)(t_s + k * DT_S) for k in (0, 1))
        velocity.append((p1 - p0) / DT_S)
        rate.append(so3.log(R0.T @ R1) / DT_S)
    return np.array(velocity), np.array(rate)


@pytest.mark.parametrize("name", SMOOTH)
def test_a_path_keeps_the_papers_speeds(name: str) -> None:
    velocity, _ = speeds(name)
    assert np.linalg.norm(velocity[:, :2], axis=1).max() <= 1.5 * SLACK
    assert np.abs(velocity[:, 2]).max() <= 2.5 * SLACK


@pytest.mark.parametrize("name", RANDOM)
def test_a_random_flight_turns_no_faster_than_the_paper_and_moves_at_all(name: str) -> None:
    velocity, rate = speeds(name)
    assert np.linalg.norm(rate, axis=1).max() <= math.radians(90.0)
    assert np.linalg.norm(velocity, axis=1).max() > 0.4
    assert np.linalg.norm(rate, axis=1).max() > math.radians(20.0)


@pytest.mark.parametrize("name", SMOOTH)
def test_velocity_and_rate_carry_a_pose_on_to_the_next(name: str) -> None:
    """By the classical fourth-order Runge-Kutta rule for the place, and Simpson's mean of the rate for the turn."""
    step = 0.01
    for t_s in (0.5, 1.7, 2.9):
        moved, turned = zip(*(motion(path(name), t_s + share * step) for share in (0.0, 0.5, 1.0)), strict=True)
        (p0, R0), (p1, R1) = path(name)(t_s), path(name)(t_s + step)
        np.testing.assert_allclose(p0 + step * (moved[0] + 4 * moved[1] + moved[2]) / 6.0, p1, atol=1e-9)
        mean = step * (turned[0] + 4 * turned[1] + turned[2]) / 6.0
        np.testing.assert_allclose(R0 @ so3.exp(mean), R1, atol=2e-6)


def test_a_seed_makes_one_flight_and_another_seed_another() -> None:
    first, again, other = (path(name)(1.0)[0] for name in ("random-3", "random-3", "random-4"))
    np.testing.assert_array_equal(first, again)
    assert np.linalg.norm(first - other) > 0.01


@pytest.mark.parametrize("name", ALL)
def test_a_path_keeps_the_papers_tilt(name: str) -> None:
    for t_s in TIMES_S:
        roll, pitch, _ = so3.to_euler(path(name)(t_s)[1])
        assert max(abs(roll), abs(pitch)) <= math.radians(20.0) * SLACK


def test_the_fast_path_reaches_the_papers_limits() -> None:
    velocity, rate = speeds("fast")
    assert np.linalg.norm(velocity[:, :2], axis=1).max() == pytest.approx(1.5, rel=0.02)
    assert np.abs(velocity[:, 2]).max() == pytest.approx(2.5, rel=0.02)
    assert np.abs(rate[:, 2]).max() >= math.radians(85.0)


@pytest.mark.parametrize("name", ALL)
def test_both_cameras_see_every_ball_all_along_a_path(name: str, rig: Rig) -> None:
    for t_s in TIMES_S:
        p_BinW, R_BtoW = path(name)(t_s)
        for camera in rig.cameras:
            uv_px, _ = camera.project(rig.marker.points_inB @ R_BtoW.T + p_BinW)
            assert all(camera.sees(uv, margin_px=6.0) for uv in uv_px)


def test_the_protocol_moves_one_step_a_frame_as_the_paper_did() -> None:
    poses = [PATHS["protocol"](frame / 15.0) for frame in range(20)]
    for frame in range(1, 19):
        (p0, R0), (p1, R1) = poses[frame - 1], poses[frame]
        moved, turned = np.abs(p1 - p0), np.degrees(np.linalg.norm(so3.log(R0.T @ R1)))
        axis = (frame - 1) // 3
        expected = np.zeros(3)
        if axis < 3:
            expected[axis] = 0.05
        np.testing.assert_allclose(moved, expected, atol=1e-12)
        assert turned == pytest.approx((0, 0, 0, 5, 5, 10)[axis], abs=1e-6)
    np.testing.assert_allclose(poses[19][0], poses[0][0])


def test_an_unknown_path_is_refused_with_the_names_of_those_there_are() -> None:
    with pytest.raises(OperatorError, match=r"sim:loop.*hover, square, figure8, protocol, fast, random-SEED"):
        scripted_path("loop", 0)


def source(rig: Rig, offsets_ns: tuple[int, ...] = ()) -> SimSource:
    timing = SimTiming(rate_hz=15.0, duration_s=0.4, offsets_ns=offsets_ns)
    return SimSource(rig, scripted_path("figure8", START_NS), ticks, timing)


def frames(events: SimSource) -> list[Frame]:
    return [event for event in events if isinstance(event, Frame)]


def test_frames_come_in_pairs_at_the_rate_asked_for(rig: Rig) -> None:
    got = frames(source(rig))
    assert [frame.camera for frame in got] == [0, 1] * 6
    assert [frame.t_ns for frame in got[::2]] == [START_NS + round(k * 1e9 / 15) for k in range(6)]
    assert [frame.t_ns for frame in got[1::2]] == [frame.t_ns for frame in got[::2]]


def test_free_running_cameras_are_merged_in_the_order_of_time(rig: Rig) -> None:
    got = frames(source(rig, offsets_ns=(20_000_000, 0)))
    assert [frame.camera for frame in got[:2]] == [1, 0]
    assert all(before.t_ns < after.t_ns for before, after in itertools.pairwise(got))


def test_the_same_seed_gives_the_same_frames(rig: Rig) -> None:
    for one, other in zip(frames(source(rig)), frames(source(rig)), strict=True):
        assert one.image.tobytes() == other.image.tobytes()
        assert not one.image.flags.writeable


class Recorder:
    """A vehicle at rest that notes the times it is asked for."""

    def __init__(self) -> None:
        self.asked: list[int] = []

    def pose_at(self, t_ns: int) -> Pose:
        """Note the time."""
        self.asked.append(t_ns)
        return frozen_array(np.zeros(3)), frozen_array(np.eye(3))


def test_the_vehicle_has_gone_on_by_the_delay_when_a_frame_is_given_out(rig: Rig) -> None:
    vehicle = Recorder()
    events = iter(SimSource(rig, vehicle, ticks, SimTiming(delay_ns=30_000_000)))
    first: Event = next(events)
    assert isinstance(first, Frame)
    assert vehicle.asked[-1] == first.t_ns + 30_000_000
    exposure = vehicle.asked[:-1]
    assert len(exposure) == 5
    assert max(exposure) - min(exposure) == pytest.approx(0.8 * 4e6)
    assert sum(exposure) / 5 == first.t_ns


def test_the_truth_is_the_vehicles(rig: Rig) -> None:
    events = source(rig)
    p_BinW, R_BtoW = events.pose_at(START_NS + 500_000_000)
    np.testing.assert_array_equal(p_BinW, PATHS["figure8"](0.5)[0])
    np.testing.assert_array_equal(R_BtoW, PATHS["figure8"](0.5)[1])


@pytest.mark.parametrize(
    ("timing", "message"),
    [
        (SimTiming(rate_hz=0.0), "rate_hz 0 must be positive"),
        (SimTiming(duration_s=math.nan), "duration_s nan must be positive"),
        (SimTiming(offsets_ns=(0,)), "1 offsets for 2 cameras"),
        (SimTiming(offsets_ns=(0, 70_000_000)), "offsets_ns must lie"),
    ],
)
def test_a_timing_that_cannot_be_is_refused(timing: SimTiming, message: str, rig: Rig) -> None:
    with pytest.raises(OperatorError, match=message):
        SimSource(rig, Recorder(), ticks, timing)

"""What is packed, read back by a parser that is not ours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.dialect import Encoder, Identity
from bridge.ned import NedFrame, pose_jacobian, rotation_from_room, turned_triangle
from bridge.pack import MESSAGES, Packer
from tests.bridge.estimates import estimate, random_covariance
from tests.bridge.mavlink_by_hand import ByHand, parse
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.types import Array, Estimate, frozen_array

Floats = Sequence[float]
DIAGONAL = (0, 6, 11, 15, 18, 20)
IDENTITY = Identity(7)
Z_UP = np.array([0.0, 0.0, 1.0])


def sent(name: str, estimate: Estimate, room_yaw_deg: float = 0.0) -> ByHand:
    message = Packer(room_yaw_deg).messages(estimate, [name])[name]
    (frame,) = parse(Encoder(IDENTITY)(message, 5))
    return frame


def numbers(frame: ByHand, *names: str) -> list[float]:
    return [cast(float, frame.fields[name]) for name in names]


def vector(frame: ByHand, name: str) -> list[float]:
    return cast("list[float]", frame.fields[name])


def unpacked(upper: list[float]) -> Array:
    """Return the symmetric (6, 6) of a 21-long upper triangle."""
    matrix = np.zeros((6, 6))
    matrix[np.triu_indices(6)] = upper
    return np.asarray(matrix + np.triu(matrix, 1).T)


@pytest.mark.parametrize(
    ("room_yaw_deg", "p_BinW", "p_BinN"),
    [
        (0.0, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),  # along the room's x: north
        (0.0, (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)),  # along y, to the left: west
        (0.0, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)),  # up: negative down
        (90.0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),  # the room's x points east
        (90.0, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),  # then y points north
        (180.0, (1.0, 2.0, 3.0), (-1.0, 2.0, -3.0)),
    ],
)
@pytest.mark.parametrize("name", ["VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP"])
def test_a_place_in_the_room_is_sent_north_east_down(
    name: str, room_yaw_deg: float, p_BinW: Floats, p_BinN: Floats
) -> None:
    frame = sent(name, estimate(p_BinW=p_BinW), room_yaw_deg)
    assert numbers(frame, "x", "y", "z") == pytest.approx(p_BinN, abs=1e-6)


@pytest.mark.parametrize(
    ("room_yaw_deg", "theta_deg", "euler_deg"),
    [
        (0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        (0.0, (0.0, 0.0, -90.0), (0.0, 0.0, 90.0)),  # clockwise from above is yaw to the right
        (0.0, (0.0, 0.0, 30.0), (0.0, 0.0, -30.0)),
        (0.0, (20.0, 0.0, 0.0), (20.0, 0.0, 0.0)),  # about x forward, either way: right side down
        (0.0, (0.0, 20.0, 0.0), (0.0, -20.0, 0.0)),  # about y left: nose down
        (90.0, (0.0, 0.0, 0.0), (0.0, 0.0, 90.0)),  # nose along a room's x that points east
        (90.0, (0.0, 0.0, -45.0), (0.0, 0.0, 135.0)),
        (-30.0, (0.0, 0.0, 0.0), (0.0, 0.0, -30.0)),
    ],
)
def test_a_turn_of_the_body_is_sent_as_roll_right_pitch_up_yaw_right(
    room_yaw_deg: float, theta_deg: Floats, euler_deg: Floats
) -> None:
    turned = estimate(R_BtoW=so3.exp(np.radians(theta_deg)))
    frame = sent("VISION_POSITION_ESTIMATE", turned, room_yaw_deg)
    assert np.degrees(numbers(frame, "roll", "pitch", "yaw")) == pytest.approx(euler_deg, abs=1e-4)
    roll, pitch, yaw = np.radians(euler_deg)
    q = vector(sent("ATT_POS_MOCAP", turned, room_yaw_deg), "q")
    assert q == pytest.approx(so3.quaternion(so3.from_euler(roll, pitch, yaw)).tolist(), abs=1e-6)


def test_a_quarter_yaw_to_the_right_is_the_textbook_quaternion() -> None:
    q = vector(sent("ATT_POS_MOCAP", estimate(R_BtoW=so3.exp(-math.pi / 2 * Z_UP))), "q")
    assert q == pytest.approx([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)], abs=1e-6)


def test_every_field_of_the_pose_messages_is_filled() -> None:
    generator = np.random.default_rng(1)
    covariance = random_covariance(generator, 12)
    given_estimate = estimate(
        1_234_567_890_999, (1, 2, 3), so3.exp(np.array([0.1, 0.2, 0.3])), (1, 1, 1), covariance, 9
    )
    vision, mocap, speed = (sent(name, given_estimate) for name in MESSAGES[:3])
    assert vision.fields["usec"] == mocap.fields["time_usec"] == speed.fields["usec"] == 1_234_567_890
    assert vision.fields["reset_counter"] == speed.fields["reset_counter"] == 9
    assert vision.fields["covariance"] == mocap.fields["covariance"]
    assert all(value != 0 for value in vector(vision, "covariance"))
    assert (len(vision.raw), len(mocap.raw), len(speed.raw)) == (129, 132, 69)


def test_records_hold_exactly_the_floats_on_the_wire() -> None:
    given_estimate = estimate(p_BinW=(0.1, 0.2, 0.3), R_BtoW=so3.exp(np.array([0.1, 0.2, 0.3])))
    for name, message in Packer(33.0).messages(given_estimate, MESSAGES).items():
        (frame,) = parse(Encoder(IDENTITY)(message, 0))
        assert frame.name == name
        assert frame.fields == dict(message.fields)


def test_variances_stand_at_slots_0_6_11_15_18_20() -> None:
    """Level, nose north: x y z and roll pitch yaw errors are the room's and the body's own, up to sign."""
    variances = [1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 6e-4]
    covariance = np.diag(variances + [1e-2] * 6)
    covariance[0, 1] = covariance[1, 0] = 2e-5  # x and y
    covariance[0, 5] = covariance[5, 0] = 3e-5  # x and yaw
    covariance[3, 5] = covariance[5, 3] = 4e-5  # roll and yaw
    upper = vector(sent("VISION_POSITION_ESTIMATE", estimate(covariance=covariance)), "covariance")
    expected = np.zeros(21)
    expected[list(DIAGONAL)] = variances
    expected[1], expected[5], expected[17] = -2e-5, -3e-5, -4e-5  # y, pitch and yaw change sign, x and roll do not
    assert upper == pytest.approx(expected.tolist(), rel=1e-6, abs=1e-12)


def test_a_room_turned_by_a_quarter_swaps_north_and_east_variances() -> None:
    covariance = np.diag([1e-4, 2e-4, 3e-4] + [1e-3] * 9)
    upper = vector(sent("ATT_POS_MOCAP", estimate(covariance=covariance), 90.0), "covariance")
    assert [upper[k] for k in DIAGONAL[:3]] == pytest.approx([2e-4, 1e-4, 3e-4])


def test_velocity_is_sent_north_east_down_with_its_covariance() -> None:
    covariance = np.diag([1e-4] * 6 + [1e-2, 4e-2, 9e-2] + [1.0] * 3)
    covariance[6, 8] = covariance[8, 6] = 5e-3
    frame = sent("VISION_SPEED_ESTIMATE", estimate(v_BinW=(1, 2, 3), covariance=covariance), 90.0)
    assert numbers(frame, "x", "y", "z") == pytest.approx((2, 1, -3), abs=1e-6)
    assert vector(frame, "covariance") == pytest.approx([4e-2, 0, 0, 0, 1e-2, -5e-3, 0, -5e-3, 9e-2], abs=1e-8)


def test_odometry_speaks_the_one_pair_of_frames_that_both_autopilots_take() -> None:
    frame = sent("ODOMETRY", estimate(covariance=np.eye(12) * 1e-4))
    assert (frame.fields["frame_id"], frame.fields["child_frame_id"]) == (20, 12)  # LOCAL_FRD, BODY_FRD
    assert frame.fields["estimator_type"] == 2  # VISION: PX4 never reads MOCAP's
    assert frame.fields["quality"] == 90  # one sigma of 10 mm
    worthless = sent("ODOMETRY", estimate(covariance=np.eye(12)))
    assert worthless.fields["quality"] == 1  # 0 would say unknown, -1 failed


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(-180, 180))
def test_odometrys_twist_is_the_motion_in_the_bodys_own_axes(seed: int, room_yaw_deg: float) -> None:
    """Its covariance is that of finite differences: velocity and attitude errors both turn into it."""
    rng = np.random.default_rng(seed)
    R_BtoW, v_BinW, w_BinB = so3.exp(rng.normal(size=3)), rng.normal(size=3), rng.normal(size=3)
    covariance = random_covariance(rng, 12)
    given_estimate = replace(estimate(R_BtoW=R_BtoW, v_BinW=v_BinW, covariance=covariance), w_BinB=frozen_array(w_BinB))
    odometry = sent("ODOMETRY", given_estimate, room_yaw_deg)
    vision, speed = (
        sent(name, given_estimate, room_yaw_deg) for name in ("VISION_POSITION_ESTIMATE", "VISION_SPEED_ESTIMATE")
    )
    R_FtoN = so3.from_euler(*numbers(vision, "roll", "pitch", "yaw"))
    np.testing.assert_allclose(R_FtoN @ numbers(odometry, "vx", "vy", "vz"), numbers(speed, "x", "y", "z"), atol=1e-5)
    flip = np.array([1.0, -1.0, -1.0])
    np.testing.assert_allclose(numbers(odometry, "rollspeed", "pitchspeed", "yawspeed"), flip * w_BinB, atol=1e-6)
    assert vector(odometry, "pose_covariance") == vector(vision, "covariance")

    def twist(error: Array) -> Array:
        v_BinB = (R_BtoW @ so3.exp(error[3:6])).T @ (v_BinW + error[6:9])
        return np.concatenate((flip * v_BinB, flip * (w_BinB + error[9:])))

    J = np.array([twist(1e-6 * axis) - twist(-1e-6 * axis) for axis in np.eye(12)]).T / 2e-6
    np.testing.assert_allclose(
        unpacked(vector(odometry, "velocity_covariance")), J @ covariance @ J.T, rtol=1e-4, atol=1e-8
    )


angles = st.floats(-math.pi, math.pi)


@settings(deadline=None)
@given(roll=angles, pitch=st.floats(-1.5, 1.5), yaw=angles, room_yaw=angles)
def test_the_pose_jacobian_is_that_of_finite_differences(
    roll: float, pitch: float, yaw: float, room_yaw: float
) -> None:
    R_WtoN = rotation_from_room(room_yaw)
    flip = np.diag([1.0, -1.0, -1.0])
    R_BtoW = R_WtoN.T @ so3.from_euler(roll, pitch, yaw) @ flip

    def pose(error: Array) -> Array:
        euler = so3.to_euler(R_WtoN @ R_BtoW @ so3.exp(error[3:]) @ flip)
        return np.concatenate((R_WtoN @ error[:3], euler))

    step = 1e-6
    differences = np.array([pose(step * axis) - pose(-step * axis) for axis in np.eye(6)]).T
    differences[3:] = np.mod(differences[3:] + math.pi, 2 * math.pi) - math.pi
    cos_squared = math.cos(pitch) ** 2
    np.testing.assert_allclose(differences / (2 * step), pose_jacobian(R_WtoN, roll, pitch), atol=1e-6 / cos_squared)


@given(st.integers(0, 2**32 - 1))
def test_a_covariance_is_turned_as_matrices_turn_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    J, covariance = rng.normal(size=(6, 6)), random_covariance(rng, 12)
    expected = (J @ covariance[:6, :6] @ J.T)[np.triu_indices(6)]
    np.testing.assert_allclose(turned_triangle(J, covariance), expected, rtol=1e-9, atol=1e-9)


@settings(deadline=None, max_examples=50)
@given(
    p_BinW=st.lists(st.floats(-20, 20), min_size=3, max_size=3),
    theta=st.lists(st.floats(-1.7, 1.7), min_size=3, max_size=3),
    room_yaw_deg=st.floats(-360, 360),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_pose_comes_back_from_the_wire(p_BinW: Floats, theta: Floats, room_yaw_deg: float, seed: int) -> None:
    R_BtoW = so3.exp(np.array(theta))
    covariance = random_covariance(np.random.default_rng(seed), 12)
    given_estimate = estimate(p_BinW=p_BinW, R_BtoW=R_BtoW, covariance=covariance)
    vision = sent("VISION_POSITION_ESTIMATE", given_estimate, room_yaw_deg)
    mocap = sent("ATT_POS_MOCAP", given_estimate, room_yaw_deg)
    R_WtoN = NedFrame(room_yaw_deg).R_WtoN
    np.testing.assert_allclose(R_WtoN.T @ numbers(vision, "x", "y", "z"), p_BinW, atol=1e-5)
    R_FtoN = so3.from_euler(*numbers(vision, "roll", "pitch", "yaw"))
    np.testing.assert_allclose(R_WtoN.T @ R_FtoN @ np.diag([1, -1, -1]), R_BtoW, atol=1e-5)
    q = np.array(vector(mocap, "q"))
    assert abs(1.0 - float(np.linalg.norm(q))) < 1e-6
    assert abs(float(q @ so3.quaternion(R_FtoN))) == pytest.approx(1.0, abs=1e-6)
    assert np.linalg.eigvalsh(unpacked(vector(vision, "covariance"))).min() > 0


@pytest.mark.parametrize("pitch_deg", [-90.0, -89.99, 89.5, 89.999, 90.0])
@pytest.mark.parametrize("seed", range(10))
def test_a_covariance_at_the_pole_of_the_euler_angles_is_large_and_positive_definite(
    pitch_deg: float, seed: int
) -> None:
    R_BtoW = so3.from_euler(0.3, math.radians(pitch_deg), 0.7)
    covariance = random_covariance(np.random.default_rng(seed), 12)
    frame = sent("VISION_POSITION_ESTIMATE", estimate(R_BtoW=R_BtoW, covariance=covariance))
    matrix = unpacked(vector(frame, "covariance"))
    scale = np.sqrt(np.diag(matrix))
    assert np.linalg.eigvalsh(matrix / np.outer(scale, scale)).min() > 0
    assert matrix[3, 3] > 1.0
    assert matrix[5, 5] > 1.0


def test_a_heading_that_is_no_number_is_refused() -> None:
    with pytest.raises(OperatorError, match="room_yaw_deg"):
        Packer(math.nan)

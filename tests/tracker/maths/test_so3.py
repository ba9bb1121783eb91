"""The laws of rotations, against scipy's own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tracker.maths import so3
from tracker.types import Array

ANGLES = st.floats(-math.pi, math.pi)
STEP = 1e-6


@st.composite
def rotation_vectors(draw: st.DrawFn, longest: float) -> Array:
    """Draw a direction and a length, from none at all up to the longest."""
    direction = draw(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 0.1))
    length = draw(st.one_of(st.floats(0.0, longest), st.floats(-12.0, 0.0).map(lambda x: longest * 10.0**x)))
    return np.asarray(np.array(direction) / np.linalg.norm(direction) * length)


@given(theta=rotation_vectors(3.0 * math.pi), v=rotation_vectors(5.0))
def test_exp_is_the_rotation_by_the_vector_and_hat_the_cross_product(theta: Array, v: Array) -> None:
    assert np.allclose(so3.exp(theta), Rotation.from_rotvec(theta).as_matrix(), atol=1e-12)
    assert np.allclose(so3.hat(theta) @ v, np.cross(theta, v), atol=1e-12)


@given(rotation_vectors(math.pi - 1e-6))
def test_log_undoes_exp_for_all_but_half_turns(theta: Array) -> None:
    assert np.allclose(so3.log(so3.exp(theta)), theta, atol=1e-9)


@given(rotation_vectors(3.0 * math.pi))
def test_exp_undoes_log_for_half_turns_too(theta: Array) -> None:
    R = Rotation.from_rotvec(theta).as_matrix()
    assert np.linalg.norm(so3.log(R)) <= math.pi + 1e-12
    assert np.allclose(so3.exp(so3.log(R)), R, atol=1e-9)


@pytest.mark.parametrize("axis", np.eye(3))
def test_a_half_turn_has_a_logarithm_of_length_pi(axis: Array) -> None:
    found = so3.log(2.0 * np.outer(axis, axis) - np.eye(3))
    assert np.allclose(np.abs(found), math.pi * axis, atol=1e-12)


@given(rotation_vectors(3.0 * math.pi))
def test_the_quaternion_has_unit_length_a_scalar_part_that_is_not_negative_and_turns_as_R_does(theta: Array) -> None:
    R = so3.exp(theta)
    q = so3.quaternion(R)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-12)
    assert q[0] >= 0.0
    assert np.allclose(Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix(), R, atol=1e-9)


@given(rotation_vectors(3.0), rotation_vectors(1.0))
def test_the_right_jacobian_is_that_of_finite_differences(theta: Array, direction: Array) -> None:
    """exp(theta + d) = exp(theta) exp(J_r d): central differences leave the square of the step."""
    ahead, behind = so3.exp(theta + STEP * direction), so3.exp(theta - STEP * direction)
    measured = Rotation.from_matrix(behind.T @ ahead).as_rotvec() / (2.0 * STEP)
    assert np.allclose(so3.right_jacobian(theta) @ direction, measured, atol=1e-8)


@given(ANGLES, st.floats(-math.pi / 2, math.pi / 2), ANGLES)
def test_euler_angles_are_those_of_z_then_y_then_x(roll: float, pitch: float, yaw: float) -> None:
    assert np.allclose(
        so3.from_euler(roll, pitch, yaw), Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix(), atol=1e-12
    )


@given(ANGLES, st.floats(-1.55, 1.55), ANGLES)
def test_euler_angles_come_back(roll: float, pitch: float, yaw: float) -> None:
    found = so3.to_euler(so3.from_euler(roll, pitch, yaw))
    assert found[1] == pytest.approx(pitch, abs=1e-9)
    assert math.cos(found[0] - roll) == pytest.approx(1.0, abs=1e-9)
    assert math.cos(found[2] - yaw) == pytest.approx(1.0, abs=1e-9)


@given(ANGLES, st.sampled_from([-1.0, 1.0]), st.floats(0.0, 1e-6), ANGLES)
def test_at_the_pole_the_angles_still_give_the_rotation(roll: float, side: float, off: float, yaw: float) -> None:
    R = so3.from_euler(roll, side * (math.pi / 2.0 - off), yaw)
    assert np.allclose(so3.from_euler(*so3.to_euler(R)), R, atol=5e-6)

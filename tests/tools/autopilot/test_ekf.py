"""The simulated autopilot's filter: its slopes by finite differences, its gates, and when its failsafe acts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tools.simulate.autopilot import ekf
from tools.simulate.autopilot.failsafe import EkfFailsafe
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.navigation import Variances
from tools.simulate.dynamics import GRAVITY
from tracker.maths import so3
from tracker.types import Array

DT_S = 0.02
SMALL = 1e-6
MOVING = Increment(DT_S, np.array([0.01, -0.02, 0.03]), np.array([0.05, -0.03, -0.2]))


def some_state() -> ekf.FilterState:
    state = ekf.started(np.array([1.0, -2.0, 0.5]), so3.from_euler(0.2, -0.3, 1.1))
    return replace(state, v_BinN=np.array([0.3, 0.2, -0.1]), gyro_bias=np.array([0.01, 0.02, -0.01]))


def moved(state: ekf.FilterState, dx: Array) -> ekf.FilterState:
    return replace(
        state,
        p_BinN=state.p_BinN + dx[0:3],
        v_BinN=state.v_BinN + dx[3:6],
        R_FtoN=state.R_FtoN @ so3.exp(dx[6:9]),
        gyro_bias=state.gyro_bias + dx[9:12],
        accel_bias=state.accel_bias + dx[12:15],
    )


def difference(a: ekf.FilterState, b: ekf.FilterState) -> Array:
    turn = so3.log(b.R_FtoN.T @ a.R_FtoN)
    parts = (a.p_BinN - b.p_BinN, a.v_BinN - b.v_BinN, turn, a.gyro_bias - b.gyro_bias, a.accel_bias - b.accel_bias)
    return np.concatenate(parts)


def test_the_predicted_covariance_follows_the_motions_own_slope() -> None:
    """With P = I the prediction gives F F' and noise; F by central differences agrees to second order in dt."""
    state = replace(some_state(), covariance=np.eye(15))
    F = np.empty((15, 15))
    for k in range(15):
        dx = np.zeros(15)
        dx[k] = SMALL
        ahead, behind = (ekf.carried(moved(state, sign * dx), MOVING) for sign in (1.0, -1.0))
        F[:, k] = difference(ahead, behind) / (2.0 * SMALL)
    without_noise = (
        ekf.predicted(state, MOVING).covariance
        - ekf.predicted(replace(state, covariance=np.zeros((15, 15))), MOVING).covariance
    )
    np.testing.assert_allclose(without_noise, F @ F.T, atol=5e-3)


@pytest.mark.parametrize("which", ["position", "velocity", "yaw"])
def test_the_slope_of_each_measurement_agrees_with_differences(which: str) -> None:
    state = some_state()

    def innovation(at: ekf.FilterState) -> ekf.Innovation:
        match which:
            case "position":
                return ekf.position_innovation(at, np.zeros(3), 0.1)
            case "velocity":
                return ekf.velocity_innovation(at, np.zeros(3), 0.1)
            case _:
                return ekf.yaw_innovation(at, 0.9, 0.1)

    H = innovation(state).H
    for k in range(15):
        dx = np.zeros(15)
        dx[k] = SMALL
        ahead, behind = (innovation(moved(state, sign * dx)).difference for sign in (1.0, -1.0))
        np.testing.assert_allclose((behind - ahead) / (2.0 * SMALL), H[:, k], atol=1e-6)


def test_a_correction_takes_uncertainty_away_and_never_adds_any() -> None:
    state = some_state()
    better = ekf.corrected(state, ekf.position_innovation(state, state.p_BinN + 0.01, 0.05))
    assert np.linalg.eigvalsh(state.covariance - better.covariance).min() > -1e-12
    assert np.linalg.norm(better.p_BinN - state.p_BinN) > 0.0


def test_a_vehicle_at_rest_reads_its_tilt_from_its_accelerometer() -> None:
    R_FtoN = so3.from_euler(0.1, -0.2, 0.7)
    felt_inF = R_FtoN.T @ np.array([0.0, 0.0, -GRAVITY * DT_S])
    np.testing.assert_allclose(ekf.levelled(felt_inF, 0.7), R_FtoN, atol=1e-12)


def acts(variances: Variances, seconds: float, *, has_position: bool = True) -> bool:
    """Say whether the failsafe acts on ratios that last, after all was well."""
    failsafe = EkfFailsafe()
    failsafe.look(0, Variances(), has_position=True, threshold=0.8)
    for k in range(1, round(10 * seconds) + 1):
        failsafe.look(100 * k, variances, has_position, 0.8)
    return failsafe.acts


@pytest.mark.parametrize(
    ("variances", "expected"),
    [
        (Variances(position=5.0), False),  # alone it is silent, which is why velocity should be sent
        (Variances(compass=5.0), False),
        (Variances(velocity=1.0), False),
        (Variances(velocity=1.7), True),
        (Variances(velocity=1.0, position=1.0), True),
        (Variances(compass=1.0, position=1.0), True),
    ],
)
def test_the_failsafe_wants_two_bad_ratios_or_a_very_bad_velocity(variances: Variances, *, expected: bool) -> None:
    assert acts(variances, 3.0) is expected


def test_the_failsafe_acts_after_a_second_without_position_and_not_before() -> None:
    assert not acts(Variances(), 0.9, has_position=False)
    assert acts(Variances(), 1.0, has_position=False)

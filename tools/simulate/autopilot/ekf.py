"""The autopilot's Kalman filter as pure steps: an IMU carried forward, corrected by position, velocity and heading.

Frames: N north-east-down, F the body's forward-right-down. Fifteen error states: position, velocity, attitude (a
rotation vector in F), gyro bias, accelerometer bias.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tools.simulate.autopilot.imu import Increment
from tools.simulate.dynamics import GRAVITY
from tracker.maths import so3
from tracker.types import Array

_P, _V, _R, _BG, _BA = (slice(k, k + 3) for k in (0, 3, 6, 9, 12))
_GRAVITY_inN = np.array([0.0, 0.0, GRAVITY])
_LEAST_COS_PITCH = 0.1
# Process noise, one sigma over one second: what ArduPilot assumes of an IMU on a vibrating vehicle (EK3_GYRO_P_NSE
# 0.015, EK3_ACC_P_NSE 0.35 a sample of 10 ms), and how fast biases wander.
_SPEED_NOISE, _TURN_NOISE, _GYRO_WALK, _ACCEL_WALK = 0.035, 0.0015, 1e-4, 3e-3
# One sigma at the start: standing still, level by the accelerometer, heading and place just read.
_START = np.repeat([0.1, 0.1, 0.03, 5e-3, 0.05], 3)


@dataclass(frozen=True, slots=True, eq=False)
class FilterState:
    """p_BinN, v_BinN (3,); R_FtoN (3, 3); gyro_bias [rad/s], accel_bias [m/s^2] in F; covariance (15, 15)."""

    p_BinN: Array
    v_BinN: Array
    R_FtoN: Array
    gyro_bias: Array
    accel_bias: Array
    covariance: Array


def started(p_BinN: Array, R_FtoN: Array) -> FilterState:
    """Return the filter of a vehicle that stands still at p_BinN."""
    zero = np.zeros(3)
    return FilterState(p_BinN, zero, R_FtoN, zero, zero, np.diag(_START**2))


def levelled(speed_inF: Array, yaw: float) -> Array:
    """Return R_FtoN (3, 3) of a vehicle at rest from what its accelerometer shows, and its heading [rad]."""
    up_inF = speed_inF / np.linalg.norm(speed_inF)
    pitch = math.asin(float(np.clip(up_inF[0], -1.0, 1.0)))
    roll = math.atan2(-float(up_inF[1]), -float(up_inF[2]))
    return so3.from_euler(roll, pitch, yaw)


def carried(state: FilterState, increment: Increment) -> FilterState:
    """Carry position, velocity and attitude on by one IMU increment; the covariance stays."""
    dt = increment.dt_s
    speed_inN = state.R_FtoN @ (increment.speed_inF - state.accel_bias * dt) + _GRAVITY_inN * dt
    turn = increment.turn_inF - state.gyro_bias * dt
    p_BinN = state.p_BinN + (state.v_BinN + 0.5 * speed_inN) * dt
    return replace(state, p_BinN=p_BinN, v_BinN=state.v_BinN + speed_inN, R_FtoN=state.R_FtoN @ so3.exp(turn))


def predicted(state: FilterState, increment: Increment) -> FilterState:
    """Carry state and covariance on by one IMU increment.

    Source: with R = R_hat exp(theta), first order in dt:
        p' += v dt,  v' += -R (dv x) theta - R dt b_a,  theta' = exp(dtheta)' theta - dt b_g.
    """
    dt = increment.dt_s
    F = np.eye(15)
    F[_P, _V] = dt * np.eye(3)
    F[_V, _R] = -state.R_FtoN @ so3.hat(increment.speed_inF - state.accel_bias * dt)
    F[_V, _BA] = -state.R_FtoN * dt
    F[_R, _R] = so3.exp(increment.turn_inF - state.gyro_bias * dt).T
    F[_R, _BG] = -dt * np.eye(3)
    noise = np.repeat([0.0, _SPEED_NOISE, _TURN_NOISE, _GYRO_WALK, _ACCEL_WALK], 3) ** 2 * dt
    covariance = F @ state.covariance @ F.T + np.diag(noise)
    return replace(carried(state, increment), covariance=covariance)


@dataclass(frozen=True, slots=True, eq=False)
class Innovation:
    """What a measurement says against what was expected: its rows of H (m, 15), difference (m,), variance each (m,)."""

    H: Array
    difference: Array
    variance: Array

    def spread(self, state: FilterState) -> Array:
        """Return the expected variance of each difference (m,)."""
        return np.asarray(np.einsum("ij,jk,ik->i", self.H, state.covariance, self.H) + self.variance)

    def ratio(self, state: FilterState, gate: float, rows: slice) -> float:
        """Return the sum of squares over what the gate allows: sums of several variances, as EKF3 builds it."""
        squares = float((self.difference[rows] ** 2).sum())
        return squares / (gate**2 * float(self.spread(state)[rows].sum()))


def position_innovation(state: FilterState, p_BinN: Array, sigma_m: float) -> Innovation:
    """Compare with a measured position."""
    return Innovation(np.eye(15)[_P], p_BinN - state.p_BinN, np.full(3, sigma_m**2))


def velocity_innovation(state: FilterState, v_BinN: Array, sigma_m_s: float) -> Innovation:
    """Compare with a measured velocity."""
    return Innovation(np.eye(15)[_V], v_BinN - state.v_BinN, np.full(3, sigma_m_s**2))


def yaw_innovation(state: FilterState, yaw: float, sigma: float) -> Innovation:
    """Compare with a measured heading [rad].

    Source: the yaw row of the Z-Y-X rate matrix (Diebel 2006, eq. 76): d yaw = (0, sin roll, cos roll) / cos pitch.
    """
    roll, pitch, now = so3.to_euler(state.R_FtoN)
    cosine = max(math.cos(pitch), _LEAST_COS_PITCH)
    H = np.zeros((1, 15))
    H[0, _R] = 0.0, math.sin(roll) / cosine, math.cos(roll) / cosine
    return Innovation(H, np.array([math.remainder(yaw - now, 2.0 * math.pi)]), np.array([sigma**2]))


def corrected(state: FilterState, innovation: Innovation) -> FilterState:
    """Fuse a measurement.

    Source: the Kalman update in Joseph's form, P = (I - K H) P (I - K H)' + K R K'.
    """
    H, noise = innovation.H, np.diag(innovation.variance)
    PHt = state.covariance @ H.T
    K = np.linalg.solve(H @ PHt + noise, PHt.T).T
    dx = K @ innovation.difference
    A = np.eye(15) - K @ H
    return FilterState(
        state.p_BinN + dx[_P],
        state.v_BinN + dx[_V],
        state.R_FtoN @ so3.exp(dx[_R]),
        state.gyro_bias + dx[_BG],
        state.accel_bias + dx[_BA],
        A @ state.covariance @ A.T + K @ noise @ K.T,
    )

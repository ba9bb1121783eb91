"""The vehicle's state, its error, and how both go on in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker import so3
from tracker.types import Array

POSITION, ATTITUDE, VELOCITY, RATE = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)


@dataclass(frozen=True, slots=True)
class Process:
    """How briskly the vehicle manoeuvres, from its envelope and not from any recording.

    acceleration_m_s2, angular_acceleration_rad_s2: one sigma of what a manoeuvre reaches on each axis.
    manoeuvre_s: how long it keeps one acceleration.
    initial_speed_m_s, initial_rate_rad_s: one sigma at first sight, on each axis.
    """

    acceleration_m_s2: float
    angular_acceleration_rad_s2: float
    manoeuvre_s: float
    initial_speed_m_s: float
    initial_rate_rad_s: float


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Nominal state and covariance at t_ns.

    p_BinW (3,) [m], R_BtoW (3, 3), v_BinW (3,) [m/s], w_BinB (3,) [rad/s]; P (12, 12) of the errors in the order
    position (W), rotation vector (B, R = R_hat exp(theta)), velocity (W), rate (B).
    """

    t_ns: int
    p_BinW: Array
    R_BtoW: Array
    v_BinW: Array
    w_BinB: Array
    P: Array

    def moved(self, dx: Array) -> State:
        """Return the state with the error dx (12,) put in; the covariance stays as it is."""
        return State(
            self.t_ns,
            self.p_BinW + dx[POSITION],
            self.R_BtoW @ so3.exp(dx[ATTITUDE]),
            self.v_BinW + dx[VELOCITY],
            self.w_BinB + dx[RATE],
            self.P,
        )


def transition(w_BinB: Array, dt: float) -> Array:
    """Return F (12, 12), d error(t + dt) / d error(t), for constant velocity and constant body rate.

    Source: R exp(theta) exp(w dt) = R exp(w dt) exp(exp(-w dt) theta), and
        exp((w + d) dt) = exp(w dt) exp(J_r(w dt) d dt) to first order in theta and d.
    """
    F = np.eye(12)
    F[POSITION, VELOCITY] = dt * np.eye(3)
    turn = w_BinB * dt
    F[ATTITUDE, ATTITUDE] = so3.exp(-turn)
    F[ATTITUDE, RATE] = so3.right_jacobian(turn) * dt
    return F


def process_noise(process: Process, dt: float) -> Array:
    """Return Q (12, 12) gathered over dt.

    Source: white acceleration of spectral density q = a^2 T integrated once and twice (Bar-Shalom, Li, Kirubarajan,
        "Estimation with Applications to Tracking and Navigation", 6.2.2), on every axis of both pairs; the same for
        any split of dt, so frames of free-running cameras add up to what one long step gives.
    """
    Q = np.zeros((12, 12))
    once, twice, thrice = dt, dt * dt / 2.0, dt**3 / 3.0
    eye = np.eye(3)
    for lower, upper, sigma in (
        (POSITION, VELOCITY, process.acceleration_m_s2),
        (ATTITUDE, RATE, process.angular_acceleration_rad_s2),
    ):
        q = sigma**2 * process.manoeuvre_s
        Q[lower, lower] = q * thrice * eye
        Q[lower, upper] = Q[upper, lower] = q * twice * eye
        Q[upper, upper] = q * once * eye
    return Q


def coasted(state: State, t_ns: int) -> State:
    """Return the nominal state at t_ns at constant velocity and body rate, covariance untouched."""
    dt = (t_ns - state.t_ns) * 1e-9
    return State(
        t_ns,
        state.p_BinW + dt * state.v_BinW,
        state.R_BtoW @ so3.exp(dt * state.w_BinB),
        state.v_BinW,
        state.w_BinB,
        state.P,
    )

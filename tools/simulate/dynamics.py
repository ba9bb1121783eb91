"""The helicopter's equations of motion as a compiled loop: at 400 steps a second NumPy's calls would cost half a core.

State x (15,): position and velocity in W, rotation vector since the step's start, rates in B, the rotor's tilt about x
and y, lift. Frames: W is the room (z up), B the body (x forward, y left, z up).
"""

from __future__ import annotations

import math

import numpy as np

from tracker.maths.compiled import compiled
from tracker.maths.so3_compiled import turn_into
from tracker.types import Array

P, V, THETA, W, CYCLIC, LIFT = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 14), 14
STATE_SIZE = 15
GRAVITY = 9.80665

# The ground as spring, damper and friction: stiff enough to sink in by 5 mm only, soft enough for 2.5 ms steps.
_GROUND_N_M, _GROUND_N_S_M, _FRICTION_N_S_M, _SETTLING = 110.0, 2.5, 1.5, 6.0
_READONLY = "Array(f8, 1, 'C', readonly=True)"


@compiled(f"void(f8[::1], f8[:, ::1], {_READONLY}, {_READONLY}, {_READONLY}, f8, f8[::1])")
def derivative(x: Array, R_start: Array, h: Array, told: Array, wind_inW: Array, floor_z_m: float, dx: Array) -> None:
    """Write dx/dt (15,) into dx.

    Args:
        x: the state.
        R_start: R_BtoW (3, 3) at the step's start.
        h: the vehicle's values in the order of `Helicopter.values`.
        told: rotor's tilt about x and y of full stick, yaw of full stick, lift [N] that the sticks ask for.
        wind_inW: (3,) [m/s].  floor_z_m: height of the floor in W [m].
    """
    mass, ixx, iyy, izz, cyclic_n_m, stiff, tilt_damping, yaw_damping, yaw_n_m = h[:9]
    rotor_lag_s, lift_lag_s, heave, drag, skid_m, levelling = h[9:15]
    turn, unused, R = np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    turn_into(x[6], x[7], x[8], turn, unused)
    for i in range(3):
        for k in range(3):
            for j in range(3):
                R[i, j] += R_start[i, k] * turn[k, j]
    weight_n = mass * GRAVITY
    climb = 0.0
    for i in range(3):
        climb += R[i, 2] * (x[3 + i] - wind_inW[i])
    # A rotor at speed gives half the weight at least; with less it is running up or down and damps less too.
    along_rotor_n = x[14] - heave * climb * max(min(2.0 * x[14] / weight_n, 1.0), 0.0)
    force = np.empty(3)
    for i in range(3):
        force[i] = along_rotor_n * R[i, 2] - drag * (x[3 + i] - wind_inW[i] - climb * R[i, 2])
    force[2] -= weight_n
    sunk_m = floor_z_m + skid_m - x[2]
    pressed = 0.0
    if sunk_m > 0.0:
        press_n = max(_GROUND_N_M * sunk_m - _GROUND_N_S_M * x[5], 0.0)
        force[2] += press_n
        pressed = min(press_n / weight_n, 1.0)
        force[0] -= _FRICTION_N_S_M * pressed * x[3]
        force[1] -= _FRICTION_N_S_M * pressed * x[4]
    firm = 1.0 + _SETTLING * pressed
    righting = stiff + levelling * pressed
    # z_B x up, the turn that rights the body, is (-up_y, up_x, 0) in B, up being R's last row.
    wx, wy, wz = x[9], x[10], x[11]
    mx = cyclic_n_m * x[12] - righting * R[2, 1] - tilt_damping * firm * wx - (izz - iyy) * wy * wz
    my = cyclic_n_m * x[13] + righting * R[2, 0] - tilt_damping * firm * wy - (ixx - izz) * wz * wx
    mz = yaw_n_m * told[2] * (1.0 - pressed) - yaw_damping * firm * wz - (iyy - ixx) * wx * wy
    for i in range(3):
        dx[i] = x[3 + i]
        dx[3 + i] = force[i] / mass
        dx[6 + i] = x[9 + i]
    dx[9], dx[10], dx[11] = mx / ixx, my / iyy, mz / izz
    dx[12] = (told[0] - x[12]) / rotor_lag_s
    dx[13] = (told[1] - x[13]) / rotor_lag_s
    dx[14] = (told[3] - x[14]) / lift_lag_s


@compiled(f"f8[::1](f8[::1], f8[:, ::1], {_READONLY}, {_READONLY}, {_READONLY}, f8, f8)")
def moved(x: Array, R_start: Array, h: Array, told: Array, wind_inW: Array, floor_z_m: float, dt_s: float) -> Array:
    """Return the state dt_s later.

    Source: Runge-Kutta of fourth order. The attitude goes as a rotation vector theta from the step's start,
    R = R_start exp(theta); over one step of some ms theta' is w to second order, theta being parallel to w.
    """
    k1, k2, k3, k4 = np.empty(15), np.empty(15), np.empty(15), np.empty(15)
    derivative(x, R_start, h, told, wind_inW, floor_z_m, k1)
    derivative(x + 0.5 * dt_s * k1, R_start, h, told, wind_inW, floor_z_m, k2)
    derivative(x + 0.5 * dt_s * k2, R_start, h, told, wind_inW, floor_z_m, k3)
    derivative(x + dt_s * k3, R_start, h, told, wind_inW, floor_z_m, k4)
    return np.asarray(x + dt_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))


def told_by(sticks: tuple[float, float, float, float], trim: Array, on: bool, weight_n: float, share: float) -> Array:
    """Return what the sticks ask of the rotors (4,), see `derivative`; nothing with the motor off.

    The swash plate is round: both cyclic channels together reach full stick, no more.
    """
    if not on:
        return np.zeros(4)
    roll, pitch, yaw, collective = (
        max(-1.0, min(1.0, stick)) + offset for stick, offset in zip(sticks, trim.tolist(), strict=True)
    )
    reach = max(1.0, math.hypot(roll, pitch))
    return np.array([roll / reach, pitch / reach, yaw, weight_n * (1.0 + share * collective)])

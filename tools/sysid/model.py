"""The hover model, compiled: forces and moments linear in states and sticks, attitude and gravity exact.

State x (12,): velocity in W, rotation vector since the step began, rates in B, the rotor's tilt about x and y
[of full stick], lift less weight over mass [m/s^2]. Equations with their sources: docs/sysid.md.
Frames: W is the room (z up), B the body (x forward, y left, z up) with z along the rotor's axis.
"""

from __future__ import annotations

import math

import numpy as np

from tools.simulate.dynamics import GRAVITY
from tracker.maths.compiled import compiled
from tracker.maths.so3_compiled import turn_into
from tracker.types import Array

STATES = 12
LONGEST_STEP_S = 0.01
V, THETA, RATE, TILT, LIFT = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 11), 11
_GRAVITY = float(GRAVITY)


@compiled("void(f8[::1], f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def rates_of_change(x: Array, R_start: Array, theta: Array, u: Array, dx: Array) -> None:
    """Write dx/dt (12,) into dx.

    Args:
        x: the state.  R_start: R_BtoW (3, 3) at the step's start.  theta: the parameters, in their order.
        u: sticks (4,), trims added: roll, pitch, yaw, heave.
    Within a step of 10 ms the turn t since its start is small: exp(t) v is v + t x v + t x (t x v) / 2, to 1e-5.
    """
    tx, ty, tz = x[3], x[4], x[5]
    # The rotor's axis: R_start exp(t) e_z. Up in B: exp(-t) R_start' e_z.
    ax, ay, az = ty + 0.5 * tx * tz, -tx + 0.5 * ty * tz, 1.0 - 0.5 * (tx * tx + ty * ty)
    zx = R_start[0, 0] * ax + R_start[0, 1] * ay + R_start[0, 2] * az
    zy = R_start[1, 0] * ax + R_start[1, 1] * ay + R_start[1, 2] * az
    zz = R_start[2, 0] * ax + R_start[2, 1] * ay + R_start[2, 2] * az
    rx, ry, rz = R_start[2, 0], R_start[2, 1], R_start[2, 2]
    along = tx * rx + ty * ry + tz * rz
    square = tx * tx + ty * ty + tz * tz
    up_x = rx - (ty * rz - tz * ry) + 0.5 * (tx * along - square * rx)
    up_y = ry - (tz * rx - tx * rz) + 0.5 * (ty * along - square * ry)
    climb = zx * x[0] + zy * x[1] + zz * x[2]
    along_rotor = _GRAVITY + x[11] + (theta[12] - theta[10]) * climb
    dx[0] = along_rotor * zx - theta[12] * x[0]
    dx[1] = along_rotor * zy - theta[12] * x[1]
    dx[2] = along_rotor * zz - theta[12] * x[2] - _GRAVITY
    dx[3], dx[4], dx[5] = x[6], x[7], x[8]
    # z_B x up, the turn that rights the body, is (-up_y, up_x, 0) in B.
    dx[6] = theta[0] * x[9] - theta[1] * up_y - theta[2] * x[6]
    dx[7] = theta[3] * x[10] + theta[4] * up_x - theta[5] * x[7]
    dx[8] = theta[7] * u[2] - theta[8] * x[8]
    dx[9] = (u[0] - x[9]) / theta[6]
    dx[10] = (u[1] - x[10]) / theta[6]
    dx[11] = (theta[9] * u[3] - x[11]) / theta[11]


@compiled("void(f8[::1], f8[::1], f8, f8[::1])")
def ahead(x: Array, k: Array, h: float, y: Array) -> None:
    """Write x + h k into y (12,)."""
    for i in range(12):
        y[i] = x[i] + h * k[i]


@compiled("void(f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1])")
def turned(R: Array, x: Array, turn: Array, unused: Array) -> None:
    """Turn R (3, 3) by the state's rotation vector, which becomes zero."""
    turn_into(x[3], x[4], x[5], turn, unused)
    for i in range(3):
        a, b, c = R[i, 0], R[i, 1], R[i, 2]
        for j in range(3):
            R[i, j] = a * turn[0, j] + b * turn[1, j] + c * turn[2, j]
        x[3 + i] = 0.0


@compiled("void(f8[:, ::1], f8[::1], f8[:, ::1], f8, f8[::1])")
def mean_stick(total: Array, at_s: Array, held: Array, t_s: float, u: Array) -> None:
    """Write the integral of the held sticks up to t_s (4,) into u.

    Args:
        total: integral of the sticks at the times at_s (n, 4).  held: the sticks from each time on (n, 4).
    """
    k = max(int(np.searchsorted(at_s, t_s, side="right")) - 1, 0)
    for i in range(4):
        u[i] = total[k, i] + held[k, i] * (t_s - at_s[k])


@compiled("void(f8[::1], f8[::1], f8[:, ::1], f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, :, ::1])")
def simulate(
    theta: Array, x_start: Array, R_start: Array, t_s: Array, at_s: Array, held: Array, total: Array, out: Array,
    attitude: Array,
) -> None:  # fmt: skip
    """Run the model over a segment.

    Args:
        theta: parameters (20,).
        x_start, R_start: state (12,) and R_BtoW (3, 3) at t_s[0]; the state's rotation vector turns R_start.
        t_s: times of the outputs (m,) [s].
        at_s, held, total: times of the sticks' changes (n,) [s], the sticks from then on (n, 4), and their integral.
        out: takes the states with the way since the start in place of the rotation vector (m, 12).
        attitude: takes R_BtoW (m, 3, 3).
    The sticks of a step are their mean over it, so that the outputs are continuous in the delay.
    Source: Runge-Kutta of fourth order, steps of 10 ms at most.
    """
    x, R, turn, unused = x_start.copy(), R_start.copy(), np.empty((3, 3)), np.empty((3, 3))
    turned(R, x, turn, unused)
    way, delay = np.zeros(3), theta[13]
    before, after, u = np.empty(4), np.empty(4), np.empty(4)
    k1, k2, k3, k4, y = np.empty(12), np.empty(12), np.empty(12), np.empty(12), np.empty(12)
    for m in range(len(t_s)):
        if m > 0:
            gap = t_s[m] - t_s[m - 1]
            steps = max(math.ceil(gap / LONGEST_STEP_S - 1e-9), 1)
            h = gap / steps
            mean_stick(total, at_s, held, t_s[m - 1] - delay, before)
            for step in range(steps):
                mean_stick(total, at_s, held, t_s[m - 1] + (step + 1) * h - delay, after)
                for i in range(4):
                    u[i] = (after[i] - before[i]) / h + theta[14 + i]
                    before[i] = after[i]
                rates_of_change(x, R, theta, u, k1)
                ahead(x, k1, 0.5 * h, y)
                rates_of_change(y, R, theta, u, k2)
                ahead(x, k2, 0.5 * h, y)
                rates_of_change(y, R, theta, u, k3)
                ahead(x, k3, h, y)
                rates_of_change(y, R, theta, u, k4)
                for i in range(3):  # the way, to the same order: v' is known at the step's beginning, middle and end
                    way[i] += h * x[i] + h * h / 6.0 * (k1[i] + k2[i] + k3[i])
                for i in range(12):
                    x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                turned(R, x, turn, unused)
        for i in range(12):
            out[m, i] = x[i]
        for i in range(3):
            out[m, 3 + i] = way[i]
        attitude[m] = R

"""A 55 g model helicopter with a flybar: what the sticks do to position and attitude.

Frames as everywhere: W is the room (z up), B the body (x forward, y left, z up).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tracker import so3
from tracker.types import Array, frozen_array

GRAVITY = 9.80665
# Places in the state vector.
_P, _V, _THETA, _W, _CYCLIC, _LIFT = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 14), 14
STATE_SIZE = 15


@dataclass(frozen=True, slots=True)
class Helicopter:
    """Physical values of the vehicle; identification finds them again from logs.

    mass_kg, inertia_kg_m2: about B's axes x, y, z.
    cyclic_moment_n_m: moment of the tilted rotor at full stick.
    tilt_stiffness_n_m: what rights the body, per sine of tilt: flybar above, weight below.
    tilt_damping_n_m_s, yaw_damping_n_m_s: moment per rate.
    yaw_moment_n_m: moment at full yaw stick; over the damping it is the greatest yaw rate.
    rotor_lag_s: the rotor and its stabiliser follow the cyclic stick this late.  lift_lag_s: lift, the collective.
    collective_share: change of lift at full stick, as a share of the weight.
    heave_damping_n_s_m: loss of lift per climb rate, along the rotor's axis.  drag_n_s_m: force per level air speed.
    trim: cyclic about x and y, yaw and collective that are always there, as of a vehicle never quite in trim.
    skid_m: height of B's origin above the ground when it stands.
    """

    mass_kg: float = 0.055
    inertia_kg_m2: tuple[float, float, float] = (8.0e-5, 1.1e-4, 1.4e-4)
    cyclic_moment_n_m: float = 2.6e-3
    tilt_stiffness_n_m: float = 8.0e-3
    tilt_damping_n_m_s: float = 1.1e-3
    yaw_damping_n_m_s: float = 7.0e-4
    yaw_moment_n_m: float = 1.1e-3
    rotor_lag_s: float = 0.06
    lift_lag_s: float = 0.08
    collective_share: float = 0.50
    heave_damping_n_s_m: float = 0.108
    drag_n_s_m: float = 0.122
    trim: tuple[float, float, float, float] = (0.03, -0.02, 0.02, -0.03)
    skid_m: float = 0.058


@dataclass(frozen=True, slots=True)
class Sticks:
    """What the servos are told, each -1..1, about B's axes: +x rolls right, +y noses down, +z turns left.

    collective: 0 carries the weight.  motor: whether the rotor turns.
    """

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    collective: float = 0.0
    motor: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """All there is to know of the vehicle at one instant.

    p_BinW, v_BinW: [m], [m/s].  R_BtoW: (3, 3).  w_BinB: [rad/s].
    cyclic: (2,) the rotor's tilt about x and y, of full stick.  lift_n: [N].
    """

    p_BinW: Array
    R_BtoW: Array
    v_BinW: Array
    w_BinB: Array
    cyclic: Array
    lift_n: float


def standing(helicopter: Helicopter, floor_z_m: float, place_m: tuple[float, float] = (0.0, 0.0)) -> State:
    """Return a vehicle that stands on the floor, rotor still, nose along the room's x axis."""
    still = frozen_array(np.zeros(3))
    p_BinW = frozen_array([*place_m, floor_z_m + helicopter.skid_m])
    return State(p_BinW, frozen_array(np.eye(3)), still, still, frozen_array(np.zeros(2)), 0.0)


def step(helicopter: Helicopter, state: State, sticks: Sticks, wind_inW: Array, floor_z_m: float, dt_s: float) -> State:
    """Move on by dt_s with sticks and wind (3,) [m/s] held.

    Source: Runge-Kutta of fourth order. The attitude goes as a rotation vector theta from the step's start,
    R = R_start exp(theta); over one step of some ms theta' is w to second order, theta being parallel to w.
    """
    x = np.zeros(STATE_SIZE)
    x[_P], x[_V], x[_W], x[_CYCLIC], x[_LIFT] = state.p_BinW, state.v_BinW, state.w_BinB, state.cyclic, state.lift_n
    forces = _Forces(helicopter, sticks, wind_inW, floor_z_m, state.R_BtoW)
    k1 = forces.derivative(x)
    k2 = forces.derivative(x + 0.5 * dt_s * k1)
    k3 = forces.derivative(x + 0.5 * dt_s * k2)
    k4 = forces.derivative(x + dt_s * k3)
    x += dt_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return State(x[_P], state.R_BtoW @ so3.exp(x[_THETA]), x[_V], x[_W], x[_CYCLIC], float(x[_LIFT]))


class _Forces:
    """Forces and moments during one step."""

    # The ground as spring, damper and friction: stiff enough to sink in by 5 mm only, soft enough for 2.5 ms steps.
    _GROUND_N_M, _GROUND_N_S_M, _FRICTION_N_S_M, _LEVELLING = 110.0, 2.5, 1.5, 6.0

    def __init__(
        self, helicopter: Helicopter, sticks: Sticks, wind_inW: Array, floor_z_m: float, R_start: Array
    ) -> None:
        self._h = helicopter
        self._wind_inW = wind_inW
        self._floor_z_m = floor_z_m
        self._R_start = R_start
        limited = np.clip((sticks.roll, sticks.pitch, sticks.yaw, sticks.collective), -1.0, 1.0)
        on = 1.0 if sticks.motor else 0.0
        told = (limited + helicopter.trim) * on
        # The swash plate is round: both cyclic channels together reach full stick, no more.
        self._cyclic, self._yaw = told[:2] / max(1.0, float(np.hypot(told[0], told[1]))), float(told[2])
        self._lift_n = on * helicopter.mass_kg * GRAVITY * (1.0 + helicopter.collective_share * float(told[3]))
        self._inertia = np.array(helicopter.inertia_kg_m2)
        tilt, yaw = helicopter.tilt_damping_n_m_s, helicopter.yaw_damping_n_m_s
        self._damping = np.array([tilt, tilt, yaw])

    def derivative(self, x: Array) -> Array:
        """Return dx/dt (15,)."""
        h = self._h
        R_BtoW = self._R_start @ so3.exp(x[_THETA])
        force_inW, on_ground = self._force(x, R_BtoW)
        dx = np.empty(STATE_SIZE)
        dx[_P] = x[_V]
        dx[_V] = force_inW / h.mass_kg
        dx[_THETA] = x[_W]
        dx[_W] = self._moment(x, R_BtoW, on_ground) / self._inertia
        dx[_CYCLIC] = (self._cyclic - x[_CYCLIC]) / h.rotor_lag_s
        dx[_LIFT] = (self._lift_n - x[_LIFT]) / h.lift_lag_s
        return dx

    def _force(self, x: Array, R_BtoW: Array) -> tuple[Array, float]:
        """Return the force in W [N] and how hard the ground presses, as a share of the weight."""
        h, up_inW = self._h, R_BtoW[:, 2]
        air_inW = x[_V] - self._wind_inW
        climb = float(up_inW @ air_inW)
        # A rotor at speed gives half the weight at least; with less it is running up or down and damps less too.
        spin = min(2.0 * float(x[_LIFT]) / (h.mass_kg * GRAVITY), 1.0)
        along_rotor_n = float(x[_LIFT]) - h.heave_damping_n_s_m * climb * spin
        force_inW = along_rotor_n * up_inW - h.drag_n_s_m * (air_inW - climb * up_inW)
        force_inW[2] -= h.mass_kg * GRAVITY
        sunk_m = self._floor_z_m + h.skid_m - float(x[2])
        if sunk_m <= 0.0:
            return force_inW, 0.0
        press_n = max(self._GROUND_N_M * sunk_m - self._GROUND_N_S_M * float(x[5]), 0.0)
        force_inW[2] += press_n
        pressed = min(press_n / (h.mass_kg * GRAVITY), 1.0)
        force_inW[:2] -= self._FRICTION_N_S_M * pressed * x[3:5]
        return force_inW, pressed

    def _moment(self, x: Array, R_BtoW: Array, on_ground: float) -> Array:
        """Return the moment in B [N m]."""
        h, up_inB, w_inB = self._h, R_BtoW[2], x[_W]
        firm = 1.0 + self._LEVELLING * on_ground
        # z_B x up, the turn that rights the body, is (-up_y, up_x, 0) in B.
        moment = np.array(
            [
                h.cyclic_moment_n_m * x[12] - h.tilt_stiffness_n_m * firm * up_inB[1],
                h.cyclic_moment_n_m * x[13] + h.tilt_stiffness_n_m * firm * up_inB[0],
                h.yaw_moment_n_m * self._yaw * (1.0 - on_ground),
            ]
        )
        return np.asarray(moment - self._damping * firm * w_inB - so3.hat(w_inB) @ (self._inertia * w_inB))


def full_tilt(helicopter: Helicopter) -> float:
    """Return the steady tilt at full cyclic stick [rad]."""
    return math.asin(min(helicopter.cyclic_moment_n_m / helicopter.tilt_stiffness_n_m, 1.0))


def full_climb_m_s(helicopter: Helicopter) -> float:
    """Return the steady climb at full collective [m/s]."""
    return helicopter.collective_share * helicopter.mass_kg * GRAVITY / helicopter.heave_damping_n_s_m


def full_yaw_rate(helicopter: Helicopter) -> float:
    """Return the steady yaw rate at full stick [rad/s]."""
    return helicopter.yaw_moment_n_m / helicopter.yaw_damping_n_m_s

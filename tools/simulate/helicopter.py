"""A 55 g model helicopter with a flybar: what the sticks do to position and attitude.

Frames as everywhere: W is the room (z up), B the body (x forward, y left, z up).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tools.simulate.dynamics import CYCLIC, GRAVITY, LIFT, STATE_SIZE, THETA, P, V, W, moved, told_by
from tracker.maths import so3
from tracker.types import Array, frozen_array


@dataclass(frozen=True)
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
    skid_m: height of B's origin above the ground when it stands.  levelling_n_m: how hard the skids right it there.
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
    levelling_n_m: float = 0.048

    @cached_property
    def values(self) -> Array:
        """Return the values as `dynamics.derivative` wants them (15,)."""
        return frozen_array(
            [
                self.mass_kg,
                *self.inertia_kg_m2,
                self.cyclic_moment_n_m,
                self.tilt_stiffness_n_m,
                self.tilt_damping_n_m_s,
                self.yaw_damping_n_m_s,
                self.yaw_moment_n_m,
                self.rotor_lag_s,
                self.lift_lag_s,
                self.heave_damping_n_s_m,
                self.drag_n_s_m,
                self.skid_m,
                self.levelling_n_m,
            ]
        )


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

    Source: `dynamics.moved`.
    """
    x = np.zeros(STATE_SIZE)
    x[P], x[V], x[W], x[CYCLIC], x[LIFT] = state.p_BinW, state.v_BinW, state.w_BinB, state.cyclic, state.lift_n
    told = told_by(
        (sticks.roll, sticks.pitch, sticks.yaw, sticks.collective),
        np.array(helicopter.trim),
        sticks.motor,
        helicopter.mass_kg * GRAVITY,
        helicopter.collective_share,
    )
    R_start = np.array(state.R_BtoW)
    x = moved(x, R_start, helicopter.values, told, np.asarray(wind_inW, dtype=np.float64), floor_z_m, dt_s)
    return State(x[P], R_start @ so3.exp(x[THETA]), x[V], x[W], x[CYCLIC], float(x[LIFT]))


def full_tilt(helicopter: Helicopter) -> float:
    """Return the steady tilt at full cyclic stick [rad]."""
    return math.asin(min(helicopter.cyclic_moment_n_m / helicopter.tilt_stiffness_n_m, 1.0))


def full_climb_m_s(helicopter: Helicopter) -> float:
    """Return the steady climb at full collective [m/s]."""
    return helicopter.collective_share * helicopter.mass_kg * GRAVITY / helicopter.heave_damping_n_s_m


def full_yaw_rate(helicopter: Helicopter) -> float:
    """Return the steady yaw rate at full stick [rad/s]."""
    return helicopter.yaw_moment_n_m / helicopter.yaw_damping_n_m_s

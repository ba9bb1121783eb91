"""Flights of the simulated helicopter without cameras: its own equations, gusts, a loop that holds it, noisy poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.excite.manoeuvre import Kind, Manoeuvre, Sequence
from tools.simulate.dynamics import GRAVITY
from tools.simulate.helicopter import Helicopter, State, Sticks, step
from tools.simulate.wind import Wind
from tools.sysid.flight_data import FlightData, Track, make_sticks
from tools.sysid.parameters import AXES, Axis, vector
from tracker.maths import so3
from tracker.types import Array

STEP_S, TICK_STEPS = 0.0025, 8
AMPLITUDES = {Axis.ROLL: 0.45, Axis.PITCH: 0.45, Axis.YAW: 0.5, Axis.HEAVE: 0.5}


@dataclass(frozen=True, slots=True)
class Conditions:
    """gust_m_s, sigma_m, sigma_rad: one sigma.  delay_ticks: the servos' delay, 20 ms each.

    sweep_s: length of each sweep [s].  size: share of the sequence's amplitudes.
    """

    seed: int = 0
    rate_hz: float = 15.0
    gust_m_s: float = 0.05
    sigma_m: float = 0.0004
    sigma_rad: float = 0.004
    delay_ticks: int = 0
    sweep_s: float = 8.0
    size: float = 1.0


def sequence(sweep_s: float = 8.0) -> Sequence:
    """Return a sweep of each axis, then steps of each."""
    t_s, manoeuvres = 1.0, []
    for axis in AXES:
        manoeuvres.append(Manoeuvre(axis, Kind.SWEEP, t_s, sweep_s, AMPLITUDES[axis], 0.3, 4.0))
        t_s += sweep_s + 0.5
    for axis in AXES:
        manoeuvres.append(Manoeuvre(axis, Kind.STEPS_3211, t_s, 2.1, 0.7 * AMPLITUDES[axis], 1.6, 1.6))
        t_s += 3.0
    return Sequence(tuple(manoeuvres))


def truth(helicopter: Helicopter, delay_s: float = 0.0) -> Array:
    """Return the hover model's parameters of a simulated helicopter."""
    ixx, iyy, izz = helicopter.inertia_kg_m2
    roll, pitch, yaw, heave = helicopter.trim
    return vector(
        roll_gain=helicopter.cyclic_moment_n_m / ixx,
        roll_stiffness=helicopter.tilt_stiffness_n_m / ixx,
        roll_damping=helicopter.tilt_damping_n_m_s / ixx,
        pitch_gain=helicopter.cyclic_moment_n_m / iyy,
        pitch_stiffness=helicopter.tilt_stiffness_n_m / iyy,
        pitch_damping=helicopter.tilt_damping_n_m_s / iyy,
        rotor_lag=helicopter.rotor_lag_s,
        yaw_gain=helicopter.yaw_moment_n_m / izz,
        yaw_damping=helicopter.yaw_damping_n_m_s / izz,
        heave_gain=helicopter.collective_share * GRAVITY,
        heave_damping=helicopter.heave_damping_n_s_m / helicopter.mass_kg,
        lift_lag=helicopter.lift_lag_s,
        drag=helicopter.drag_n_s_m / helicopter.mass_kg,
        delay=delay_s,
        roll_trim=roll,
        pitch_trim=pitch,
        yaw_trim=yaw,
        heave_trim=heave,
    )


def fly(conditions: Conditions, helicopter: Helicopter | None = None) -> FlightData:
    """Fly the sequence high above the floor, held in place by a loop that sees noisy speeds."""
    helicopter = helicopter or Helicopter()
    plan = sequence(conditions.sweep_s)
    rng = np.random.default_rng((conditions.seed, 7))
    wind = Wind(conditions.gust_m_s, 1.0, STEP_S, np.random.default_rng((conditions.seed, 1)))
    still = np.zeros(3)
    state = State(still, np.eye(3), still, still, np.zeros(2), helicopter.mass_kg * GRAVITY)
    told: list[Array] = []
    at_s, held, poses = [], [], []
    frame_s = 0.0
    for k in range(round((plan.duration_s + 1.0) / STEP_S)):
        t_s = k * STEP_S
        if k % TICK_STEPS == 0:
            told.append(_loop(state, helicopter) + conditions.size * np.array(plan.sticks_at(t_s)))
            at_s.append(t_s)
            held.append(told[-1])
        if t_s >= frame_s - 1e-9:
            noise = rng.standard_normal(6)
            R = state.R_BtoW @ so3.exp(conditions.sigma_rad * noise[3:])
            poses.append((t_s, state.p_BinW + conditions.sigma_m * noise[:3], R))
            frame_s += 1.0 / conditions.rate_hz
        roll, pitch, yaw, heave = told[max(len(told) - 1 - conditions.delay_ticks, 0)].tolist()
        state = step(helicopter, state, Sticks(roll, pitch, yaw, heave, True), wind.blow(), -100.0, STEP_S)
    times, places, attitudes = (np.array(each) for each in zip(*poses, strict=True))
    sigma = np.tile(np.repeat([conditions.sigma_m, conditions.sigma_rad], 3), (len(times), 1))
    return FlightData((Track(times, places, attitudes, sigma),), make_sticks(np.array(at_s), np.array(held)))


def _loop(state: State, helicopter: Helicopter) -> Array:
    """Hold the place: tilt against speed and way, turn against yaw, climb against height."""
    wanted = -1.2 * state.v_BinW - 1.0 * state.p_BinW
    yaw = so3.to_euler(state.R_BtoW)[2]
    level = wanted / GRAVITY / 0.33
    cos, sin = np.cos(yaw), np.sin(yaw)
    forward, left = cos * level[0] + sin * level[1], cos * level[1] - sin * level[0]
    held = np.array([-left, forward, -0.8 * yaw, wanted[2] / 4.9])
    return np.asarray(held - np.array(helicopter.trim))

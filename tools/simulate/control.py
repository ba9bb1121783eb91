"""The simulated autopilot's cascade: position -> velocity -> acceleration -> attitude -> sticks, in N and F."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tools.simulate.autopilot.navigation import NavState
from tools.simulate.dynamics import GRAVITY
from tools.simulate.mission import Reference
from tracker.types import Array


@dataclass(frozen=True, slots=True)
class Tuning:
    """Gains, and what the autopilot was told of its vehicle (as an operator tunes it in flight).

    position_1_s, velocity_1_s, integral_1_s2: level gains.  climb_*: upright ones.  yaw_*: heading.
    attitude: share of an attitude error added to the cyclic stick.
    full_tilt_rad, full_climb_m_s2, full_yaw_rad_s: what full sticks give.
    drag_1_s, heave_1_s: loss of level and upright speed per second.
    max_speed_m_s: limit of the speed a position error asks for.
    """

    position_1_s: float = 1.6
    velocity_1_s: float = 3.0
    integral_1_s2: float = 1.5
    climb_position_1_s: float = 2.0
    climb_velocity_1_s: float = 2.5
    climb_integral_1_s2: float = 1.5
    yaw_1_s: float = 1.8
    yaw_integral_1_s2: float = 0.4
    attitude: float = 0.2
    full_tilt_rad: float = math.radians(19.0)
    full_climb_m_s2: float = 4.9
    full_yaw_rad_s: float = math.radians(90.0)
    drag_1_s: float = 2.2
    heave_1_s: float = 2.0
    max_speed_m_s: float = 0.6


@dataclass(frozen=True, slots=True)
class PilotSticks:
    """Sticks as a pilot holds them, each -1..1: right, nose up, nose right, and up."""

    right: float = 0.0
    nose_up: float = 0.0
    nose_right: float = 0.0
    up: float = 0.0
    motor: bool = False


class Cascade:
    """The controllers and their integrals."""

    def __init__(self, tuning: Tuning) -> None:
        self._t = tuning
        self._gain_p = np.array([tuning.position_1_s, tuning.position_1_s, tuning.climb_position_1_s])
        self._gain_v = np.array([tuning.velocity_1_s, tuning.velocity_1_s, tuning.climb_velocity_1_s])
        self._gain_i = np.array([tuning.integral_1_s2, tuning.integral_1_s2, tuning.climb_integral_1_s2])
        self._loss = np.array([tuning.drag_1_s, tuning.drag_1_s, tuning.heave_1_s])
        self._sum_N: Array = np.zeros(3)
        self._sum_yaw = 0.0

    def fly(self, reference: Reference, state: NavState, dt_s: float) -> PilotSticks:
        """Return the sticks that bring the vehicle to the reference. dt_s: time since the last call [s]."""
        t = self._t
        wanted_v = reference.v + np.clip(self._gain_p * (reference.p - state.p_BinN), -t.max_speed_m_s, t.max_speed_m_s)
        error_v = wanted_v - state.v_BinN
        self._sum_N = np.clip(self._sum_N + self._gain_i * error_v * dt_s, -1.5, 1.5)
        a_N = reference.a + self._loss * wanted_v + self._gain_v * error_v + self._sum_N
        roll, pitch = self._attitude(a_N, state.euler[2])
        return PilotSticks(
            right=_unit((roll + t.attitude * (roll - state.euler[0])) / t.full_tilt_rad),
            nose_up=_unit((pitch + t.attitude * (pitch - state.euler[1])) / t.full_tilt_rad),
            nose_right=self._turn(reference, state.euler[2], dt_s),
            up=_unit(-float(a_N[2]) / t.full_climb_m_s2),
            motor=True,
        )

    def level(self, up: float) -> PilotSticks:
        """Return sticks for no idea where: level as trimmed, nose kept, with a collective."""
        right, nose_up = (angle / self._t.full_tilt_rad for angle in self._attitude(self._sum_N, 0.0))
        return PilotSticks(_unit(right), _unit(nose_up), _unit(self._sum_yaw / self._t.full_yaw_rad_s), up, True)

    def _attitude(self, a_N: Array, yaw: float) -> tuple[float, float]:
        """Return the roll and pitch that accelerate so."""
        forwards = a_N[0] * math.cos(yaw) + a_N[1] * math.sin(yaw)
        rightwards = a_N[1] * math.cos(yaw) - a_N[0] * math.sin(yaw)
        return math.atan2(rightwards, GRAVITY), -math.atan2(forwards, GRAVITY)

    def _turn(self, reference: Reference, yaw: float, dt_s: float) -> float:
        error = math.remainder(reference.yaw - yaw, 2.0 * math.pi)
        self._sum_yaw = max(-0.4, min(0.4, self._sum_yaw + self._t.yaw_integral_1_s2 * error * dt_s))
        return _unit((reference.yaw_rate + self._t.yaw_1_s * error + self._sum_yaw) / self._t.full_yaw_rad_s)


def added(sticks: PilotSticks, more: PilotSticks) -> PilotSticks:
    """Return sticks moved by others, as far as they go."""
    return PilotSticks(
        _unit(sticks.right + more.right),
        _unit(sticks.nose_up + more.nose_up),
        _unit(sticks.nose_right + more.nose_right),
        _unit(sticks.up + more.up),
        sticks.motor,
    )


def _unit(value: float) -> float:
    return max(-1.0, min(1.0, value))

"""What the simulated helicopter is told to fly: take-off, hover, square, turn, landing.

The square of 1 m stands upright in the plane of the vertical and the level direction square to the baseline's, which
both cameras of the paper's rig look across: its farthest corner with the balls lies 9.4 deg off the optical axes,
half the field of view being 15 deg across and 11.4 deg upright. A level square of 1 m would not fit: towards a camera
its corners, with the balls, leave the picture at 12.4 deg.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tracker.errors import OperatorError
from tracker.types import Array

SHORTEST_S = 15.0
STANDING_S = 2.0
"""Time a mission leaves before the flight, for the track to start and the autopilot to arm [s]."""

SQUARE_M = 1.0
TURN = math.pi / 2.0
_TOP_M_S, _TOP_M_S2 = 0.8, 1.6
_LEVEL_inW = np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0)
_UP_inW = np.array([0.0, 0.0, 1.0])
# The square in its plane (level, up), from the middle of one side and back to it; legs from stop to stop.
_SQUARE = ((-0.5, 0.0), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (-0.5, 0.0))
_LEG_SHARES = (0.7, 1.0, 1.0, 1.0, 0.7)


class Phase(StrEnum):
    """The parts of the mission, in their order."""

    TAKE_OFF = "take-off"
    HOVER = "hover"
    SQUARE = "square"
    TURN = "turn"
    LAND = "land"
    DONE = "done"


_SHARES = {Phase.TAKE_OFF: 0.13, Phase.HOVER: 0.16, Phase.SQUARE: 0.45, Phase.TURN: 0.12, Phase.LAND: 0.14}


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Where to be, and how to move there: position (3,) [m], velocity, acceleration; yaw [rad] and its rate.

    The axes are those of whoever made it: the room's, or north-east-down once it is `turned`.
    """

    phase: Phase
    p: Array
    v: Array
    a: Array
    yaw: float
    yaw_rate: float

    def turned(self, R_WtoN: Array, room_yaw: float) -> Reference:
        """Return the same for axes N; a heading in N is the room's minus the yaw in W [rad]."""
        yaw = room_yaw - self.yaw
        return Reference(self.phase, R_WtoN @ self.p, R_WtoN @ self.v, R_WtoN @ self.a, yaw, -self.yaw_rate)


class Mission:
    """The whole flight in the room's axes, by the time since arming.

    duration_s: time for everything, standing included. Below some 21 s the square shrinks with the time it has, so
        that no leg asks for more than 0.8 m/s or 1.6 m/s^2, half of what the vehicle can do.
    ground_z_m: height of the standing vehicle's origin in W [m].
    """

    def __init__(self, duration_s: float, ground_z_m: float) -> None:
        """Lay out the flight.

        Raises:
            OperatorError: too short a time for all of it.
        """
        if not duration_s >= SHORTEST_S:
            raise OperatorError(
                f"mission: {duration_s:g} s are too short for take-off, square and landing; "
                f"give at least {SHORTEST_S:g} s"
            )
        flight_s = duration_s - STANDING_S
        ends = itertools.accumulate(share * flight_s for share in _SHARES.values())
        self._ends_s = dict(zip(_SHARES, ends, strict=True))
        leg_s = _SHARES[Phase.SQUARE] * flight_s / sum(_LEG_SHARES)
        # A leg from stop to stop peaks at 1.5 times its mean speed, and starts with 6 times length over time squared.
        self.side_m = min(SQUARE_M, _TOP_M_S * leg_s / 1.5, _TOP_M_S2 * leg_s**2 / 6.0)
        self.corners_inW = np.array([self.side_m * (u * _LEVEL_inW + v * _UP_inW) for u, v in _SQUARE])
        self.ground_inW = np.append(self.corners_inW[0][:2], ground_z_m)

    def span_s(self, phase: Phase) -> tuple[float, float]:
        """Return when a phase starts and ends [s] since arming."""
        end = self._ends_s[phase]
        return end - _SHARES[phase] * self._ends_s[Phase.LAND] / sum(_SHARES.values()), end

    def reference_at(self, t_s: float) -> Reference:
        """Return the reference at t_s since arming."""
        home = self.corners_inW[0]
        phase = next((each for each, end in self._ends_s.items() if t_s < end), Phase.DONE)
        yaw = TURN if phase in (Phase.LAND, Phase.DONE) else 0.0
        if phase is Phase.DONE:
            return straight(phase, home, self.ground_inW, (0.0, 1.0), 1.0, yaw)
        start, end = self.span_s(phase)
        if phase is Phase.TAKE_OFF:  # the first part is for the rotor to come up to speed
            return straight(phase, self.ground_inW, home, (start + 0.25 * (end - start), end), t_s, yaw)
        if phase is Phase.SQUARE:
            return self._on_square(start, end, t_s)
        if phase is Phase.TURN:
            s, rate, _ = _ease((start, end), t_s)
            still = np.zeros(3)
            return Reference(phase, home, still, still, TURN * s, TURN * rate)
        if phase is Phase.LAND:
            return straight(phase, home, self.ground_inW, (start, end), t_s, yaw)
        return straight(phase, home, home, (start, end), t_s, yaw)

    def _on_square(self, start_s: float, end_s: float, t_s: float) -> Reference:
        shares = np.concatenate(([0.0], np.cumsum(_LEG_SHARES))) / sum(_LEG_SHARES)
        times = start_s + (end_s - start_s) * shares
        leg = int(np.clip(np.searchsorted(times, t_s, side="right") - 1, 0, len(_LEG_SHARES) - 1))
        ends = (float(times[leg]), float(times[leg + 1]))
        return straight(Phase.SQUARE, self.corners_inW[leg], self.corners_inW[leg + 1], ends, t_s, 0.0)


def _ease(span_s: tuple[float, float], t_s: float) -> tuple[float, float, float]:
    """Return share, rate [1/s] and its change [1/s^2] of going from 0 to 1, from stop to stop: 3 s^2 - 2 s^3."""
    length = span_s[1] - span_s[0]
    s = (t_s - span_s[0]) / length
    if not 0.0 < s < 1.0:
        return (0.0 if s <= 0.0 else 1.0), 0.0, 0.0
    return s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / length, 6.0 * (1.0 - 2.0 * s) / length**2


def straight(phase: Phase, a: Array, b: Array, span_s: tuple[float, float], t_s: float, yaw: float) -> Reference:
    """Return the reference on the straight from a to b."""
    share, rate, change = _ease(span_s, t_s)
    return Reference(phase, a + share * (b - a), rate * (b - a), change * (b - a), yaw, 0.0)

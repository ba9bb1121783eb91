"""Stick inputs that excite one axis: frequency sweeps, doublets and 3-2-1-1 steps.

Source: Tischler and Remple, "Aircraft and rotorcraft system identification", 2nd ed. (2012), ch. 5: sweeps that dwell
at low frequency and fade in and out, doublets for verification; Jategaonkar, 2nd ed. (2015), ch. 2: 3-2-1-1 steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from tools.sysid.parameters import AXES, Axis


class Kind(StrEnum):
    """How a manoeuvre moves its stick."""

    SWEEP = "sweep"
    DOUBLET = "doublet"
    STEPS_3211 = "3-2-1-1"


_FADE = 0.1
_GROWTH = 2.0
"""A sweep's frequency grows exponentially, by this exponent: the low end, where periods are long, gets more time."""

_STEPS = {Kind.DOUBLET: ((1.0, 1.0), (1.0, -1.0)), Kind.STEPS_3211: ((3.0, 1.0), (2.0, -1.0), (1.0, 1.0), (1.0, -1.0))}


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """One axis moved for a while.

    start_s: after the excitation's beginning [s].  amplitude: share of full stick.
    low_hz, high_hz: a sweep's band; for steps low_hz is that of a full wave of two of the shortest steps.
    """

    axis: Axis
    kind: Kind
    start_s: float
    duration_s: float
    amplitude: float
    low_hz: float
    high_hz: float

    @property
    def end_s(self) -> float:
        """Return when it is over [s]."""
        return self.start_s + self.duration_s

    def stick_at(self, t_s: float) -> float:
        """Return what it adds to its stick [share of full]."""
        passed_s = t_s - self.start_s
        if not 0.0 <= passed_s < self.duration_s:
            return 0.0
        if self.kind is Kind.SWEEP:
            return self.amplitude * _fade(passed_s / self.duration_s) * math.sin(self._phase(passed_s))
        steps = _STEPS[self.kind]
        part = passed_s / self.duration_s * sum(length for length, _ in steps)
        for length, sign in steps:
            if part < length:
                return self.amplitude * sign
            part -= length
        return 0.0

    def _phase(self, passed_s: float) -> float:
        """Return the sweep's phase [rad]; its frequency is low + (high - low) (e^(G s) - 1) / (e^G - 1) at share s."""
        share, span = passed_s / self.duration_s, math.expm1(_GROWTH)
        grown = (math.expm1(_GROWTH * share) / _GROWTH - share) / span
        return 2.0 * math.pi * self.duration_s * (self.low_hz * share + (self.high_hz - self.low_hz) * grown)


def _fade(share: float) -> float:
    """Return the part of full amplitude: a sweep comes and goes over a tenth of its time, so that it jerks nothing."""
    edge = min(share, 1.0 - share) / _FADE
    return 0.5 - 0.5 * math.cos(math.pi * edge) if edge < 1.0 else 1.0


@dataclass(frozen=True, slots=True)
class Sequence:
    """Manoeuvres one after the other."""

    manoeuvres: tuple[Manoeuvre, ...]

    @property
    def duration_s(self) -> float:
        """Return the time until the last is over [s]."""
        return max((each.end_s for each in self.manoeuvres), default=0.0)

    def sticks_at(self, t_s: float) -> tuple[float, float, float, float]:
        """Return what is added to the sticks roll, pitch, yaw, heave, t_s after the beginning, about B's axes."""
        added = dict.fromkeys(AXES, 0.0)
        for each in self.manoeuvres:
            added[each.axis] += each.stick_at(t_s)
        return added[Axis.ROLL], added[Axis.PITCH], added[Axis.YAW], added[Axis.HEAVE]

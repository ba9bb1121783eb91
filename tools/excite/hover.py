"""A flight for excitation: up to the middle of the volume, hover while the sequence runs, down again."""

from __future__ import annotations

import numpy as np

from tools.excite.manoeuvre import Sequence
from tools.simulate.control import PilotSticks
from tools.simulate.mission import STANDING_S, Phase, Reference, straight
from tracker.types import Array

_CLIMB_S, _SETTLE_S, _AFTER_S, _LAND_S = 5.0, 3.0, 2.0, 5.0
_ROTOR_S = 1.0


class ExcitedHover:
    """What to fly, and what is added to the sticks meanwhile, by the time since arming.

    ground_z_m: height of the standing vehicle's origin in W [m].
    """

    def __init__(self, sequence: Sequence, ground_z_m: float) -> None:
        self._sequence = sequence
        self._start_s = _CLIMB_S + _SETTLE_S
        self._down_s = self._start_s + sequence.duration_s + _AFTER_S
        self.home_inW: Array = np.zeros(3)
        self.ground_inW: Array = np.array([0.0, 0.0, ground_z_m])
        self.duration_s = STANDING_S + self._down_s + _LAND_S
        """Time for everything, standing included [s]."""

    def reference_at(self, t_s: float) -> Reference:
        """Return the reference at t_s since arming."""
        end_s = self._down_s + _LAND_S
        if t_s < _CLIMB_S:
            return straight(Phase.TAKE_OFF, self.ground_inW, self.home_inW, (_ROTOR_S, _CLIMB_S), t_s, 0.0)
        if t_s < self._down_s:
            return straight(Phase.HOVER, self.home_inW, self.home_inW, (_CLIMB_S, self._down_s), t_s, 0.0)
        phase = Phase.LAND if t_s < end_s else Phase.DONE
        return straight(phase, self.home_inW, self.ground_inW, (self._down_s, end_s), t_s, 0.0)

    def excitation(self, t_s: float) -> PilotSticks:
        """Return what is added to the sticks at t_s since arming, as a pilot holds them."""
        roll, pitch, yaw, heave = self._sequence.sticks_at(t_s - self._start_s)
        return PilotSticks(roll, -pitch, -yaw, heave)

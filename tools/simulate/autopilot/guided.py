"""Flight by command: a target that moves to where it is told, no faster than the vehicle can follow."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bridge.wire import FieldValue
from tools.simulate.autopilot.navigation import NavState
from tools.simulate.mission import Phase, Reference
from tracker.types import Array

_TOP_M_S, _TOP_M_S2, _NEAR_1_S, _CLOSING_1_S = 0.5, 0.8, 1.2, 1.0
_DOWN_M_S, _LAND_M_S = 0.03, 0.3
_IGNORES_POSITION, _IGNORES_YAW = 0b111, 0b100_0000_0000
_STILL_ROUNDS = 50


class Guided:
    """What is to be flown: a point that follows the last target with bounded speed and acceleration."""

    def __init__(self) -> None:
        self._p: Array = np.zeros(3)
        self._v: Array = np.zeros(3)
        self._target: Array = np.zeros(3)
        self._yaw = 0.0
        self._descends = False
        self._still_rounds = 0

    def stand_at(self, state: NavState | None) -> None:
        """Take the place where the vehicle stands for the target."""
        if state is not None:
            self._p = self._target = state.p_BinN
            self._yaw = state.euler[2]

    def climb_to(self, height_m: float) -> None:
        """Take off to a height above the origin's."""
        self._target = np.array([self._p[0], self._p[1], -height_m])

    def go_to(self, fields: Mapping[str, FieldValue]) -> None:
        """Take a SET_POSITION_TARGET_LOCAL_NED for the target."""
        mask = fields["type_mask"]
        if isinstance(mask, int) and not mask & _IGNORES_POSITION:
            self._target = np.array([fields[axis] for axis in "xyz"], dtype=np.float64)
            if not mask & _IGNORES_YAW:
                self._yaw = float(np.asarray(fields["yaw"]))

    def rebase(self, jump_inN: Array, state: NavState) -> None:
        """Go along with a jump of the filter's position, each axis that jumped for itself; it has led to the state.

        The point keeps its distance to the vehicle, and what was to be added to the vehicle's speed to close it
        becomes its own: once that does little; at every pose the vehicle runs away from its target.
        Source: AC_PosControl::handle_ekf_xy_reset and _z_reset.
        """
        self._v = self._v + _CLOSING_1_S * (self._p + jump_inN - state.p_BinN) * (jump_inN != 0.0)
        self._p = self._p + jump_inN

    def descend(self) -> None:
        """Go down where the vehicle is."""
        self._descends = True

    def advance(self, dt_s: float) -> None:
        """Move on by dt_s."""
        if self._descends:
            self._v = np.array([0.0, 0.0, _LAND_M_S])
        else:
            away = self._target - self._p
            wanted = _NEAR_1_S * away
            speed = float(np.linalg.norm(wanted))
            wanted = wanted * min(1.0, _TOP_M_S / speed) if speed > 0.0 else wanted
            change = wanted - self._v
            size = float(np.linalg.norm(change))
            self._v = self._v + (change * min(1.0, _TOP_M_S2 * dt_s / size) if size > 0.0 else 0.0)
        self._p = self._p + self._v * dt_s

    def reference(self) -> Reference:
        """Return what is to be flown now."""
        return Reference(Phase.LAND if self._descends else Phase.HOVER, self._p, self._v, np.zeros(3), self._yaw, 0.0)

    def is_down(self, state: NavState | None) -> bool:
        """Say whether a descending vehicle has not sunk for a second: it stands."""
        stands = self._descends and state is not None and abs(float(state.v_BinN[2])) < _DOWN_M_S
        self._still_rounds = self._still_rounds + 1 if stands else 0
        return self._still_rounds >= _STILL_ROUNDS

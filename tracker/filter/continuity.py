"""Whether a pose continues the track, is a new one, or cannot be believed."""

from __future__ import annotations

import numpy as np

from tracker.filter.predict import predict
from tracker.maths import so3
from tracker.maths.gate import chi2_limit
from tracker.state import State
from tracker.tuning import Tuning
from tracker.types import Array

RESETS = 256
UNBROKEN_S, LEAST_GAP_S = 0.1, 0.033


class Continuity:
    """Watch over the poses found in whole frames, and count the jumps among those that go out.

    Swapped colours show the marker where it is, but turned by a third: the place goes on and the attitude jumps. No
    vehicle does that, so such a pose is not believed before the last one sent is too old to contradict it.
    """

    def __init__(self, tuning: Tuning) -> None:
        self.resets = 0
        self._tuning = tuning
        self._sent: State | None = None

    def went_out(self, state: State) -> None:
        """Take note of a state that is sent."""
        self._sent = state

    def believes(self, found: State) -> bool:
        """Say whether a pose found in whole frames may go out; when that is a jump, count it."""
        before = self._sent
        if before is None or not self._jumped(before, found):
            return True
        gap_ns = found.t_ns - before.t_ns
        if 0 <= gap_ns <= self._tuning.continuity_limit_ns and self._turned_in_place(before, found):
            return False
        self.resets = (self.resets + 1) % RESETS
        return True

    def _jumped(self, before: State, found: State) -> bool:
        """Say whether a pose found again is none that an old one can have led to."""
        if not 0 <= found.t_ns - before.t_ns <= self._tuning.continuity_limit_ns:
            return True
        process, gap_s = self._tuning.process, (found.t_ns - before.t_ns) * 1e-9
        if gap_s <= UNBROKEN_S:  # never out of sight: a brisk turn is no jump as long as a vehicle can fly it
            reach_s = max(gap_s, LEAST_GAP_S)
            step_m = float(np.linalg.norm(found.p_BinW - before.p_BinW))
            turn = float(np.linalg.norm(so3.log(before.R_BtoW.T @ found.R_BtoW)))
            if step_m <= process.initial_speed_m_s * reach_s and turn <= 3.0 * process.initial_rate_rad_s * reach_s:
                return False
        error, P = self._step(before, found)
        return float(error @ np.linalg.solve(P, error)) > chi2_limit(self._tuning.gate_probability, 6)

    def _turned_in_place(self, before: State, found: State) -> bool:
        """Say whether the place goes on and only the attitude has jumped."""
        error, P = self._step(before, found)
        distance2 = float(error[:3] @ np.linalg.solve(P[:3, :3], error[:3]))
        near = distance2 <= chi2_limit(self._tuning.gate_probability, 3)
        return near and float(np.linalg.norm(error[3:])) > self._tuning.tilt_limit_rad

    def _step(self, before: State, found: State) -> tuple[Array, Array]:
        """Return by how much a pose differs from what an old one leads to (6,), and the covariance of that (6, 6)."""
        ahead = predict(before, found.t_ns, self._tuning.process).state
        error = np.concatenate((found.p_BinW - ahead.p_BinW, so3.log(ahead.R_BtoW.T @ found.R_BtoW)))
        return error, (ahead.P + found.P)[:6, :6]

"""The last seconds of a simulated motion, to be asked for at any time in between."""

from __future__ import annotations

from collections import deque

from tools.simulate.helicopter import State
from tracker.maths import so3
from tracker.sources.paths import Pose

_MEMORY_NS = 2_000_000_000


class Course:
    """States at a fixed step, newest last.

    step_ns: time between two states.  start_ns, start: the first; before it the vehicle stood there.
    """

    def __init__(self, start_ns: int, start: State, step_ns: int) -> None:
        self._step_ns = step_ns
        self._states: deque[tuple[int, State]] = deque([(start_ns, start)], maxlen=_MEMORY_NS // step_ns)

    @property
    def now_ns(self) -> int:
        """Return the newest state's time [ns]."""
        return self._states[-1][0]

    def add(self, state: State) -> None:
        """Take the state one step later."""
        self._states.append((self.now_ns + self._step_ns, state))

    def back(self, steps: int) -> State:
        """Return the state so many steps ago, the oldest where there are not as many."""
        return self._states[max(len(self._states) - 1 - steps, 0)][1]

    def pose_at(self, t_ns: int) -> Pose:
        """Return p_BinW (3,) [m] and R_BtoW (3, 3) at t_ns, between two steps on the shortest way."""
        back = min((self.now_ns - t_ns) // self._step_ns, len(self._states) - 1)
        later_ns, later = self._states[-1 - back]
        if back + 1 >= len(self._states) or t_ns >= later_ns:
            return later.p_BinW, later.R_BtoW
        _, earlier = self._states[-2 - back]
        share = 1.0 - (later_ns - t_ns) / self._step_ns
        turn = so3.log(earlier.R_BtoW.T @ later.R_BtoW)
        p_BinW = earlier.p_BinW + share * (later.p_BinW - earlier.p_BinW)
        return p_BinW, earlier.R_BtoW @ so3.exp(share * turn)

"""When the autopilot stops trusting its filter.

Source: ArduCopter's ekf_check.cpp as of 4.8 development: ten looks a second; ten bad ones count up to a failure, a
good one takes one off; bad is no position, or the velocity's ratio at twice the threshold, or two of compass, velocity
and position at it.
"""

from __future__ import annotations

import math

from tools.simulate.autopilot.navigation import Variances

_PERIOD_MS, _COUNT_MAX, _FILTER_HZ = 100, 10, 5.0
_KEEP = math.exp(-2.0 * math.pi * _FILTER_HZ * _PERIOD_MS / 1000.0)


class EkfFailsafe:
    """Watch the filter's ratios. Nothing is judged before it was once good."""

    def __init__(self) -> None:
        self._due_ms = 0
        self._count = 0
        self._was_good = False
        self._position = 0.0
        self._velocity = 0.0
        self.acts = False

    def look(self, now_ms: int, variances: Variances, has_position: bool, threshold: float) -> str | None:
        """Look if it is time to; return the text that tells of a new failure. threshold: FS_EKF_THRESH, 0 for never."""
        if now_ms < self._due_ms or threshold <= 0.0:
            return None
        self._due_ms = now_ms + _PERIOD_MS
        self._position = _KEEP * self._position + (1.0 - _KEEP) * variances.position
        self._velocity = _KEEP * self._velocity + (1.0 - _KEEP) * variances.velocity
        over = self._over(variances, threshold)
        good = has_position and not over
        self._was_good = self._was_good or good
        if not self._was_good:
            return None
        self._count = max(self._count - 1, 0) if good else min(self._count + 1, _COUNT_MAX)
        if self._count == 0:
            self.acts = False
        if self._count < _COUNT_MAX or self.acts:
            return None
        self.acts = True
        return f"EKF variance: {'over thresholds' if over else 'position lost'}"

    def _over(self, variances: Variances, threshold: float) -> bool:
        count = int(variances.compass >= threshold)
        if self._velocity >= 2.0 * threshold:
            count += 2
        elif self._velocity >= threshold:
            count += 1
        return count >= 2 or (self._position >= threshold and count >= 1)

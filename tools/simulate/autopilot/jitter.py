"""When a stamped message was made, in the receiver's clock."""

from __future__ import annotations

MOST_LAG_US = 500_000
MESSAGES = 100


class JitterCorrection:
    """Set the sender's clock to ours by the least (arrival - stamp) of each 100 messages, of whatever kind.

    That takes the transport's jitter away and leaves its least delay, which no receiver can see.
    Source: ArduPilot's AP_RTC/JitterCorrection, one for each link, with its 500 ms and 100 messages.
    """

    def __init__(self) -> None:
        self._offset_us: int | None = None
        self._least_us = 0
        self._count = 0

    def corrected_us(self, stamp_us: int, arrived_us: int) -> int:
        """Return the stamp in the receiver's clock [us]: never after the arrival, never 500 ms before it."""
        lag_us = arrived_us - stamp_us
        if self._offset_us is None or lag_us < self._offset_us:
            self._offset_us = lag_us
        self._offset_us = max(self._offset_us, lag_us - MOST_LAG_US)
        corrected_us = stamp_us + self._offset_us
        self._learn(lag_us)
        return corrected_us

    def _learn(self, lag_us: int) -> None:
        self._least_us = lag_us if self._count == 0 else min(self._least_us, lag_us)
        self._count += 1
        if self._count == MESSAGES:
            self._offset_us, self._count = self._least_us, 0

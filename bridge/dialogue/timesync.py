"""What time the autopilot has: offset and skew of its clock against ours, from the TIMESYNC exchange.

MAVLink's time synchronisation protocol: a request carries tc1 = 0 and ts1 = the asker's time; the reply gives ts1 back
with tc1 = the answerer's time. Half the round trip is taken as the way there.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from bridge.dialect import make_message
from bridge.wire import Message, Received

TIMESYNC = "TIMESYNC"
RTT_LIMIT_NS = 10_000_000
CONVERGED_SAMPLES = 500
FIRST_GAIN, LAST_GAIN = 0.05, 0.003
JUMP_NS, JUMPS_IN_A_ROW = 100_000_000, 5
REBOOT_NS = 1_000_000_000
ASK_QUICKLY_NS, ASK_NS = 20_000_000, 200_000_000
WINDOW = 100
IN_VAIN = 10  # so many questions without a usable answer, and asking quickly only fills the line


@dataclass(frozen=True, slots=True)
class SyncState:
    """How well the autopilot's clock is known.

    offset_ns: the autopilot's time + offset is ours [ns].  skew_ppm: how much faster our clock runs than its.
    rtt_ms: median round trip of the newest exchanges.  spread_ms: one sigma of their offsets about the estimate.
    samples: exchanges used since the start or the last restart.  refused: replies too slow or never asked for.
    restarts: how often the estimate was begun anew, after the autopilot's clock had jumped.
    """

    offset_ns: int
    skew_ppm: float
    rtt_ms: float
    spread_ms: float
    samples: int
    refused: int
    restarts: int

    @property
    def converged(self) -> bool:
        """Whether the gains have come to their last values."""
        return self.samples >= CONVERGED_SAMPLES


def answer(request: Received) -> Message | None:
    """Return the reply to another's TIMESYNC request, stamped with its arrival; None if it is no request.

    Args:
        request: with `arrived_ns` on the clock that stamps the poses.
    Source: PX4 uses external stamps only after its requests were answered in their own clock; 0 names no time.
    """
    if request.message != TIMESYNC or request.whole("tc1") != 0:
        return None
    return make_message(TIMESYNC, request.arrived_ns, tc1=request.arrived_ns, ts1=request.whole("ts1"))


class TimeSync:
    """Ask the autopilot for its time and follow it.

    Source: the double exponential filter that PX4 and mavros use (Holt's linear method): offset and skew are carried on
    to the sample's time and corrected by it; the gains fall from 0.05 to 0.003 over 500 samples, by the shape
    1 - exp(0.5 (1 - 1 / (1 - progress))). Replies slower than 10 ms are not used. More than 5 samples in a row that lie
    100 ms off begin the estimate anew: the far clock was set or its owner rebooted.
    """

    def __init__(self) -> None:
        self._asked: deque[int] = deque(maxlen=64)
        self._due_ns: int | None = None
        self._rtts_ns: deque[int] = deque(maxlen=WINDOW)
        self._residuals_ns: deque[float] = deque(maxlen=WINDOW)
        self._offset_ns = 0.0
        self._skew = 0.0
        self._at_ns = 0
        self._far_ns: int | None = None
        self._samples = self._refused = self._restarts = self._jumps = self._in_vain = 0
        self.rebooted = False
        """Whether the newest reply's clock stood before the one before it: its owner started anew."""

    def request(self, now_ns: int) -> Message | None:
        """Return the request that is due now, quickly one after the other until the estimate has converged.

        Where answers are too slow to be used, as at 57600 baud, or do not come, quick questions are but a burden.
        """
        if self._due_ns is not None and now_ns < self._due_ns:
            return None
        quickly = self._samples < CONVERGED_SAMPLES and self._in_vain < IN_VAIN
        self._due_ns = now_ns + (ASK_QUICKLY_NS if quickly else ASK_NS)
        self._in_vain += 1
        self._asked.append(now_ns)
        return make_message(TIMESYNC, now_ns, tc1=0, ts1=now_ns)

    def take(self, reply: Received) -> None:
        """Take a reply to one of our requests; anything else is counted and left."""
        sent_ns, far_ns = reply.whole("ts1"), reply.whole("tc1")
        if sent_ns not in self._asked or far_ns <= 0:
            self._refused += 1
            return
        self._asked.remove(sent_ns)
        self.rebooted = self._far_ns is not None and far_ns < self._far_ns - REBOOT_NS
        self._far_ns = far_ns
        rtt_ns = reply.arrived_ns - sent_ns
        if not 0 <= rtt_ns < RTT_LIMIT_NS:
            self._refused += 1
            return
        self._in_vain = 0
        self._rtts_ns.append(rtt_ns)
        self._follow((sent_ns + reply.arrived_ns) / 2 - far_ns, reply.arrived_ns)

    def state(self) -> SyncState | None:
        """Return what is known, None before the first exchange."""
        if not self._samples:
            return None
        rtts = sorted(self._rtts_ns)
        residuals = self._residuals_ns
        spread_ns = math.sqrt(sum(r * r for r in residuals) / len(residuals)) if residuals else 0.0
        return SyncState(
            round(self._offset_ns), self._skew * 1e6, rtts[len(rtts) // 2] / 1e6, spread_ns / 1e6, self._samples,
            self._refused, self._restarts,
        )  # fmt: skip

    def ours_ns(self, far_ns: int) -> int | None:
        """Return our time at an instant of the autopilot's clock [ns]; None while nothing is known."""
        return round(far_ns + self._offset_ns) if self._samples else None

    def _follow(self, offset_ns: float, now_ns: int) -> None:
        expected_ns = self._offset_ns + self._skew * (now_ns - self._at_ns)
        deviation_ns = offset_ns - expected_ns
        if self._samples and (self.rebooted or abs(deviation_ns) > JUMP_NS):
            self._jumps += 1
            if not self.rebooted and self._jumps <= JUMPS_IN_A_ROW:
                return
            self._samples = 0
            self._restarts += 1
            self._residuals_ns.clear()
        self._jumps = 0
        if not self._samples:
            self._offset_ns, self._skew = offset_ns, 0.0
        else:
            gain = _gain(self._samples)
            before_ns = self._offset_ns
            self._offset_ns = expected_ns + gain * deviation_ns
            passed_ns = now_ns - self._at_ns
            if passed_ns > 0:
                self._skew += gain * ((self._offset_ns - before_ns) / passed_ns - self._skew)
            self._residuals_ns.append(deviation_ns)
        self._at_ns = now_ns
        self._samples += 1


def _gain(samples: int) -> float:
    """Return the filter's gain after so many samples."""
    if samples >= CONVERGED_SAMPLES:
        return LAST_GAIN
    progress = samples / CONVERGED_SAMPLES
    share = 1.0 - math.exp(0.5 * (1.0 - 1.0 / (1.0 - progress)))
    return share * LAST_GAIN + (1.0 - share) * FIRST_GAIN

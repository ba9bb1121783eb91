"""A run's turns, as the loop would give them, for whatever watches it."""

from __future__ import annotations

import numpy as np

from bridge.alarms import Limits
from bridge.monitor import Monitor
from bridge.telemetry.gauges import Names
from bridge.telemetry.post import Post
from bridge.telemetry.snapshot import About
from bridge.telemetry.states import Surroundings
from bridge.telemetry.telemetry import Telemetry
from bridge.wire import LinkState, Sent
from tests.bridge.estimates import estimate, step
from tracker.types import Frame

IMAGE = np.zeros((2, 2, 3), np.uint8)
PERIOD_NS = 50_000_000
NAMES = Names(("cam0", "cam1"), ("red", "green", "blue"), (0.0, 2.0))
LINK = "udpout:127.0.0.1:14550"


def quiet() -> Surroundings:
    """Return surroundings in which all is well."""
    return Surroundings((LinkState(LINK, True, "", 0, 0, 0),))


class Run:
    """A run at 20 Hz whose stopwatch goes with its stream time."""

    def __init__(self, post: Post | None = None, period_ns: int = PERIOD_NS) -> None:
        self.now_ns = 10_000_000_000
        self.monitor = Monitor(NAMES.cameras)
        self._period_ns = period_ns
        self.telemetry = Telemetry(About("sim:x"), NAMES, Limits(), self.monitor, post, lambda: self.now_ns)

    def fly(self, turns: int) -> Run:
        """Take so many frames, each with its estimate and one datagram 4 ms after it."""
        for k in range(turns):
            self.now_ns += self._period_ns
            frame = Frame(k % 2, self.now_ns, IMAGE, available_ns=self.now_ns)
            made = step(estimate(t_ns=self.now_ns, available_ns=self.now_ns))
            sent = (Sent(LINK, "ODOMETRY", self.now_ns, self.now_ns + 4_000_000, self.now_ns, b"x", {}),)
            self.monitor.take(frame, made, sent)
            self.telemetry.take(frame, made, sent, self.now_ns, quiet)
        return self

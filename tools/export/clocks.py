"""Clocks beside stream time: the autopilot's, by the log's time sync, and the wall clock. Offsets, skews, jumps."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

NS = 10**9
JUMP_NS = 50_000_000  # two readings of the wall clock a second apart agree far better than this
PLAUSIBLE_NS = 2 * NS  # a message is measured at most so long before it arrives
AHEAD_NS = 100_000_000  # or after it, by what the clocks' alignment may err
KEPT_JUMPS = 100


class Line:
    """A straight line through points that come one by one: y over x [ns], without keeping them."""

    def __init__(self) -> None:
        self.count = 0
        self._x0 = self._y0 = 0
        self._mean_x = self._mean_y = self._xx = self._xy = self._yy = 0.0

    def add(self, x_ns: int, y_ns: int) -> None:
        """Take in a point. Source: Welford 1962, for two variables."""
        if not self.count:
            self._x0, self._y0 = x_ns, y_ns
        x, y = (x_ns - self._x0) * 1e-9, (y_ns - self._y0) * 1e-9
        self.count += 1
        dx, dy = x - self._mean_x, y - self._mean_y
        self._mean_x += dx / self.count
        self._mean_y += dy / self.count
        self._xx += dx * (x - self._mean_x)
        self._xy += dx * (y - self._mean_y)
        self._yy += dy * (y - self._mean_y)

    @property
    def mean_ns(self) -> int:
        """Return the mean of y [ns]."""
        return self._y0 + round(self._mean_y * NS)

    @property
    def slope_ppm(self) -> float | None:
        """Return by how many millionths y grows with x; None for fewer than two points."""
        return self._xy / self._xx * 1e6 if self._xx > 0 else None

    @property
    def scatter_ms(self) -> float | None:
        """Return one standard deviation about the line [ms]; None for fewer than three points."""
        if self.count < 3 or self._xx <= 0:
            return None
        return math.sqrt(max(0.0, self._yy - self._xy**2 / self._xx) / (self.count - 2)) * 1e3


class WallClock:
    """The wall clock less stream time, from `/clock`. jumps: (stream time [ns], step [ns]) of each, the first 100."""

    def __init__(self) -> None:
        self.lines: list[Line] = []
        self.jumps: list[tuple[int, int]] = []
        self.jump_count = 0
        self._last_ns: int | None = None

    def take(self, value: Mapping[str, Any]) -> None:
        """Take in one `/clock` message."""
        ahead_ns = value["wall_ns"] - value["stream_ns"]
        stepped = self._last_ns is not None and abs(ahead_ns - self._last_ns) > JUMP_NS
        if stepped and self._last_ns is not None:
            self.jump_count += 1
            if len(self.jumps) < KEPT_JUMPS:
                self.jumps.append((value["stream_ns"], ahead_ns - self._last_ns))
        if not self.lines or (stepped and len(self.lines) < KEPT_JUMPS):
            self.lines.append(Line())
        self.lines[-1].add(value["stream_ns"], ahead_ns)
        self._last_ns = ahead_ns


@dataclass(slots=True)
class Boot:
    """One life of an autopilot, from a restart of its clock to the next. times, offsets: of each exchange [ns]."""

    times_ns: list[int] = field(default_factory=list)
    offsets_ns: list[int] = field(default_factory=list)
    line: Line = field(default_factory=Line)

    def offset_ns(self, at_ns: int) -> int:
        """Return the offset at a stream time, straight between exchanges, level before and after them [ns]."""
        after = bisect_right(self.times_ns, at_ns)
        if after == 0 or after == len(self.times_ns):
            return self.offsets_ns[min(after, len(self.times_ns) - 1)]
        from_ns, to_ns = self.times_ns[after - 1], self.times_ns[after]
        rise_ns = self.offsets_ns[after] - self.offsets_ns[after - 1]
        return self.offsets_ns[after - 1] + rise_ns * (at_ns - from_ns) // (to_ns - from_ns)


class AutopilotClock:
    """Stream time less the autopilot's time since boot, over one link, from `/timesync`."""

    def __init__(self) -> None:
        self.boots: list[Boot] = []
        self._restarts: int | None = None

    def take(self, value: Mapping[str, Any]) -> None:
        """Take in one `/timesync` message."""
        if not value["samples"]:
            return
        if value["restarts"] != self._restarts:
            self._restarts = value["restarts"]
            self.boots.append(Boot())
        boot = self.boots[-1]
        boot.times_ns.append(value["t_ns"])
        boot.offsets_ns.append(value["offset_ns"])
        boot.line.add(value["t_ns"], value["offset_ns"])

    def stream_ns(self, autopilot_ns: int, arrived_ns: int) -> int | None:
        """Return the stream time of an autopilot's time; None where no exchange speaks of that life of it.

        autopilot_ns: since boot.  arrived_ns: stream time at which the message came in; it tells the lives apart.
        """
        best: int | None = None
        for boot in self.boots:
            t_ns = autopilot_ns + boot.offset_ns(arrived_ns)
            plausible = -AHEAD_NS <= arrived_ns - t_ns <= PLAUSIBLE_NS
            if plausible and (best is None or abs(arrived_ns - t_ns) < abs(arrived_ns - best)):
                best = t_ns
        return best

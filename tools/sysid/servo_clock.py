"""When the servos were told: the autopilot's time in the stream's, as far as it is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.log.received import NO_TIME

Times = NDArray[np.int64]
WRAP_NS = 2**32 * 1000
"""SERVO_OUTPUT_RAW counts microseconds in 32 bits: it starts anew every 71.6 minutes."""

_ARRIVAL_S = 0.005
"""One sigma of how late messages arrive, where nothing better is known."""

_MOST_OFF_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Clock:
    """By which clock times came, in words, and one sigma of them [s]: an error common to all, not their scatter."""

    name: str
    sigma_s: float


def on_stream_clock(arrived: Times, stamped: Times, clocks: Sequence[Mapping[str, Any]]) -> tuple[Times, Clock]:
    """Return when messages were made, by the stream's clock (n,) [ns].

    Args:
        arrived: when they arrived (n,) [ns].
        stamped: the autopilot's time since boot in them (n,) [ns], NO_TIME for none.
        clocks: the log's `/timesync` messages of that link, in order.
    Returns:
        With TIMESYNC, the stamp plus the newest offset known at its arrival; without, or where that makes no sense,
        the arrival.
    """
    if not clocks or (stamped == NO_TIME).any():
        return arrived, Clock("arrival, no TIMESYNC in the log", _ARRIVAL_S)
    known = np.array([value["t_ns"] for value in clocks], dtype=np.int64)
    offsets = np.array([value["offset_ns"] for value in clocks], dtype=np.int64)
    newest = np.clip(np.searchsorted(known, arrived, side="right") - 1, 0, len(known) - 1)
    times = stamped + offsets[newest]
    times = times + np.round((arrived - times) / WRAP_NS).astype(np.int64) * WRAP_NS
    if abs(float(np.median(arrived - times))) > _MOST_OFF_NS:
        return arrived, Clock("arrival, TIMESYNC makes no sense", _ARRIVAL_S)
    spread_ms = float(np.median([value["spread_ms"] for value in clocks]))
    round_trip_ms = float(np.median([value["rtt_ms"] for value in clocks]))
    # The way there may take any part of the round trip: half of it is assumed, a quarter is one sigma of the rest.
    return times, Clock("the autopilot's clock", 1e-3 * float(np.hypot(spread_ms, round_trip_ms / 4.0)))

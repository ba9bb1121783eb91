"""The autopilot's time as ours: by the TIMESYNC exchange, else by when its messages came."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.dialogue.timesync import SyncState
from bridge.wire import Received


def boot_ns(message: Received) -> int:
    """Return the time since its boot that a message carries [ns]."""
    if "time_usec" in message.fields:
        return message.whole("time_usec") * 1000
    return message.whole("time_boot_ms") * 1_000_000


def our_times(messages: Sequence[Received], sync: SyncState | None) -> list[int]:
    """Return each message's instant on our clock [ns].

    Without TIMESYNC the message that travelled least is taken to have travelled in no time.
    """
    if not messages:
        return []
    if sync is not None:
        return [boot_ns(message) + sync.offset_ns for message in messages]
    offset_ns = min(message.arrived_ns - boot_ns(message) for message in messages)
    return [boot_ns(message) + offset_ns for message in messages]

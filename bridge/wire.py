"""Values on their way over a link, and the record of what went."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

FieldValue = int | float | str | list[float] | list[int]


class Message(NamedTuple):  # these two are made for each message that goes out: a tuple costs a quarter of a dataclass
    """One MAVLink message that still waits for its sequence number.

    name: its MAVLink name.  t_ns: stream time it speaks of [ns].
    available_ns: stopwatch reading when the newest frame behind it stood in memory, 0 for none [ns].
    fields: its fields by MAVLink name; floats are already rounded to the 32 bits that go on the wire.
    slot: while it waits for a slow link, a newer message of the same name and slot takes its place; questions about
        different parameters, say, have slots of their own.
    """

    name: str
    t_ns: int
    available_ns: int
    fields: Mapping[str, FieldValue]
    slot: str = ""


class Sent(NamedTuple):
    """One MAVLink message that a link's kernel buffer took.

    link: the link's URI.  message: its MAVLink name.
    t_ns: stream time it speaks of: the estimate's, or the clock's for a heartbeat [ns].
    sent_ns: stopwatch reading after the write [ns].
    available_ns: stopwatch reading when the newest frame behind it stood in memory, 0 for none [ns].
    raw: the whole MAVLink 2 frame.  fields: its decoded fields by MAVLink name.
    """

    link: str
    message: str
    t_ns: int
    sent_ns: int
    available_ns: int
    raw: bytes
    fields: Mapping[str, FieldValue]


@dataclass(frozen=True, slots=True, eq=False)
class Received:
    """One MAVLink message that came in whole, with the right checksum.

    message: its MAVLink name.  arrived_ns: stream time at which its last byte was read [ns].
    """

    message: str
    system_id: int
    component_id: int
    sequence: int
    fields: Mapping[str, FieldValue]
    raw: bytes
    arrived_ns: int = 0

    def whole(self, field: str) -> int:
        """Return a field that is a whole number by its definition; -1 if the message has none such."""
        value = self.fields.get(field)
        return value if isinstance(value, int) else -1

    def number(self, field: str) -> float:
        """Return a field that is a number by its definition; NaN if the message has none such."""
        value = self.fields.get(field)
        return float(value) if isinstance(value, int | float) else math.nan


@dataclass(frozen=True, slots=True)
class LinkState:
    """How one link fares.

    name: the link's URI.  up: nothing is known to be wrong with it.  reason: why it is down, empty when up.
    sent: messages the kernel took.  dropped: messages that could not go, or that came back refused.
    superseded: messages a newer one of the same name replaced before they could go.
    """

    name: str
    up: bool
    reason: str
    sent: int
    dropped: int
    superseded: int

"""Messages as an autopilot sends them, through real frames and the reader."""

from __future__ import annotations

from bridge.dialect import Encoder, Identity, Reader, enum, make_message
from bridge.wire import FieldValue, Message, Received

BASE_NS = 5_000_000_000


def from_autopilot(
    name: str, arrived_ns: int, *, system_id: int = 1, component_id: int = 1, **fields: FieldValue
) -> Received:
    """Return a message that came in at arrived_ns [ns]."""
    return heard(make_message(name, 0, "", **fields), arrived_ns, system_id=system_id, component_id=component_id)


def heard(message: Message, arrived_ns: int, *, system_id: int = 1, component_id: int = 1) -> Received:
    """Return a message as the reader gives it after its way over a wire."""
    (received,) = Reader().feed(Encoder(Identity(system_id, component_id))(message, 0), arrived_ns)
    return received


def beat(arrived_ns: int, *, system_id: int = 1, component_id: int = 1, kind: str = "ARDUPILOTMEGA") -> Received:
    """Return an autopilot's heartbeat."""
    return from_autopilot(
        "HEARTBEAT", arrived_ns, system_id=system_id, component_id=component_id,
        type=enum("MAV_TYPE_HELICOPTER"), autopilot=enum(f"MAV_AUTOPILOT_{kind}"),
    )  # fmt: skip


def reply(request: Message, arrived_ns: int, far_ns: int) -> Received:
    """Return the autopilot's answer to a TIMESYNC request."""
    return from_autopilot("TIMESYNC", arrived_ns, tc1=far_ns, ts1=request.fields["ts1"])

"""The log's topics of the far end: what came in, its clock against ours, its state, the link it is on."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from typing import Any

from foxglove_schemas_protobuf.Log_pb2 import Log

from bridge.dialogue import DialogueState
from bridge.dialogue.peer import Autopilot, Peer
from bridge.dialogue.timesync import SyncState
from bridge.heard import Heard
from bridge.log.topics import Schema, Topic, fields_schema, integer, json_topic, number, text
from bridge.wire import FieldValue, LinkState, Received

STATUSTEXT = "STATUSTEXT"
RECEIVED_PREFIX = "/mavlink/received/"
NO_TIME = -1
CALENDAR_US = 10**15  # MAVLink: a time_usec as large as this is counted from 1970, not from the start
Put = Callable[[Topic, dict[str, Any], int, int], None]
Remark = Callable[[int, int, Log.Level.ValueType, str, str], None]
_ERROR, _WARNING = 3, 4  # MAV_SEVERITY: this and what is worse


def _flag(description: str) -> Schema:
    return {"type": "boolean", "description": description}


TIMESYNC = json_topic(
    "/timesync",
    "posebridge.TimeSync",
    link=text("URI of the link"),
    t_ns=integer("stream time at which the loop knew it [ns]"),
    offset_ns=integer("stream time less the autopilot's time since boot, at t_ns [ns]"),
    skew_ppm=number("how much faster stream time runs than the autopilot's clock"),
    rtt_ms=number("median round trip of the newest exchanges [ms]"),
    spread_ms=number("one sigma of their offsets about the estimate [ms]"),
    samples=integer("exchanges used since the start or the last restart"),
    refused=integer("replies too slow, or never asked for"),
    restarts=integer("how often the estimate was begun anew, the autopilot's clock having jumped"),
)
AUTOPILOT = json_topic(
    "/autopilot",
    "posebridge.Autopilot",
    link=text("URI of the link"),
    heard=_flag("whether an autopilot was heard there"),
    system_id=integer("its MAVLink system id, 0 while none was heard"),
    component_id=integer("its MAVLink component id, 0 while none was heard"),
    autopilot=text("its kind by its heartbeat, empty while none was heard"),
    away=_flag("whether it has fallen silent"),
    profile=text("what it is sent"),
    origin=text("how far the matter of its origin has come, empty where it needs none"),
    holding=text("why no poses are sent, empty when they are"),
    yaw=text("what is wrong with our yaw against the vehicle's motion, empty for nothing"),
    full=_flag("whether the link takes less than it is given"),
    streams=text("what it was asked to tell, and what came of it"),
    by_arrival=_flag("whether it counts a pose as of its arrival yet: PX4, before its time sync stands"),
    too_old=integer("estimates not sent for their age"),
    too_close=integer("estimates not sent because they followed the last one too closely"),
    strangers=integer("messages of others than the autopilot"),
    unsigned=integer("messages refused for want of a right signature"),
)
LINK = json_topic(
    "/link",
    "posebridge.Link",
    link=text("its URI"),
    up=_flag("whether nothing is known to be wrong with it"),
    reason=text("why it is down, empty when up"),
    sent=integer("messages the kernel took"),
    dropped=integer("messages that could not go, or came back refused"),
    superseded=integer("messages a newer one of the same name replaced before they could go"),
)


class HeardWriter:
    """Write what was heard.

    put: appends a value to a topic, with its log and publish time [ns].
    remark: leaves a line in the log panel: log and publish time [ns], level, whose, the line.
    """

    def __init__(self, put: Put, remark: Remark) -> None:
        self._put = put
        self._remark = remark
        self._topics: dict[str, Topic] = {}
        self._troubles: dict[str, str] = {}

    def write(self, heard: Heard, now_ns: int) -> None:
        """Append what one turn of the loop heard."""
        for link, message in heard.received:
            topic = self._topics.get(message.message)
            if topic is None:
                topic = self._topics[message.message] = received_topic(message)
            self._put(topic, received_value(link, message), now_ns, message.arrived_ns)
            if message.message == STATUSTEXT:
                whose = f"system {message.system_id}"
                self._remark(now_ns, message.arrived_ns, *line_of(message.fields, whose))
        if heard.left_out:
            words = f"{heard.left_out} messages that came in are not in the log: more than it takes in one turn"
            self._remark(now_ns, now_ns, Log.WARNING, "recorder", words)
        for link, sync in heard.clocks:
            self._put(TIMESYNC, clock_value(link, sync, now_ns), now_ns, now_ns)
        for link, state in heard.far_ends:
            self._put(AUTOPILOT, autopilot_value(link, state), now_ns, now_ns)
        for each in heard.links:
            self._put(LINK, link_value(each), now_ns, now_ns)
            self._tell_of_link(each, now_ns)

    def _tell_of_link(self, link: LinkState, now_ns: int) -> None:
        """Leave a line when a link goes down, for whatever reason, and when it is up again."""
        if link.reason != self._troubles.get(link.name, ""):
            self._troubles[link.name] = link.reason
            words = f"link down: {link.reason}" if link.reason else "link up again"
            self._remark(now_ns, now_ns, Log.WARNING if link.reason else Log.INFO, link.name, words)


def line_of(fields: Mapping[str, FieldValue], whose: str) -> tuple[Log.Level.ValueType, str, str]:
    """Return a STATUSTEXT as a line of the log panel: level, whose, text."""
    severity = fields["severity"]
    worst = severity if isinstance(severity, int) else 0
    level = Log.ERROR if worst <= _ERROR else Log.WARNING if worst <= _WARNING else Log.INFO
    return level, whose, str(fields["text"])


def received_topic(message: Received) -> Topic:
    """Make the topic of one MAVLink message, its schema drawn from the first one's fields, so viewers can plot them."""
    return json_topic(
        RECEIVED_PREFIX + message.message,
        f"posebridge.received.{message.message}",
        link=text("URI of the link it came by"),
        system_id=integer("whose it is"),
        component_id=integer("of which part"),
        sequence=integer("its number, 0..255: a hole is a message lost on the way"),
        arrived_ns=integer("stream time at which its last byte was read [ns]"),
        autopilot_ns=integer("the sender's time since boot in it, -1 for none [ns]"),
        raw={"type": "string", "contentEncoding": "base64", "description": "the whole MAVLink frame"},
        fields=fields_schema(message.fields),
    )


def received_value(link: str, message: Received) -> dict[str, Any]:
    """Return the `/mavlink/received/...` message of one that came in."""
    return {
        "link": link,
        "system_id": message.system_id,
        "component_id": message.component_id,
        "sequence": message.sequence,
        "arrived_ns": message.arrived_ns,
        "autopilot_ns": autopilot_ns(message.fields),
        "raw": base64.b64encode(message.raw).decode(),
        "fields": dict(message.fields),
    }


def autopilot_ns(fields: Mapping[str, FieldValue]) -> int:
    """Return the sender's time since boot that a message carries [ns], NO_TIME for none or a calendar's."""
    boot_ms, usec = fields.get("time_boot_ms"), fields.get("time_usec")
    if isinstance(boot_ms, int):
        return boot_ms * 1_000_000
    return usec * 1000 if isinstance(usec, int) and usec < CALENDAR_US else NO_TIME


def clock_value(link: str, sync: SyncState, now_ns: int) -> dict[str, Any]:
    """Return the `/timesync` message of a link."""
    return {
        "link": link,
        "t_ns": now_ns,
        "offset_ns": sync.offset_ns,
        "skew_ppm": sync.skew_ppm,
        "rtt_ms": sync.rtt_ms,
        "spread_ms": sync.spread_ms,
        "samples": sync.samples,
        "refused": sync.refused,
        "restarts": sync.restarts,
    }


def clock_of(value: Mapping[str, Any]) -> SyncState:
    """Read a `/timesync` message back."""
    names = ("offset_ns", "skew_ppm", "rtt_ms", "spread_ms", "samples", "refused", "restarts")
    return SyncState(**{name: value[name] for name in names})


def autopilot_value(link: str, state: DialogueState) -> dict[str, Any]:
    """Return the `/autopilot` message of a link."""
    peer = state.peer
    return {
        "link": link,
        "heard": peer is not None,
        "system_id": 0 if peer is None else peer.system_id,
        "component_id": 0 if peer is None else peer.component_id,
        "autopilot": "" if peer is None else peer.autopilot.value,
        **{name: getattr(state, name) for name in _STATE_FIELDS},
    }


def autopilot_of(value: Mapping[str, Any]) -> DialogueState:
    """Read an `/autopilot` message back, its clock apart; one of an older log lacks a flag or two."""
    peer = None
    if value["heard"]:
        peer = Peer(value["system_id"], value["component_id"], Autopilot(value["autopilot"]))
    return DialogueState(peer=peer, sync=None, **{name: value[name] for name in _STATE_FIELDS if name in value})


def link_value(state: LinkState) -> dict[str, Any]:
    """Return the `/link` message of a link."""
    return {"link": state.name, **{name: getattr(state, name) for name in _LINK_FIELDS}}


def link_of(value: Mapping[str, Any]) -> LinkState:
    """Read a `/link` message back."""
    return LinkState(name=value["link"], **{name: value[name] for name in _LINK_FIELDS})


_STATE_FIELDS = (
    "away", "profile", "origin", "holding", "yaw", "full", "streams", "by_arrival", "too_old", "too_close", "strangers",
    "unsigned",
)  # fmt: skip
_LINK_FIELDS = ("up", "reason", "sent", "dropped", "superseded")

"""A log's MAVLink frames as a .tlog: eight bytes of wall clock, big-endian [us since 1970], one frame, and so on.

Ground stations, MAVExplorer and pymavlink's tools read it. The wall clock is that of `/clock`,
as it was last read, within a second; a log that has none gives stream time.
"""

from __future__ import annotations

import base64
import heapq
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from bridge.log import topics
from bridge.log.reader import Record
from tools.export.columns import RECEIVED_PREFIX

_TIME = struct.Struct(">Q")
HELD_NS = 2_000_000_000  # a message is written so long after it came at most: slow links report late


class Topics:
    """The topics of a .tlog, for `LogReader.records`."""

    def __contains__(self, topic: object) -> bool:
        """Say whether a topic holds MAVLink frames or the clock."""
        return topic == topics.CLOCK.name or (
            isinstance(topic, str) and topic.startswith((topics.SENT_PREFIX, RECEIVED_PREFIX))
        )


class _Frame(NamedTuple):
    at_ns: int
    number: int
    raw: bytes


def write_tlog(records: Iterator[Record], path: Path) -> int:
    """Write every frame sent and received, in the order of their times; return how many."""
    waiting: list[_Frame] = []
    wall_ahead_ns = 0
    count = 0
    with path.open("wb") as file:
        for record in records:
            if record.topic == topics.CLOCK.name:
                wall_ahead_ns = record.value["wall_ns"] - record.value["stream_ns"]
                continue
            at_ns = record.value.get("arrived_ns", record.log_ns)
            heapq.heappush(waiting, _Frame(at_ns + wall_ahead_ns, count, base64.b64decode(record.value["raw"])))
            count += 1
            while waiting[0].at_ns < record.log_ns + wall_ahead_ns - HELD_NS:
                file.write(_packed(heapq.heappop(waiting)))
        while waiting:
            file.write(_packed(heapq.heappop(waiting)))
    return count


def _packed(frame: _Frame) -> bytes:
    return _TIME.pack(max(0, frame.at_ns // 1000)) + frame.raw

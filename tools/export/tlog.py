"""A log's MAVLink frames as one .tlog, all links in it, in the form of `bridge.log.tlog`.

Ground stations, MAVExplorer and pymavlink's tools read it. The wall clock is that of `/clock`,
as it was last read, within a second; a log that has none gives stream time.
"""

from __future__ import annotations

import base64
import heapq
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from bridge.log import topics
from bridge.log.reader import LogReader, Record
from bridge.log.tlog import stamp
from tools.export.columns import RECEIVED_PREFIX

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
    link: int
    raw: bytes


def links_of(reader: LogReader) -> tuple[str, ...]:
    """Return the names of a log's links as its config orders them; none where it holds no config."""
    config = json.loads(reader.attachments().get("config.json", b"{}"))
    return tuple(str(link["uri"]) for link in config.get("links", ()))


def write_tlog(records: Iterator[Record], path: Path, links: Sequence[str]) -> int:
    """Write every frame sent and received, in the order of their times; return how many.

    links: in the order of their numbers; one that is not among them gets the next.
    """
    numbers = {link: number for number, link in enumerate(links)}
    waiting: list[_Frame] = []
    wall_ahead_ns = 0
    count = 0
    with path.open("wb") as file:
        for record in records:
            if record.topic == topics.CLOCK.name:
                wall_ahead_ns = record.value["wall_ns"] - record.value["stream_ns"]
                continue
            at_ns = record.value.get("arrived_ns", record.log_ns)
            link = numbers.setdefault(record.value["link"], len(numbers))
            frame = _Frame(at_ns + wall_ahead_ns, count, link, base64.b64decode(record.value["raw"]))
            heapq.heappush(waiting, frame)
            count += 1
            while waiting[0].at_ns < record.log_ns + wall_ahead_ns - HELD_NS:
                file.write(_packed(heapq.heappop(waiting)))
        while waiting:
            file.write(_packed(heapq.heappop(waiting)))
    return count


def _packed(frame: _Frame) -> bytes:
    return stamp(frame.at_ns, frame.link) + frame.raw

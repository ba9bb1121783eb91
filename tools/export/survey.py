"""A first walk through a log: which streams it holds, how regularly they came, and how its clocks ran."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from bridge.log import topics
from bridge.log.losses import Loss
from bridge.log.reader import LogReader, OnOffset, Record
from tools.export.clocks import AutopilotClock, WallClock
from tools.export.columns import ESTIMATES, GROUPS, Group
from tools.export.intervals import Intervals
from tools.export.resample import Spacing
from tracker.errors import OperatorError

TIMESYNC, CLOCK = "/timesync", topics.CLOCK.name
WANTED = frozenset({*GROUPS, TIMESYNC, CLOCK})
GAP_PERIODS = 3.0
LONGEST_GAP_NS = 10_000_000_000
IMPOSSIBLE_NS = 3600 * 10**9


class Key(NamedTuple):
    """Whose stream it is: the group, and for messages of the far end the link and the sender."""

    group: str
    link: str = ""
    system_id: int = 0
    component_id: int = 0


class TimeSource(StrEnum):
    """How a stream's times were found."""

    STREAM = "stream time"
    SYNC = "autopilot's clock by time sync"
    ARRIVAL = "arrival"


@dataclass(slots=True, eq=False)
class StreamSurvey:
    """One stream. used: which columns ever held a number.  first_ns, last_ns: stream time, by arrival if need be."""

    group: Group
    count: int = 0
    first_ns: int = 0
    last_ns: int = 0
    used: list[bool] = field(default_factory=list)
    intervals: Intervals = field(default_factory=Intervals)
    _last_ns: int | None = None

    def take(self, own_ns: int, at_ns: int, row: list[float]) -> None:
        """Take in one record. own_ns: by its sender's clock.  at_ns: stream time, roughly."""
        if not self.count:
            self.first_ns, self.used = at_ns, [False] * len(row)
        self.count += 1
        self.last_ns = max(self.last_ns, at_ns)
        self.used = [was or math.isfinite(one) for was, one in zip(self.used, row, strict=True)]
        if self._last_ns is not None and own_ns > self._last_ns:
            self.intervals.add(own_ns - self._last_ns)
        self._last_ns = own_ns

    def spacing(self, step_ns: float, gap_ns: int | None) -> Spacing:
        """Return how far apart samples usually are, and how long a gap may be filled."""
        period_ns = self.intervals.quantile_ns(0.5) or 1e9
        usual_ns = min(round(GAP_PERIODS * period_ns), LONGEST_GAP_NS)
        return Spacing(period_ns, usual_ns if gap_ns is None else gap_ns, step_ns)


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What a log holds.

    clocks: of the autopilots, by link.  wall: the wall clock, None for a run that took no account of it (pace fast).
    unusable: records an hour or more off their time, or without what this version reads.
    """

    streams: Mapping[Key, StreamSurvey]
    clocks: Mapping[str, AutopilotClock]
    wall: WallClock | None
    lost: tuple[Loss, ...]
    unusable: int

    @property
    def first_ns(self) -> int:
        """Stream time of the first sample [ns]."""
        return min(stream.first_ns for stream in self.streams.values())

    @property
    def last_ns(self) -> int:
        """Stream time of the last sample [ns]."""
        return max(stream.last_ns for stream in self.streams.values())


class Sample(NamedTuple):
    """One record of a stream. own_ns: by its sender's clock, -1 for none.  arrived_ns: stream time [ns]."""

    key: Key
    own_ns: int
    arrived_ns: int
    row: list[float]


def sample_of(record: Record) -> Sample | None:
    """Read a record of a group.

    Returns:
        None where it lacks what this version reads, or bears a time an hour or more off that of its writing: one such
        time would stretch the table.
    """
    group, value = GROUPS[record.topic], record.value
    try:
        if group is ESTIMATES:
            sample = Sample(Key(record.topic), value["t_ns"], record.log_ns, group.read(value))
            at_ns = sample.own_ns
        else:
            key = Key(record.topic, value["link"], value["system_id"], value["component_id"])
            sample = Sample(key, value["autopilot_ns"], value["arrived_ns"], group.read(value))
            at_ns = sample.arrived_ns
        return sample if abs(at_ns - record.log_ns) <= IMPOSSIBLE_NS else None
    except (KeyError, IndexError, TypeError, AttributeError):
        return None


def survey(reader: LogReader, on_offset: OnOffset | None = None) -> Survey:
    """Walk through a log.

    Raises:
        OperatorError: there is not one sample in it.
    """
    streams: dict[Key, StreamSurvey] = {}
    clocks: dict[str, AutopilotClock] = {}
    wall, unusable = WallClock(), 0
    for record in reader.records(WANTED, on_offset):
        if record.topic == CLOCK:
            wall.take(record.value)
        elif record.topic == TIMESYNC:
            clocks.setdefault(record.value["link"], AutopilotClock()).take(record.value)
        else:
            sample = sample_of(record)
            if sample is None:
                unusable += 1
            else:
                _enter(sample, streams)
    if not streams:
        damage = "".join(f"; {loss}" for loss in reader.lost)
        raise OperatorError(f"log {reader.path}: holds no estimate and no message of an autopilot to export{damage}")
    lost = reader.lost
    paced = reader.metadata().get("run", {}).get("pace") != "fast"
    return Survey(streams, clocks, wall if paced else None, lost, unusable)


def _enter(sample: Sample, streams: dict[Key, StreamSurvey]) -> None:
    group = GROUPS[sample.key.group]
    stream = streams.setdefault(sample.key, StreamSurvey(group))
    own_ns = sample.own_ns if sample.own_ns >= 0 else sample.arrived_ns
    at_ns = sample.own_ns if group is ESTIMATES else sample.arrived_ns
    stream.take(own_ns, at_ns, sample.row)


def names(surveyed: Survey) -> Iterator[tuple[Key, tuple[str, ...]]]:
    """Yield each stream with its columns' names; those of a second sender of the same message end in _2, and so on."""
    seen: dict[str, int] = {}
    for key in sorted(surveyed.streams, key=lambda key: (list(GROUPS).index(key.group), key)):
        seen[key.group] = number = seen.get(key.group, 0) + 1
        suffix = "" if number == 1 else f"_{number}"
        yield key, tuple(name + suffix for name in (*GROUPS[key.group].names, flag_name(key)))


def flag_name(key: Key) -> str:
    """Return the name of a stream's flag column."""
    if key.group == ESTIMATES.name:
        return "estimate_flag"
    return f"ap_{key.group.rpartition('/')[2].lower()}_flag"

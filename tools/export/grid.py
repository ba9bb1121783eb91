"""A log's streams on one grid, block by block: memory is that of a block, however long the log."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bridge.histogram import Histogram
from bridge.log.reader import LogReader, OnOffset
from tools.export.columns import ESTIMATES, RESET_COLUMN, STATES, Group
from tools.export.resample import ABSENT, FILLED, SHORTENED, Resampled, Spacing, Times, resample
from tools.export.survey import Key, Sample, Survey, TimeSource, names, sample_of
from tracker.types import Array

BLOCK_ROWS, LEAST_ROWS, BLOCK_S = 2048, 16, 30.0
LATE_NS = 3_000_000_000  # a record is written at most so long after what it speaks of
PAUSE_NS = 60_000_000_000  # so long without any sample, no rows are made
KEPT_PAUSES = 100
ROW_KINDS = ("measured", "filled", "shortened", "absent")

Column = NDArray[np.float64] | NDArray[np.int64] | NDArray[np.int8] | NDArray[np.str_]
Block = Mapping[str, Column]
"""Rows of the table: columns of one length, by name."""


@dataclass(slots=True, eq=False)
class Stream:
    """One stream on its way to the grid. The counts are for the report."""

    key: Key
    group: Group
    names: tuple[str, ...]
    used: tuple[bool, ...]
    spacing: Spacing
    dropped: int = 0
    gaps: int = 0
    longest_gap_ns: int = 0
    by_source: dict[str, int] = field(default_factory=dict)
    rows: dict[str, int] = field(default_factory=lambda: dict.fromkeys(ROW_KINDS, 0))
    delays: Histogram = field(default_factory=Histogram)
    _times: list[int] = field(default_factory=list)
    _rows: list[list[float]] = field(default_factory=list)
    _newest_ns: int = -(2**62)

    def push(self, sample: Sample, survey: Survey) -> None:
        """Take in a sample, at its place on stream time."""
        t_ns, source = _place(sample, survey)
        self.by_source[source] = self.by_source.get(source, 0) + 1
        if t_ns <= self._newest_ns:
            self.dropped += 1
            return
        gap_ns = t_ns - self._newest_ns
        if self._times and gap_ns > self.spacing.gap_limit_ns:
            self.gaps += 1
            self.longest_gap_ns = max(self.longest_gap_ns, gap_ns)
        if source != TimeSource.ARRIVAL:
            self.delays.add(sample.arrived_ns - t_ns)
        self._newest_ns = t_ns
        self._times.append(t_ns)
        self._rows.append(sample.row)

    def next_ns(self, after_ns: int) -> int | None:
        """Return the first sample's time from an instant on, None if there is none yet."""
        return next((t_ns for t_ns in self._times if t_ns >= after_ns), None)

    def take(self, grid_ns: Times) -> Resampled:
        """Return the stream's values at the grid's times, and forget what the times after them do not need."""
        times, rows = np.array(self._times, dtype=np.int64), np.array(self._rows, dtype=np.float64)
        rows = rows.reshape(len(times), len(self.group.names))
        found = resample(times, rows, self._joined(rows), grid_ns, self.group.layout, self.spacing)
        self._count(found.flags)
        keep_ns = int(grid_ns[-1]) - self.spacing.reach_ns
        # One more, for the line that comes in from the left.
        first = max(0, int(np.searchsorted(times, keep_ns)) - 1)
        del self._times[:first], self._rows[:first]
        return found

    def _joined(self, rows: Array) -> NDArray[np.bool_]:
        """Say of each sample whether it goes on from the one before: not where the estimate jumped."""
        joined = np.ones(len(rows), dtype=np.bool_)
        if self.group is ESTIMATES and len(rows):
            joined[1:] = rows[1:, RESET_COLUMN] == rows[:-1, RESET_COLUMN]
        return joined

    def _count(self, flags: NDArray[np.int8]) -> None:
        self.rows["absent"] += int(np.count_nonzero(flags & ABSENT))
        self.rows["filled"] += int(np.count_nonzero(flags & FILLED))
        self.rows["shortened"] += int(np.count_nonzero(flags & SHORTENED))
        self.rows["measured"] += int(np.count_nonzero((flags & (ABSENT | FILLED)) == 0))


class Grid:
    """Walk through a log a second time and make the table's rows.

    streams: in the order of the columns.  row_count: so far.  pauses: (from, to) [ns] where no rows were made.
    """

    def __init__(self, reader: LogReader, surveyed: Survey, rate_hz: float, gap_ns: int | None) -> None:
        self._reader = reader
        self._survey = surveyed
        self._step_ns = 1e9 / rate_hz
        self._start_ns = surveyed.first_ns
        self._next = 0
        self._block_rows = min(BLOCK_ROWS, max(LEAST_ROWS, round(BLOCK_S * rate_hz)))
        self.row_count = 0
        self.pauses: list[tuple[int, int]] = []
        self.streams = tuple(self._stream(key, columns, gap_ns) for key, columns in names(surveyed))

    def blocks(self, on_offset: OnOffset | None = None) -> Iterator[Block]:
        """Yield the rows."""
        by_key = {stream.key: stream for stream in self.streams}
        hold_ns = max(stream.spacing.reach_ns for stream in self.streams) + LATE_NS
        for record in self._reader.records({key.group for key in by_key}, on_offset):
            sample = sample_of(record)
            if sample is None:
                continue
            by_key[sample.key].push(sample, self._survey)
            while record.log_ns - hold_ns > self._time_ns(self._next + self._block_rows):
                if self._skip_pause(record.log_ns - hold_ns):
                    break
                yield self._block(self._block_rows)
        last_ns = self._survey.last_ns
        while self._time_ns(self._next) <= last_ns:
            self._skip_pause(last_ns)
            left = int((last_ns - self._time_ns(self._next)) // self._step_ns) + 1
            yield self._block(min(left, self._block_rows))

    def names(self) -> tuple[str, ...]:
        """Return every column's name, in order."""
        columns = (name for stream in self.streams for name in self._used(stream))
        return ("t_ns", "t_s", *columns)

    def _stream(self, key: Key, columns: tuple[str, ...], gap_ns: int | None) -> Stream:
        surveyed = self._survey.streams[key]
        spacing = surveyed.spacing(self._step_ns, gap_ns)
        return Stream(key, surveyed.group, columns, (*surveyed.used, True), spacing)

    def _used(self, stream: Stream) -> list[str]:
        return [name for name, used in zip(stream.names, stream.used, strict=True) if used]

    def _time_ns(self, row: int) -> int:
        return self._start_ns + round(row * self._step_ns)

    def _skip_pause(self, known_until_ns: int) -> bool:
        """Go on to where samples begin again after a long pause; say whether the next block may not be complete."""
        here_ns = self._time_ns(self._next)
        found = [t_ns for stream in self.streams if (t_ns := stream.next_ns(here_ns)) is not None]
        there_ns = min(found, default=known_until_ns)
        if there_ns - here_ns <= PAUSE_NS:
            return False
        if len(self.pauses) < KEPT_PAUSES:
            self.pauses.append((here_ns, there_ns))
        self._next += int((there_ns - here_ns) // self._step_ns)
        return True

    def _block(self, count: int) -> Block:
        rows = np.arange(self._next, self._next + count)
        self._next += count
        self.row_count += count
        since_ns = np.rint(rows * self._step_ns).astype(np.int64)
        block: dict[str, Column] = {"t_ns": self._start_ns + since_ns, "t_s": since_ns * 1e-9}
        for stream in self.streams:
            found = stream.take(self._start_ns + since_ns)
            for k, (name, used) in enumerate(zip(stream.names, stream.used, strict=True)):
                if used and k < found.values.shape[1]:
                    block[name] = _words(found.values[:, k]) if name == "state" else found.values[:, k]
                elif used:
                    block[name] = found.flags
        return block


def _words(codes: Array) -> NDArray[np.str_]:
    """Return the track's state in words, empty where there is none."""
    words = np.array((*STATES, ""))
    return words[np.where(np.isfinite(codes), codes, len(STATES)).astype(np.int64)]


def _place(sample: Sample, survey: Survey) -> tuple[int, str]:
    """Return a sample's stream time [ns], and how it was found."""
    if sample.key.group == ESTIMATES.name:
        return sample.own_ns, TimeSource.STREAM
    clock = survey.clocks.get(sample.key.link)
    t_ns = None if clock is None or sample.own_ns < 0 else clock.stream_ns(sample.own_ns, sample.arrived_ns)
    return (sample.arrived_ns, TimeSource.ARRIVAL) if t_ns is None else (t_ns, TimeSource.SYNC)

"""What a run came to: the figures the operator reads at the end, as values, JSON and text."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Never

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from bridge.dialogue import DialogueState
from bridge.wire import LinkState


def _empty() -> Mapping[str, Never]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Percentiles:
    """How a duration was spread over `count` samples [ms]; None without any."""

    count: int = 0
    p50: float | None = None
    p95: float | None = None
    p99: float | None = None
    max: float | None = None


NO_SAMPLES = Percentiles()


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """A camera's clock against the first camera's, and one sigma of that [ms]."""

    offset_ms: float
    sigma_ms: float

    @property
    def is_certain(self) -> bool:
        """Say whether it is other than zero beyond three sigma."""
        return abs(self.offset_ms) > 3.0 * self.sigma_ms

    def __str__(self) -> str:
        return f"{self.offset_ms:+.2f} +- {self.sigma_ms:.2f} ms"


@dataclass(frozen=True, slots=True)
class LogSummary:
    """The log: its file, records written, records dropped, and what ended it early, if anything did."""

    path: str
    written: int
    dropped: int
    error: str = ""


@dataclass(frozen=True, slots=True)
class Summary:
    """The figures of one run.

    estimates_sent: estimates given to the links.  rate_hz: their mean rate over stream time [Hz].
    latency_ms: from the newest frame available in memory until the datagram is handed to the kernel.
    stages_ms: the part each stage took, by name, in order.
    worst_gap_ms: longest stream time between two estimates sent in a row [ms]; None with fewer than two.
    frames: images seen, by camera name.  rejected: what was left out, by reason.
    lost: how often the track was lost.  resets: how often the estimate jumped.
    clocks: how much later than its stamp each camera but the first saw, by the first one's clock, by camera name.
    far_ends: what is known of the autopilot at the end of each link.
    """

    estimates_sent: int
    rate_hz: float
    latency_ms: Percentiles = NO_SAMPLES
    stages_ms: Mapping[str, Percentiles] = field(default_factory=_empty)
    worst_gap_ms: float | None = None
    frames: Mapping[str, int] = field(default_factory=_empty)
    rejected: Mapping[str, int] = field(default_factory=_empty)
    lost: int = 0
    resets: int = 0
    clocks: Mapping[str, ClockOffset] = field(default_factory=_empty)
    links: tuple[LinkState, ...] = ()
    far_ends: tuple[DialogueState, ...] = ()
    log: LogSummary | None = None


def to_json(summary: Summary) -> str:
    """Write the summary as a JSON object with the names of its fields, ending in a newline."""
    return json.dumps(summary, default=_plain, indent=2, allow_nan=False) + "\n"


def to_text(summary: Summary) -> RenderableType:
    """Lay the summary out for a terminal."""
    return Group(
        _headline(summary),
        _latencies(summary.latency_ms, summary.stages_ms),
        Text(f"frames      {_counts(summary.frames)}"),
        Text(f"rejected    {_counts(summary.rejected)}"),
        *([Text(f"clocks      {_clocks(summary.clocks)}")] if summary.clocks else ()),
        *map(_link, summary.links, summary.far_ends or ("",) * len(summary.links)),
        *(_log(log) for log in (summary.log,) if log is not None),
    )


def _headline(summary: Summary) -> Text:
    gap = "" if summary.worst_gap_ms is None else f", worst gap {summary.worst_gap_ms:.1f} ms"
    return Text(
        f"estimates   {summary.estimates_sent} at {summary.rate_hz:.1f} Hz{gap}, "
        f"track lost {summary.lost} times, {summary.resets} resets"
    )


def _latencies(total: Percentiles, stages: Mapping[str, Percentiles]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("latency (ms)")
    for column in ("p50", "p95", "p99", "max"):
        table.add_column(column, justify="right")
    for name, spread in (*stages.items(), ("frame to datagram", total)):
        table.add_row(name, *(_figure(value) for value in (spread.p50, spread.p95, spread.p99, spread.max)))
    return table


def _link(link: LinkState, far_end: DialogueState | str) -> Text:
    state = "up" if link.up else f"down, {link.reason}"
    far = f"\n            {far_end}" if far_end else ""
    superseded = f", {link.superseded} superseded" if link.superseded else ""
    return Text(f"link        {link.name}: {state}, {link.sent} sent, {link.dropped} dropped{superseded}{far}")


def _log(log: LogSummary) -> Text:
    error = f", ended early: {log.error}" if log.error else ""
    return Text(f"log         {log.path}: {log.written} records, {log.dropped} dropped{error}")


def _clocks(clocks: Mapping[str, ClockOffset]) -> str:
    return ", ".join(f"{name} {offset}" for name, offset in clocks.items()) + " against the first camera's"


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items()) or "none"


def _figure(value_ms: float | None) -> str:
    return "-" if value_ms is None else f"{value_ms:.2f}"


def _plain(value: object) -> dict[str, object]:
    """Return what JSON has no word for, a mapping or one of the values above, as a dict."""
    if isinstance(value, Mapping):
        return dict(value)
    if dataclasses.is_dataclass(value):
        return {entry.name: getattr(value, entry.name) for entry in dataclasses.fields(value)}
    raise TypeError(f"{type(value).__name__} does not belong in a summary")

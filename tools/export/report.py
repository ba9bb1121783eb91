"""How streams were brought onto one clock: offset, skew, jitter, gaps, and which rows are measured, filled, absent."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from rich.console import Group as Lines
from rich.console import RenderableType
from rich.table import Table

from tools.export.clocks import AutopilotClock, Line, WallClock
from tools.export.grid import Grid, Stream
from tools.export.resample import PASS_EDGE, STOPBAND_DB
from tools.export.survey import Survey

Report = dict[str, Any]
TOLD_JUMPS = 5  # of the wall clock, a line each; more are one line


def report_of(log: Path, rate_hz: float, grid: Grid, surveyed: Survey) -> Report:
    """Return the alignment report of a table, as values that JSON can hold."""
    return {
        "log": str(log),
        "clock": "stream time",
        "rate_hz": rate_hz,
        "rows": grid.row_count,
        "anti_alias": {
            "pass_hz": PASS_EDGE * rate_hz / 2, "stop_hz": rate_hz / 2, "stopband_db": STOPBAND_DB, "phase_deg": 0.0,
        },
        "streams": [_stream(stream, surveyed) for stream in grid.streams],
        "autopilot_clocks": [_autopilot(link, clock) for link, clock in surveyed.clocks.items()],
        "wall_clock": None if surveyed.wall is None else _wall(surveyed.wall),
        "pauses": [{"from_ns": a, "to_ns": b} for a, b in grid.pauses],
        "unusable_records": surveyed.unusable,
        "lost": [str(loss) for loss in surveyed.lost],
    }  # fmt: skip


def to_json(report: Report) -> str:
    """Return the report as text."""
    return json.dumps(report, indent=1) + "\n"


def to_text(report: Report) -> RenderableType:
    """Return the report as the operator reads it."""
    table = Table(box=None, pad_edge=False)
    names = ("stream", "clock", "samples", "Hz", "jitter ms", "gaps", "longest ms", "rows measured", "filled", "absent")
    for name in names:
        table.add_column(name, justify="left" if name in names[:2] else "right", no_wrap=True)
    for one in report["streams"]:
        rows, gaps = one["rows"], one["gaps"]
        clock = " + ".join(one["times_by"])
        table.add_row(
            one["stream"].rpartition("/")[2], clock, str(one["samples"]),
            _cell(one["rate_hz"], "{:.1f}"), _cell(one["jitter_ms"], "{:.2f}"), str(gaps["count"]),
            f"{gaps['longest_ms']:.0f}", str(rows["measured"]), str(rows["filled"]),
            str(rows["absent"]),
        )  # fmt: skip
    return Lines(table, *_sentences(report))


def _sentences(report: Report) -> list[str]:
    lines = []
    for clock in report["autopilot_clocks"]:
        for number, boot in enumerate(clock["boots"]):
            which = f" after restart {number}" if number else ""
            lines.append(
                f"autopilot's clock by {clock['link']}{which}: offset {boot['offset_ms']:.1f} ms, "
                f"skew {_cell(boot['skew_ppm'], '{:+.1f}')} ppm, jitter {_cell(boot['jitter_ms'], '{:.2f}')} ms"
            )
    wall = report["wall_clock"]
    if wall is not None and wall["jump_count"] > TOLD_JUMPS:
        lines.append(f"the wall clock was set {wall['jump_count']} times: here it does not run with stream time")
    elif wall is not None:
        lines += [f"the wall clock was set by {jump['step_s']:+.3f} s at {jump['t_ns']} ns" for jump in wall["jumps"]]
    lines += [f"no rows from {p['from_ns']} to {p['to_ns']} ns: nothing was logged there" for p in report["pauses"]]
    return lines


def _stream(stream: Stream, surveyed: Survey) -> Report:
    intervals = surveyed.streams[stream.key].intervals
    p50, p95, p99 = (intervals.quantile_ns(share) for share in (0.5, 0.95, 0.99))
    return {
        "stream": stream.key.group,
        "link": stream.key.link,
        "system_id": stream.key.system_id,
        "component_id": stream.key.component_id,
        "columns": [name for name, used in zip(stream.names, stream.used, strict=True) if used],
        "samples": surveyed.streams[stream.key].count,
        "times_by": stream.by_source,
        "rate_hz": None if p50 is None else 1e9 / p50,
        "interval_ms": {"p50": _ms(p50), "p95": _ms(p95), "p99": _ms(p99), "max": _ms(intervals.longest_ns)},
        "jitter_ms": None if p50 is None or p95 is None else (p95 - p50) / 1e6,
        "arrival_delay_ms": dataclasses.asdict(stream.delays.percentiles()),
        "gaps": {
            "count": stream.gaps,
            "longest_ms": stream.longest_gap_ns / 1e6,
            "limit_ms": stream.spacing.gap_limit_ns / 1e6,
        },
        "not_after_the_one_before": stream.dropped,
        "rows": stream.rows,
    }


def _autopilot(link: str, clock: AutopilotClock) -> Report:
    return {"link": link, "restarts": max(0, len(clock.boots) - 1), "boots": [_line(boot.line) for boot in clock.boots]}


def _wall(wall: WallClock) -> Report:
    jumps = [{"t_ns": at_ns, "step_s": step_ns / 1e9} for at_ns, step_ns in wall.jumps]
    return {"parts": [_line(line) for line in wall.lines], "jump_count": wall.jump_count, "jumps": jumps}


def _line(line: Line) -> Report:
    return {
        "readings": line.count,
        "offset_ms": line.mean_ns / 1e6,
        "skew_ppm": line.slope_ppm,
        "jitter_ms": line.scatter_ms,
    }


def _ms(interval_ns: float | None) -> float | None:
    return None if interval_ns is None else interval_ns / 1e6


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else form.format(value)

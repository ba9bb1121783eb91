"""`posebridge compare`: the table, the picture, the figures as JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from tools.compare.figures import Comparison, Difference, compare, nis_share
from tools.compare.flown import Flown, path_of, read_flown
from tools.compare.picture import draw_comparison
from tools.export.outfile import whole_or_absent
from tools.kept import keep
from tools.screen import screen
from tools.suffix import check_suffix
from tracker.sources.groundtruth import read_ground_truth
from tracker.types import Array

Figures = dict[str, Any]


def run_compare(a: Path, b: Path, truth: Path | None, out: Path | None, as_json: bool) -> Comparison:
    """Compare two runs, print how they differ, and draw it.

    out: a PNG to draw, None for none.
    Raises:
        OperatorError: a log or the truth that cannot be read, no time in common, or `out` is no name of a PNG.
    """
    reference = None if truth is None else path_of(read_ground_truth(truth))
    keep((a, b), out, "--out")
    check_suffix(out, "--out", ".png")
    comparison = compare(read_flown(a), read_flown(b), reference)
    errors = screen(stderr=True, soft_wrap=True)
    for log, one in ((a, comparison.a), (b, comparison.b)):
        for loss in one.lost:
            errors.print(f"posebridge: warning: {log}: {loss}", style="yellow")
    if out is not None:
        with whole_or_absent(out) as path:
            draw_comparison(comparison, path)
    figures = figures_of(comparison)
    if as_json:
        sys.stdout.write(json.dumps(figures, indent=2) + "\n")
    else:
        _print(figures)
    return comparison


def figures_of(comparison: Comparison) -> Figures:
    """Return the figures as values that JSON can hold; None where there is none."""
    truths = comparison.truths or (None, None)
    return {
        "A": _run(comparison.a, truths[0]),
        "B": _run(comparison.b, truths[1]),
        "B less A": _difference(comparison.between),
        "same_mavlink_bytes": comparison.same_bytes,
    }


def _run(one: Flown, error: Difference | None) -> Figures:
    t_ns, consistency = one.path.t_ns, nis_share(one)
    span_s = float(t_ns[-1] - t_ns[0]) / 1e9
    return {
        "name": one.name,
        "estimates": len(t_ns),
        "rate_hz": None if span_s <= 0 else (len(t_ns) - 1) / span_s,
        "resets": one.resets,
        "rejected": dict(sorted(one.rejected.items())),
        "sent": dict(sorted(one.sent.items())),
        "nis_per_dof": None if consistency is None else consistency[0],
        "nis_in_95_band": None if consistency is None else consistency[1],
        "latency_ms": _percentiles(one.latency_ms),
        "error": None if error is None else _difference(error),
    }


def _difference(one: Difference) -> Figures:
    turn_deg = np.degrees(one.turn_rad)
    return {
        "poses": len(one.t_ns),
        "mean_mm": float(one.distance_mm.mean()),
        "rms_mm": float(np.sqrt(np.mean(one.distance_mm**2))),
        "max_mm": float(one.distance_mm.max()),
        "mean_deg": float(turn_deg.mean()),
        "max_deg": float(turn_deg.max()),
        "lag_ms": one.lag_ms,
    }


def _percentiles(values_ms: Array) -> Figures | None:
    if not len(values_ms):
        return None
    p50, p95, p99 = np.percentile(values_ms, [50, 95, 99]).tolist()
    return {"p50": p50, "p95": p95, "p99": p99, "max": float(values_ms.max())}


def _print(figures: Figures) -> None:
    table = Table(box=None, pad_edge=False)
    for name in ("", "A", "B", "B less A"):
        table.add_column(name, justify="left" if not name else "right", no_wrap=True)
    a, b, between = figures["A"], figures["B"], figures["B less A"]
    table.add_row("run", a["name"], b["name"], "")
    for name, key in (("estimates", "estimates"), ("rate Hz", "rate_hz"), ("resets", "resets")):
        table.add_row(name, _cell(a[key]), _cell(b[key]), _cell(between["poses"]) if key == "estimates" else "")
    for name in ("mean_mm", "rms_mm", "max_mm", "mean_deg", "max_deg", "lag_ms"):
        errors = [_cell(None if one["error"] is None else one["error"][name]) for one in (a, b)]
        title = "lag ms" if name == "lag_ms" else f"error {name.replace('_', ' ')}"
        table.add_row(title, *errors, _cell(between[name]))
    table.add_row("NIS per dof", _cell(a["nis_per_dof"]), _cell(b["nis_per_dof"]), "")
    table.add_row("NIS in its 95 % band", _cell(a["nis_in_95_band"]), _cell(b["nis_in_95_band"]), "")
    for name in ("p50", "p99", "max"):
        cells = [_cell(None if one["latency_ms"] is None else one["latency_ms"][name]) for one in (a, b)]
        table.add_row(f"latency ms {name}", *cells, "")
    table.add_row("rejected", *(_cell(sum(one["rejected"].values())) for one in (a, b)), "")
    same = figures["same_mavlink_bytes"]
    said = {True: "same bytes", False: "other bytes", None: "-"}[same]
    table.add_row("messages sent", *(_cell(sum(one["sent"].values())) for one in (a, b)), said)
    screen().print(table)


def _cell(value: float | None) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:z.3f}"

"""Two runs in one picture: how far apart, how far from the truth, NIS, latency."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.ndimage import uniform_filter1d

from tools.compare.figures import Comparison, Difference
from tools.compare.flown import Flown

_A, _B, _BETWEEN = "#1f4e79", "#d9722e", "#5b5b5b"
_BELOW = 2.6  # points wide, so that A shows under a B that is the same
NIS_OVER = 15  # estimates: of the running mean

_Run = tuple[Flown, str, float, str]  # with its colour, its line's width and its name


def draw_comparison(comparison: Comparison, path: Path) -> None:
    """Draw position and attitude, against each other or the truth, NIS and latency, as a PNG."""
    figure = Figure(figsize=(13, 8), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    a, b = comparison.a, comparison.b
    figure.suptitle(f"A: {a.name}   B: {b.name}", fontsize=13, fontweight="bold")
    panels = figure.subplot_mosaic("PP;RR;NL")
    start_ns = int(min(a.path.t_ns[0], b.path.t_ns[0]))
    lines = [("B less A", _BETWEEN, 0.8, comparison.between)]
    if comparison.truths is not None:
        of_a, of_b = comparison.truths
        lines = [("A less truth", _A, _BELOW, of_a), ("B less truth", _B, 0.8, of_b)]
    for name, colour, width, one in lines:
        seconds = (one.t_ns - start_ns) / 1e9
        panels["P"].plot(seconds, one.distance_mm, ".-", color=colour, lw=width, ms=3, label=_label(name, one))
        panels["R"].plot(seconds, np.degrees(one.turn_rad), ".-", color=colour, lw=width, ms=3, label=name)
    for panel, title, unit in (("P", "position: distance", "mm"), ("R", "attitude: angle", "deg")):
        _dress(panels[panel], title, "time (s)", unit)
    runs = ((a, _A, _BELOW, "A"), (b, _B, 1.0, "B"))
    _nis(panels["N"], runs, start_ns)
    _latency(panels["L"], runs)
    figure.savefig(path, dpi=110, format="png")


def _label(name: str, one: Difference) -> str:
    lag = "" if one.lag_ms is None else f", lag {one.lag_ms:+.1f} ms"
    return f"{name}: mean {one.distance_mm.mean():.2f} mm{lag}"


def _nis(axes: Axes, runs: tuple[_Run, ...], start_ns: int) -> None:
    axes.axhline(1.0, color="#bbbbbb", lw=1.0)
    for one, colour, width, name in runs:
        used = one.nis_dof > 0
        ratio = one.nis[used] / one.nis_dof[used]
        if len(ratio):
            seconds = (one.path.t_ns[used] - start_ns) / 1e9
            axes.plot(seconds, uniform_filter1d(ratio, min(NIS_OVER, len(ratio))), color=colour, lw=width, label=name)
    _dress(axes, f"NIS per degree of freedom, mean of {NIS_OVER}", "time (s)", "")


def _latency(axes: Axes, runs: tuple[_Run, ...]) -> None:
    for one, colour, width, name in runs:
        if len(one.latency_ms):
            ordered = np.sort(one.latency_ms)
            share = np.arange(1, len(ordered) + 1) / len(ordered)
            axes.step(ordered, 100 * share, where="post", color=colour, lw=width, label=name)
            axes.set_xscale("log")
    _dress(axes, "latency, frame in memory to datagram", "ms", "% of poses not above")


def _dress(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=10, loc="left")
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2, borderpad=0.0)

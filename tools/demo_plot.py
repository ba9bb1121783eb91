"""A picture of a simulated flight."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tools.simulate.flight import Flight
from tracker.types import Array

_COMMANDED, _TRUE, _ESTIMATED = "#9a9a9a", "#1f4e79", "#d9722e"
_AXES = ("#c0392b", "#2e8b57", "#2c6fbb")
_BAND = "#f1f1ef"
_PHASE_ROOM = 0.16  # of the curves' height, above them for the phases' names and below
# Rows that turn room points (3,) into the two coordinates of a view.
_ABOVE = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_FACING = np.array([[np.sqrt(0.5), -np.sqrt(0.5), 0.0], [0.0, 0.0, 1.0]])


def draw_flight(flight: Flight, title: str, path: Path) -> None:
    """Draw path from above and from the side, attitude, errors with their three sigma, and latency, as a PNG."""
    figure = Figure(figsize=(14, 9.2), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=14, fontweight="bold")
    panels = figure.subplot_mosaic("AB.;AB.".replace(".", "L") + ";CCC;DDE", height_ratios=[1, 1, 1.1, 1.1])
    _map(panels["A"], flight, _ABOVE, "from above", ("x (m)", "y (m)"))
    _map(panels["B"], flight, _FACING, "facing the square", ("along (x - y) / sqrt 2 (m)", "z (m)"))
    panels["B"].legend(loc="center", fontsize=8, framealpha=0.9)
    _latency(panels["L"], flight.latency_ms)
    _attitude(panels["C"], flight)
    _errors(panels["D"], flight.estimated_s, flight.error_inW * 1e3, flight.sigma_m * 1e3, "xyz")
    _title(panels["D"], "position estimate less truth, and 3 sigma", "time (s)", "mm")
    turn, sigma = np.degrees(flight.turn_error), np.degrees(flight.sigma_rad)
    _errors(panels["E"], flight.estimated_s, turn, sigma, "xyz")
    _title(panels["E"], "attitude estimate less truth, about body axes", "time (s)", "deg")
    figure.savefig(path, dpi=110)


def _title(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=10, loc="left")
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _map(axes: Axes, flight: Flight, view: Array, title: str, names: tuple[str, str]) -> None:
    commanded, true, estimated = (p @ view.T for p in (flight.commanded_inW, flight.p_BinW, flight.estimated_inW))
    axes.plot(*commanded.T, color=_COMMANDED, lw=4, label="commanded")
    axes.plot(*true.T, color=_TRUE, lw=1.2, label="true")
    axes.plot(*estimated.T, ".", color=_ESTIMATED, ms=2.5, label="estimated")
    axes.set_aspect("equal", adjustable="datalim")
    _title(axes, title, *names)


def _attitude(axes: Axes, flight: Flight) -> None:
    """Draw roll and pitch on the left scale and yaw on the right one, with the phases behind."""
    _shade_phases(axes, flight)
    for index, name in enumerate(("roll", "pitch")):
        axes.plot(flight.t_s, np.degrees(flight.euler[:, index]), color=_AXES[index], lw=1.0, label=f"{name}, true")
        estimated = np.degrees(flight.estimated_euler[:, index])
        axes.plot(flight.estimated_s, estimated, ".", color=_AXES[index], ms=3, alpha=0.6, label=f"{name}, estimated")
    _title(axes, "attitude", "time (s)", "roll, pitch (deg)")
    right = axes.twinx()
    right.plot(flight.t_s, np.degrees(np.unwrap(flight.euler[:, 2])), color=_AXES[2], lw=1.0, label="yaw (right)")
    right.set_ylabel("yaw (deg)", fontsize=9, color=_AXES[2])
    right.tick_params(labelsize=8, colors=_AXES[2])
    right.spines["top"].set_visible(False)
    lines = [*axes.get_legend_handles_labels()[0], *right.get_legend_handles_labels()[0]]
    axes.legend(handles=lines, loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=8, ncols=5, frameon=False)
    axes.set_xlim(float(flight.t_s[0]), float(flight.t_s[-1]))
    for each in (axes, right):
        each.margins(y=_PHASE_ROOM)


def _shade_phases(axes: Axes, flight: Flight) -> None:
    """Shade every other phase and write its name."""
    changes = np.flatnonzero(flight.phase[1:] != flight.phase[:-1]) + 1
    bounds = [0, *changes.tolist(), len(flight.t_s) - 1]
    for index, (first, last) in enumerate(pairwise(bounds)):
        start_s, end_s = float(flight.t_s[first]), float(flight.t_s[last])
        if index % 2 == 0:
            axes.axvspan(start_s, end_s, color=_BAND, zorder=0, lw=0)
        if end_s - start_s > 0.03 * float(flight.t_s[-1]):
            axes.text(
                (start_s + end_s) / 2, 0.98, str(flight.phase[first]), transform=axes.get_xaxis_transform(),
                ha="center", va="top", fontsize=8, color="#555555",
            )  # fmt: skip


def _errors(axes: Axes, t_s: Array, errors: Array, sigma: Array, names: str) -> None:
    """Draw three errors (m, 3), each with its band of three sigma."""
    for index, name in enumerate(names):
        axes.fill_between(
            t_s, -3 * sigma[:, index], 3 * sigma[:, index], color=_AXES[index], alpha=0.10, lw=0, zorder=1
        )
        axes.plot(t_s, errors[:, index], color=_AXES[index], lw=0.9, label=name, zorder=2)
    # The first fixes have no motion behind them yet; their wide bands would hide the rest.
    if len(errors):
        reach = 1.15 * max(float(np.quantile(3 * sigma, 0.97)), float(np.quantile(np.abs(errors), 0.995)))
        axes.set_ylim(-reach, reach)
        axes.set_xlim(0.0, float(t_s[-1]))
    axes.legend(loc="upper right", fontsize=8, ncols=3, framealpha=0.9)


def _latency(axes: Axes, latency_ms: Array) -> None:
    _title(axes, "frame in memory to datagram sent", "ms", "messages")
    if not len(latency_ms):
        return
    p50, p99 = (float(np.quantile(latency_ms, share)) for share in (0.5, 0.99))
    shown = latency_ms[latency_ms <= 1.5 * p99]
    axes.hist(shown, bins=40, color=_TRUE, alpha=0.85)
    for value, name in ((p50, "median"), (p99, "99 %")):
        axes.axvline(value, color=_ESTIMATED, lw=1.2)
        axes.text(value, 0.97, f" {name} {value:.1f} ms", transform=axes.get_xaxis_transform(), va="top", fontsize=8)

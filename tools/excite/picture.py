"""A picture of an excitation plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tools.excite.manoeuvre import Kind
from tools.excite.plan import Plan
from tools.sysid.parameters import AXES
from tracker.errors import OperatorError

_COLOURS = dict(zip(AXES, ("#c0392b", "#2e8b57", "#2c6fbb", "#8e5ea2"), strict=True))
_STEP_S = 0.01


def draw_plan(plan: Plan, title: str, path: Path) -> None:
    """Draw the four sticks over time, each manoeuvre with its amplitude and expected excursion, as a PNG.

    Raises:
        OperatorError: a path that cannot be written.
    """
    figure = Figure(figsize=(13.0, 6.6), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=13, fontweight="bold", x=0.01, ha="left")
    panels = figure.subplots(len(AXES), 1, sharex=True, sharey=True)
    t_s = np.arange(0.0, plan.sequence.duration_s + _STEP_S, _STEP_S)
    sticks = 100.0 * np.array([plan.sequence.sticks_at(each) for each in t_s])
    for axes, axis, values in zip(panels, AXES, sticks.T, strict=True):
        axes.plot(t_s, values, color=_COLOURS[axis], lw=1.1)
        for each in (one for one in plan.planned if one.manoeuvre.axis is axis):
            move = each.manoeuvre
            axes.axvspan(move.start_s, move.end_s, color="#f1f1ef")
            band = f"{move.low_hz:g} to {move.high_hz:g} Hz, " if move.kind is Kind.SWEEP else ""
            lines = [f"{move.kind}", f"{band}{move.amplitude:.0%}", f"+-{each.shown:.0f} {each.unit}"]
            text = (", " if move.kind is Kind.SWEEP else "\n").join(lines)
            left = move.kind is not Kind.DOUBLET  # the steps after it have their label to the right
            at_s = move.start_s if left else move.end_s
            axes.text(at_s, 150.0, text, fontsize=7, va="top", ha="left" if left else "right", color="#444444")
        axes.set_ylim(-85.0, 155.0)
        axes.set_yticks([-50, 0, 50])
        axes.set_ylabel(f"{axis}\n(% of full)", fontsize=9)
        axes.tick_params(labelsize=8)
        axes.grid(color="#e3e3e3", linewidth=0.6)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    panels[-1].set_xlabel("time (s)", fontsize=9)
    try:
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise OperatorError(f"--out {path}: cannot be written ({error.strerror}); name another file") from error

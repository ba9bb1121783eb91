"""The report's pictures."""

from __future__ import annotations

from io import BytesIO

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tools.sysid.flight_data import FlightData
from tools.sysid.frequency import ANSWERS, LEAST_COHERENCE, Bode
from tools.sysid.parameters import AXES, PARAMETERS
from tools.sysid.response import CHANNELS
from tools.sysid.validate import OUTPUTS, UNITS, Comparison, Whiteness
from tracker.types import Array

_MEASURED, _MODELLED, _GREY = "#1f4e79", "#d9722e", "#8a8a8a"
_AXES = dict(zip(AXES, ("#c0392b", "#2e8b57", "#2c6fbb", "#8e5ea2"), strict=True))
OUTPUT_NAMES = ("forward speed", "speed to the left", "climb rate", "roll", "pitch", "yaw")


def held_out_picture(comparisons: list[Comparison], percent: Array) -> str:
    """Draw measured against modelled outputs of flight that the model has not seen; return SVG."""
    figure = _figure(11.0, 7.2)
    panels = figure.subplots(6, 1, sharex=True)
    start_s = comparisons[0].t_s[0]
    for k, (axes, name, unit) in enumerate(zip(panels, OUTPUT_NAMES, UNITS, strict=True)):
        for one in comparisons:
            axes.plot(one.t_s - start_s, one.measured[:, k], ".", color=_MEASURED, ms=3.5, label="measured")
            axes.plot(one.t_s - start_s, one.modelled[:, k], color=_MODELLED, lw=1.4, label="modelled")
        _plain(axes, "", f"{unit}")
        axes.set_title(f"{name}, fit {percent[k]:.0f} %", loc="left", fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    panels[0].legend(
        handles[:2], labels[:2], ncols=2, fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False
    )
    panels[-1].set_xlabel("time in the held-out part (s)", fontsize=9)
    return _svg(figure)


def bode_picture(bodes: tuple[Bode, ...]) -> str:
    """Draw magnitude, phase and coherence of each axis, measured and modelled; return SVG."""
    figure = _figure(11.0, 6.4)
    panels = figure.subplots(3, len(bodes), sharex="col", height_ratios=[1.2, 1.2, 0.8], squeeze=False)
    for column, one in zip(panels.T, bodes, strict=True):
        sure = one.coherence >= LEAST_COHERENCE
        modelled_deg = np.degrees(np.unwrap(np.angle(one.modelled)))
        measured_deg = modelled_deg + np.degrees(np.angle(one.measured / one.modelled))
        rows = (
            (20.0 * np.log10(np.abs(one.measured)), 20.0 * np.log10(np.abs(one.modelled))),
            (measured_deg, modelled_deg),
        )
        for axes, (measured, modelled), unit in zip(column, rows, ("dB", "deg"), strict=False):
            axes.semilogx(one.f_hz, modelled, color=_MODELLED, lw=1.6, label="model")
            axes.semilogx(one.f_hz[sure], measured[sure], ".", color=_MEASURED, ms=6, label="measured")
            axes.semilogx(one.f_hz[~sure], measured[~sure], ".", color="#b8c7d6", ms=6)
            _plain(axes, "", unit)
        column[0].set_title(f"{one.axis} stick to {ANSWERS[one.axis]}", loc="left", fontsize=9)
        column[2].semilogx(one.f_hz, one.coherence, color=_GREY, lw=1.2, marker=".", ms=4)
        column[2].axhline(LEAST_COHERENCE, color="#cccccc", lw=1.0, ls="--")
        column[2].set_ylim(0.0, 1.05)
        _plain(column[2], "Hz", "coherence")
        ticks = [f for f in (0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if one.f_hz[0] * 0.9 <= f <= one.f_hz[-1] * 1.1]
        column[2].set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        column[2].minorticks_off()
    panels[0, 0].legend(fontsize=8, frameon=False)
    return _svg(figure)


def residual_picture(whiteness: Whiteness) -> str:
    """Draw the autocorrelation of each channel's whitened residuals; return SVG."""
    figure = _figure(11.0, 3.6)
    panels = figure.subplots(2, 3, sharex=True, sharey=True)
    lags = np.arange(whiteness.values.shape[1])
    for axes, values, name in zip(panels.flat, whiteness.values, CHANNELS, strict=True):
        axes.axhspan(-whiteness.band, whiteness.band, color="#e4ecf4")
        axes.vlines(lags, 0.0, values, color=_MEASURED, lw=1.6)
        axes.axhline(0.0, color=_GREY, lw=0.8)
        axes.set_ylim(-0.3, 1.05)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        _plain(axes, "", "")
        axes.set_title(f"{name} {'speed' if name in OUTPUTS[:3] else ''}", loc="left", fontsize=9)
    for axes in panels[1]:
        axes.set_xlabel("lag (frames)", fontsize=9)
    return _svg(figure)


def stick_picture(data: FlightData) -> str:
    """Draw the sticks that the servos were told, and which parts of the flight were used; return SVG."""
    figure = _figure(11.0, 3.8)
    panels = figure.subplots(4, 1, sharex=True, sharey=True)
    start_s = data.tracks[0].t_s[0]
    for k, (axes, axis) in enumerate(zip(panels, AXES, strict=True)):
        for track in data.tracks:
            axes.axvspan(track.t_s[0] - start_s, track.t_s[-1] - start_s, color="#f1f1ef")
        within = (data.sticks.at_s >= start_s - 2.0) & (data.sticks.at_s <= data.tracks[-1].t_s[-1] + 2.0)
        axes.step(
            data.sticks.at_s[within] - start_s,
            100.0 * data.sticks.held[within, k],
            where="post",
            color=_AXES[axis],
            lw=1.0,
        )
        _plain(axes, "", "%")
        axes.set_title(f"{axis} stick", loc="left", fontsize=9)
    panels[-1].set_xlabel("time (s)", fontsize=9)
    return _svg(figure)


def correlation_picture(correlation: Array) -> str:
    """Draw the correlation of the parameters' errors; return SVG."""
    figure = _figure(7.4, 6.2)
    axes = figure.subplots()
    image = axes.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    labels = [parameter.name.replace("_", " ") for parameter in PARAMETERS]
    axes.set_xticks(range(len(labels)), labels, rotation=90, fontsize=8)
    axes.set_yticks(range(len(labels)), labels, fontsize=8)
    for (i, j), value in np.ndenumerate(correlation):
        if i != j and abs(value) > 0.9:
            axes.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize=6.5, color="white")
    figure.colorbar(image, ax=axes, shrink=0.8, label="correlation")
    return _svg(figure)


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _plain(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(color="#e3e3e3", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _svg(figure: Figure) -> str:
    buffer = BytesIO()
    with mpl.rc_context({"svg.hashsalt": "posebridge"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue().decode()
    return text[text.index("<svg") :]

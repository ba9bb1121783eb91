"""The map of a layout: cameras in plan and elevation, errors to be expected and coverage over the volume."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from scipy.spatial import ConvexHull

from tools.place.layout import Survey, aim_point, view_deg
from tools.place.limits import Limits
from tracker.camera import Camera
from tracker.types import Array

INK, VOLUME = "#22313f", "#2c6fbb"
CAMERAS = ("#c0392b", "#2c6fbb", "#2e8b57", "#8e44ad", "#d9822b", "#16a085", "#7f5539", "#c2317f")
LABELS = ((9.0, 7.0), (-9.0, 7.0), (9.0, -15.0), (-9.0, -15.0))
VIEWS = (("from above", 0, 1), ("from the side, along y", 0, 2))
"""Title, and the room's axes to the right and up."""


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """One quantity over the points: title, colours, values (n,), and their limits on the scale."""

    title: str
    colours: str
    values: Array
    limits: tuple[float, float]
    share: bool = False


def draw_map(found: Survey, cameras: Sequence[Camera], limits: Limits, path: Path) -> None:
    """Draw a PNG: the room with its cameras, then position, attitude and coverage in the volume, in two views."""
    figure = Figure(figsize=(17.5, 8.2), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    figures = found.figures
    figure.suptitle(
        f"{len(cameras)} cameras: {figures.position_mm:.2f} mm and {figures.attitude_deg:.2f} deg to be expected "
        f"(rms), {100 * figures.covered:.0f} % of the poses in two pictures",
        fontsize=15, fontweight="bold", color=INK,
    )  # fmt: skip
    panels = figure.subplots(2, 4, width_ratios=[1.5, 1, 1, 1])
    position_mm = found.per_point(1e3 * found.expected.position_m)
    attitude_deg = found.per_point(np.degrees(found.expected.attitude_rad))
    layers = (
        Layer("position, worst (mm)", "viridis_r", position_mm, _limits(position_mm)),
        Layer("attitude, worst (deg)", "viridis_r", attitude_deg, _limits(attitude_deg)),
        Layer("in two pictures (% of poses)", "RdYlGn", 100.0 * found.coverage, (0.0, 100.0), share=True),
    )
    for row, (title, right, up) in zip(panels, VIEWS, strict=True):
        _room(row[0], title, (right, up), cameras, limits)
        for axes, layer in zip(row[1:], layers, strict=True):
            _layer(axes, layer, (right, up), found.points)
    figure.savefig(path, dpi=110)


def _room(axes: Axes, title: str, view: tuple[int, int], cameras: Sequence[Camera], limits: Limits) -> None:
    """Draw walls, volume, and each camera with what it sees."""
    k = list(view)
    _box(axes, limits.room.low[k], limits.room.high[k], {"fc": "#fbfaf7", "ec": INK, "lw": 1.8, "zorder": 0})
    for index, camera in enumerate(cameras):
        colour = CAMERAS[index % len(CAMERAS)]
        _pyramid(axes, camera, limits, k, colour)
        axes.annotate(
            f"{camera.name}, {view_deg(camera):.0f}°", _pair(camera.p_CinW[k]), LABELS[index % len(LABELS)],
            textcoords="offset points", ha="right" if index % 2 else "left",
            fontsize=9, fontweight="bold", color=colour, zorder=6,
            bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75},
        )  # fmt: skip
    style = {"fc": "none", "ec": VOLUME, "lw": 1.8, "ls": (0, (4, 2)), "zorder": 4}
    _box(axes, limits.volume.low[k], limits.volume.high[k], style)
    corner = _pair(limits.volume.low[k])
    axes.annotate("flown", corner, (3, 3), textcoords="offset points", fontsize=8, color=VOLUME, zorder=5)
    reach = limits.room.high[k] - limits.room.low[k]
    axes.set_xlim(limits.room.low[k[0]] - 0.16 * reach[0], limits.room.high[k[0]] + 0.16 * reach[0])
    axes.set_ylim(limits.room.low[k[1]] - 0.08 * reach[1], limits.room.high[k[1]] + 0.12 * reach[1])
    _style(axes, f"the room {title}", view)


def _pyramid(axes: Axes, camera: Camera, limits: Limits, k: list[int], colour: str) -> None:
    """Draw the field of view up to the point that the camera is aimed at."""
    w, h = camera.width_px - 1.0, camera.height_px - 1.0
    rays = camera.bearings(np.array([[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]]))
    target = aim_point(camera, limits)
    depth = float(np.linalg.norm(target - camera.p_CinW))
    corners = camera.p_CinW + depth * (rays / rays[:, 2:]) @ camera.R_CtoW.T
    outline = np.vstack((camera.p_CinW, corners))[:, k]
    hull = outline[ConvexHull(outline).vertices]
    axes.add_patch(Polygon(hull, fc=colour, ec=colour, alpha=0.10, lw=0, zorder=1))
    axes.add_patch(Polygon(hull, fc="none", ec=colour, alpha=0.45, lw=0.8, zorder=2))
    axes.plot(*np.vstack((camera.p_CinW, target))[:, k].T, color=colour, lw=1.1, ls="-.", zorder=3)
    axes.plot(*camera.p_CinW[k], marker="s", ms=9, color=colour, mec="white", mew=1.2, zorder=6)


def _layer(axes: Axes, layer: Layer, view: tuple[int, int], points: Array) -> None:
    """Draw one quantity; of points behind each other the worst known error counts, of shares their mean."""
    right, up = (np.unique(points[:, k].round(9)) for k in view)
    place = np.searchsorted(up, points[:, view[1]] - 1e-6), np.searchsorted(right, points[:, view[0]] - 1e-6)
    shown = np.full((len(up), len(right)), 0.0 if layer.share else np.nan)
    if layer.share:
        np.add.at(shown, place, layer.values * len(up) * len(right) / len(points))
    else:
        np.fmax.at(shown, place, layer.values)
    axes.set_facecolor("#e3e3e0")
    low, high = layer.limits
    mesh = axes.pcolormesh(right, up, shown, cmap=layer.colours, vmin=low, vmax=high, shading="nearest")
    bar = axes.figure.colorbar(mesh, ax=axes, shrink=0.75, pad=0.02)
    bar.ax.tick_params(labelsize=8)
    _style(axes, layer.title + ("" if np.isfinite(shown).all() else ", grey: none"), view)


def _limits(values: Array) -> tuple[float, float]:
    """Return the scale's ends, the same in both views."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    return low, max(high, 1.02 * low)


def _box(axes: Axes, low: Array, high: Array, style: dict[str, Any]) -> None:
    width, height = (high - low).tolist()
    axes.add_patch(Rectangle((float(low[0]), float(low[1])), width, height, **style))


def _pair(point: Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _style(axes: Axes, title: str, view: tuple[int, int]) -> None:
    axes.set_title(title, fontsize=11, loc="left", color=INK)
    axes.set_xlabel(f"{'xyz'[view[0]]} (m)", fontsize=9)
    axes.set_ylabel(f"{'xyz'[view[1]]} (m)", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.set_aspect("equal")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)

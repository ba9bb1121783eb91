"""The paper's figures 3 and 4, drawn again from our own figures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from tracker.placement.axes import PAPER_OPTIMUM, axis, orientations, total_motion
from tracker.placement.cones import (
    PAPER_BASELINE_M,
    PAPER_HALF_ANGLE_RAD,
    grid,
    half_circle,
    quadrilateral,
    triangulation_error,
)
from tracker.types import Array

INK, ACCENT, A_COLOUR, B_COLOUR = "#22313f", "#d9722e", "#c0392b", "#2c6fbb"
CONES = (PAPER_HALF_ANGLE_RAD, PAPER_HALF_ANGLE_RAD)
LEVELS_MM = (7.2, 7.5, 8.0, 10.0, 15.0, 25.0, 40.0)
GRID_M = 0.02
ORIENTATION_STEP = math.radians(7.5)


def draw_cones(path: Path) -> None:
    """Draw fig. 3, and beside it fig. 2's region true to scale at three points."""
    figure = Figure(figsize=(15.5, 5.9), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    figure.suptitle(
        "Triangulation error in the epipolar plane: least where the rays meet at a right angle",
        fontsize=14, fontweight="bold", color=INK,
    )  # fmt: skip
    left, right = figure.subplots(1, 2, width_ratios=[1.6, 1])
    _error_map(left)
    _regions(right)
    figure.savefig(path, dpi=110)


def draw_axes(path: Path) -> None:
    """Draw fig. 4: the orientations of the sweep on the sphere of directions, and the best of them."""
    figure = Figure(figsize=(14.5, 6.8), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    figure.suptitle(
        "Orientation of the two optical axes: image motion summed over both cameras and x, y, z",
        fontsize=14, fontweight="bold", color=INK,
    )  # fmt: skip
    swept = list(orientations(ORIENTATION_STEP))
    motion = np.array([total_motion(*each) for each in swept])
    sphere = cast(Axes3D, figure.add_subplot(1, 2, 1, projection="3d"))
    _sphere(sphere, swept, motion)
    _motion_map(figure.add_subplot(1, 2, 2))
    figure.savefig(path, dpi=110)


def _error_map(axes: Axes) -> None:
    """Draw the error over the plane in mm, with level lines and the half circle."""
    x, y = np.arange(-3.2, 3.2 + 1e-9, GRID_M), np.arange(GRID_M, 3.6, GRID_M)
    error_mm = 1e3 * triangulation_error(grid(x, y), PAPER_BASELINE_M, CONES).reshape(len(y), len(x))
    norm = LogNorm(7.0, 60.0)
    mesh = axes.pcolormesh(x, y, error_mm, cmap="viridis_r", norm=norm, shading="nearest", rasterized=True)
    lines = axes.contour(x, y, error_mm, levels=LEVELS_MM, colors="white", linewidths=0.8)
    axes.clabel(lines, fmt="%g", fontsize=8)
    axes.plot(*half_circle(181, PAPER_BASELINE_M).T, color=ACCENT, lw=2.4)
    axes.annotate(
        "convergence π/2: 7.08 mm\nall along the arc", (0.0, PAPER_BASELINE_M / 2), (0, 16),
        textcoords="offset points", ha="center", fontsize=10, fontweight="bold", color="white",
        bbox={"boxstyle": "round,pad=0.3", "fc": ACCENT, "ec": "none"},
    )  # fmt: skip
    for name, place, colour in (("A", -PAPER_BASELINE_M / 2, A_COLOUR), ("B", PAPER_BASELINE_M / 2, B_COLOUR)):
        axes.plot(place, 0.0, "s", ms=11, color=colour, mec="white", clip_on=False, zorder=5)
        axes.annotate(name, (place, 0.0), (0, -20), textcoords="offset points", ha="center", color=colour, fontsize=12,
                      fontweight="bold", annotation_clip=False)  # fmt: skip
    bar = axes.figure.colorbar(mesh, ax=axes, shrink=0.85, pad=0.01, ticks=[7, 8, 10, 15, 25, 40, 60])
    bar.ax.set_yticklabels(["7", "8", "10", "15", "25", "40", "60"])
    bar.ax.minorticks_off()
    bar.set_label("ε, farthest corner of the region (mm)", fontsize=9)
    _style(axes, "fig. 3: baseline 4.5 m, half angles π/2000", "along the baseline (m)", "across (m)")


def _regions(axes: Axes) -> None:
    """Draw P1..P4 at three convergence angles, true to scale."""
    heights = (("π/2", PAPER_BASELINE_M / 2), ("π/3", PAPER_BASELINE_M / 2 / math.tan(math.pi / 6)),
               ("2π/3", PAPER_BASELINE_M / 2 / math.tan(math.pi / 3)))  # fmt: skip
    for (name, height), colour, shift in zip(heights, (ACCENT, A_COLOUR, B_COLOUR), (0.0, -34.0, 34.0), strict=True):
        point = np.array([[0.0, height]])
        corners_mm = 1e3 * (quadrilateral(point, PAPER_BASELINE_M, CONES)[0] - point[0])
        error_mm = 1e3 * float(triangulation_error(point, PAPER_BASELINE_M, CONES)[0])
        closed = np.vstack((corners_mm, corners_mm[:1])) + np.array([shift, 0.0])
        axes.fill(*closed.T, color=colour, alpha=0.18, lw=0)
        axes.plot(*closed.T, color=colour, lw=1.6)
        axes.plot(shift, 0.0, "+", color=INK, ms=8)
        for k, corner in enumerate(closed[:4]):
            away = corners_mm[k] / np.linalg.norm(corners_mm[k])
            axes.annotate(
                f"P{k + 1}", corner, 11 * away, textcoords="offset points", ha="center", va="center", fontsize=8
            )
        axes.text(shift, -23.0, f"θ = {name}\nε = {error_mm:.2f} mm", ha="center", va="top", fontsize=10, color=colour,
                  fontweight="bold")  # fmt: skip
    axes.set_xlim(-54, 54)
    axes.set_ylim(-36, 36)
    _style(axes, "fig. 2: the region between the cones, midway", "mm", "mm")


def _sphere(axes: Axes3D, swept: list[tuple[float, float, float, float]], motion: Array) -> None:
    """Draw camera positions on the unit sphere, coloured by the best motion met there, and the paper's optimum."""
    places = np.array(
        [axis(phi, psi) for phi_A, phi_B, psi_A, psi_B in swept for phi, psi in ((phi_A, psi_A), (phi_B, psi_B))]
    )
    best: dict[tuple[float, ...], float] = {}
    for place, value in zip(places.round(4), np.repeat(motion, 2), strict=True):
        key = tuple((place + 0.0).tolist())
        best[key] = max(best.get(key, 0.0), float(value))
    shown = axes.scatter(*np.array(list(best)).T, c=list(best.values()), cmap="viridis", s=9, alpha=0.75)
    for (phi, psi), name, colour in ((PAPER_OPTIMUM[0::2], "A", A_COLOUR), (PAPER_OPTIMUM[1::2], "B", B_COLOUR)):
        u = axis(phi, psi)
        axes.plot(*np.vstack((np.zeros(3), 1.15 * u)).T, color=colour, lw=3.0, zorder=10)
        label = f"{name}: φ 45°, ψ {math.degrees(psi):.0f}°"
        axes.text(*(1.28 * u), label, color=colour, fontsize=10, fontweight="bold", ha="center", zorder=11)
    axes.figure.colorbar(shown, ax=axes, shrink=0.6, pad=0.0, label="best sum at this orientation (δ)")
    for k, name in enumerate("xyz"):
        end = 1.25 * np.eye(3)[k]
        axes.plot(*np.vstack((np.zeros(3), end)).T, color="#999999", lw=1.0)
        axes.text(*(1.08 * end), name, color="#666666", fontsize=10)
    axes.set_title("fig. 4: orientations that meet eq. 1", fontsize=11, loc="left", color=INK)
    axes.set_box_aspect((1, 1, 0.62), zoom=1.45)
    axes.set_axis_off()
    axes.view_init(elev=24, azim=-62)


def _motion_map(axes: Axes) -> None:
    """Draw the sum over phi_A = phi_B and psi_A, psi_B by eq. 1: the ridge on which the optimum lies."""
    phis, psis = np.radians(np.linspace(45.0, 90.0, 181)), np.radians(np.linspace(0.0, 90.0, 181))
    turn = np.arccos(np.clip(-1.0 / np.tan(np.minimum(phis, np.pi / 2 - 1e-9)) ** 2, -1.0, 1.0))
    motion = np.array(
        [[total_motion(phi, phi, psi, psi - t) for phi, t in zip(phis, turn, strict=True)] for psi in psis]
    )
    mesh = axes.pcolormesh(
        np.degrees(phis), np.degrees(psis), motion, cmap="viridis", shading="nearest", rasterized=True
    )
    lines = axes.contour(np.degrees(phis), np.degrees(psis), motion, levels=[4.4, 4.6, 4.7, 4.8, 4.85, 4.87],
                         colors="white", linewidths=0.8)  # fmt: skip
    axes.clabel(lines, fmt="%g", fontsize=8)
    axes.plot(45.0, 45.0, "*", ms=20, color=ACCENT, mec="white", clip_on=False, zorder=5)
    swapped = (60.0, math.degrees(math.atan(math.sqrt(2.0))))  # the same two directions with y and z swapped
    axes.plot(*swapped, "o", ms=9, color="none", mec=ACCENT, mew=2.0, zorder=5)
    axes.annotate(
        "the same, y and z swapped", swapped, (0, -20), textcoords="offset points", fontsize=9, ha="center", color=INK
    )
    axes.annotate(
        "the paper's optimum\n4.8783 δ", (45.0, 45.0), (16, -22), textcoords="offset points", fontsize=10,
        fontweight="bold", color="white", va="center", bbox={"boxstyle": "round,pad=0.3", "fc": ACCENT, "ec": "none"},
    )  # fmt: skip
    axes.figure.colorbar(mesh, ax=axes, shrink=0.85, pad=0.01, label="sum of image motions (δ)")
    _style(
        axes,
        "both cameras equally high: φA = φB = φ, ψB = ψA − acos(−1 / tan² φ)",
        "φ, from the vertical (deg)",
        "ψA (deg)",
    )
    axes.set_aspect("auto")


def _style(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=11, loc="left", color=INK)
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.set_aspect("equal")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)

"""A calibration in one picture: where the board was, what is left over, which views err, how it was tilted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tools.calibrate.intrinsics import Intrinsics
from tools.calibrate.result import Calibration
from tools.calibrate.verdict import LEAST_COVERAGE, TILTED_DEG, share_covered
from tools.calibrate.views import CELLS, coverage
from tracker.errors import OperatorError

_FIT, _HELD, _GREY = "#1f4e79", "#d9722e", "#999999"
ARROW_SHARE = 0.06  # of the picture's width, for three times the rms


def draw_calibration(result: Calibration, path: Path) -> None:
    """Draw it as a PNG, a row a camera.

    Raises:
        OperatorError: the file cannot be written.
    """
    rows = len(result.cameras)
    figure = Figure(figsize=(17, 4.1 * rows + 0.6), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    said = "good" if result.good else "NOT GOOD: see the text"
    pairs = "".join(
        f"   {' and '.join(pair.names)}: {pair.rms_px:.3f} px, baseline {1e3 * pair.baseline_m:.1f} mm"
        for pair, _ in result.pairs
    )
    figure.suptitle(f"calibration: {said}{pairs}", fontsize=13, fontweight="bold")
    panels = figure.subplots(rows, 4, squeeze=False, width_ratios=(1.2, 1.2, 1.2, 0.9))
    for (covered, left, views, tilts), camera in zip(panels, result.cameras, strict=True):
        _coverage(covered, camera)
        _residuals(left, camera)
        _views(views, camera)
        _tilts(tilts, camera)
    try:
        figure.savefig(path, dpi=90, format="png")
    except OSError as error:
        raise OperatorError(f"--picture {path}: cannot be written ({error.strerror}); name a writable path") from error


def _coverage(axes: Axes, camera: Intrinsics) -> None:
    width, height = camera.size_px
    counts = coverage(list(camera.views), camera.size_px)
    axes.imshow(
        np.where(counts > 0, np.log1p(counts), np.nan), extent=(-0.5, width - 0.5, height - 0.5, -0.5), cmap="Blues",
        vmin=-1.0, alpha=0.75, aspect="equal",
    )  # fmt: skip
    for view in camera.views:
        ring = np.vstack((view.outline_px, view.outline_px[:1]))
        axes.plot(ring[:, 0], ring[:, 1], color=_FIT, lw=0.6)
    uv_px = np.vstack([view.uv_px for view in camera.views])
    axes.plot(uv_px[:, 0], uv_px[:, 1], ".", color="black", ms=1.2)
    _frame(axes, camera)
    share = 100 * share_covered(camera)
    _dress(axes, f"{camera.name}: corners in {share:.0f} % of {CELLS[0]} x {CELLS[1]} cells", "px", "px")
    if share < 100 * LEAST_COVERAGE:
        axes.title.set_color("firebrick")


def _residuals(axes: Axes, camera: Intrinsics) -> None:
    uv_px = np.vstack([view.uv_px for view in camera.views])
    left = np.vstack(camera.lens.residuals_px)
    longest_px = ARROW_SHARE * camera.size_px[0]
    scale = 3.0 * camera.lens.rms_px / longest_px
    axes.quiver(
        uv_px[:, 0], uv_px[:, 1], left[:, 0], left[:, 1], angles="xy", scale_units="xy", scale=max(scale, 1e-9),
        color=_FIT, width=0.002,
    )  # fmt: skip
    _frame(axes, camera)
    times = f"{1 / scale:.0f} x" if scale > 0 else ""
    _dress(
        axes,
        f"what is left over, {times}: {camera.lens.rms_px:.3f} px rms",
        "px",
        "px",
    )


def _views(axes: Axes, camera: Intrinsics) -> None:
    places = np.arange(len(camera.views))
    axes.bar(places - 0.2, camera.lens.errors_px, 0.4, color=_FIT, label=f"fitted, {camera.lens.rms_px:.3f} px")
    axes.bar(
        places + 0.2, camera.held_out.errors_px, 0.4, color=_HELD, label=f"held out, {camera.held_out.rms_px:.3f} px"
    )
    few = places[:: max(1, len(places) // 20)]
    axes.set_xticks(few, [camera.views[k].name for k in few], rotation=60, ha="right")
    _dress(axes, "error by view", "", "px rms")


def _tilts(axes: Axes, camera: Intrinsics) -> None:
    turned = camera.lens.normals * -np.sign(camera.lens.normals[:, 2:])  # towards the camera
    lean_deg = np.degrees(np.arcsin(np.clip(turned[:, :2], -1.0, 1.0)))
    axes.plot(lean_deg[:, 0], lean_deg[:, 1], "o", color=_FIT, ms=4)
    angle = np.linspace(0.0, 2.0 * np.pi, 90)
    axes.plot(TILTED_DEG * np.cos(angle), TILTED_DEG * np.sin(angle), color=_GREY, lw=0.8)
    reach = max(35.0, float(np.abs(lean_deg).max()) + 5.0)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(reach, -reach)
    axes.set_aspect("equal")
    _dress(
        axes, f"tilt; outside the ring it tells f ({TILTED_DEG:.0f} deg)", "left and right (deg)", "up and down (deg)"
    )


def _frame(axes: Axes, camera: Intrinsics) -> None:
    """Show the whole picture, and the lens's centre."""
    width, height = camera.size_px
    axes.plot(*camera.lens.intrinsics[2:], "+", color=_HELD, ms=11, mew=1.6)
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_aspect("equal")


def _dress(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=9, loc="left")
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, framealpha=0.9)

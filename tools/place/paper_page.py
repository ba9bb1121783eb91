"""The paper's figures beside ours, in one table."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np
import orjson

from tracker.placement.axes import PAPER_OPTIMUM, best_orientation, solve, total_motion
from tracker.placement.cones import (
    PAPER_BASELINE_M,
    PAPER_HALF_ANGLE_RAD,
    convergence_angle,
    grid,
    half_circle,
    triangulation_error,
)
from tracker.placement.point_error import (
    PAPER_ERROR_M,
    PAPER_RANGE_DEG,
    PAPER_RESULT_DEG,
    PAPER_SIDE_M,
    PAPER_STEP_DEG,
    attitudes,
    drawn_errors,
    worst_errors,
)

CONES = (PAPER_HALF_ANGLE_RAD, PAPER_HALF_ANGLE_RAD)
GRID_M = 0.01
STEP = math.radians(5.0)
TABLE_1_RAD = (("0", 0.0), ("pi/6", math.pi / 6), ("pi/3", math.pi / 3), ("pi/2", math.pi / 2))
RANGES_DEG = (0.0, 10.0, 20.0, 30.0)


@dataclass(frozen=True, slots=True)
class Line:
    """One claim of the paper's and what we find."""

    where: str
    claim: str
    paper: str
    ours: str


def paper_page(as_json: bool) -> str:
    """Return the table as text or as JSON."""
    lines, cells = list(_lines()), list(_table_1())
    if as_json:
        table = {"claims": [asdict(line) for line in lines], "table_1": [asdict(cell) for cell in cells]}
        return orjson.dumps(table, option=orjson.OPT_INDENT_2).decode()
    rows = [(line.where, line.claim, line.paper, line.ours) for line in lines]
    text = [_row(("where", "what", "paper", "ours")), *map(_row, rows), "", "Table 1, eq. 1 solved for psi_B"]
    text += [_row((cell.where, cell.claim, cell.paper, cell.ours)) for cell in cells]
    return "\n".join([*text, "", "Where and why they differ: docs/paper.md"])


def _row(cells: tuple[str, str, str, str]) -> str:
    return f"  {cells[0]:9} {cells[1]:52} {cells[2]:28} {cells[3]}".rstrip()


def _lines() -> Iterator[Line]:
    arc_mm = 1e3 * triangulation_error(half_circle(181, PAPER_BASELINE_M, 0.01), PAPER_BASELINE_M, CONES)
    points = grid(np.arange(-3.0, 3.0, GRID_M), np.arange(GRID_M, 3.5, GRID_M))
    error_mm = 1e3 * triangulation_error(points, PAPER_BASELINE_M, CONES)
    best = np.argsort(error_mm)[:100]
    angle = np.degrees(convergence_angle(points[best], PAPER_BASELINE_M))
    yield Line(
        "fig. 3",
        "least triangulation error, mm",
        "+-8, read off the plot",
        f"{arc_mm.min():.2f} to {arc_mm.max():.2f} on the arc",
    )
    yield Line(
        "fig. 3", "convergence angle at the 100 best points, deg", "90", f"{angle.min():.1f} to {angle.max():.1f}"
    )
    yield Line(
        "eq. 2-3", "image motion at 45, 45, 45, -135 deg, delta", "the maximum", f"{total_motion(*PAPER_OPTIMUM):.4f}"
    )
    where, motion = best_orientation(STEP)
    yield Line(
        "eq. 2-3",
        "best of a sweep in 5 deg steps, delta",
        "at 45, 45, 45, -135 deg",
        f"{motion:.4f} at {_degrees(where)}",
    )
    where, motion = best_orientation(STEP, as_printed=True)
    yield Line("eq. 3", "the same with cos psi in row 3, as printed", "", f"{motion:.4f} at {_degrees(where)}")
    worst = np.degrees(worst_errors(attitudes(PAPER_RANGE_DEG, PAPER_STEP_DEG, 90.0), PAPER_SIDE_M, PAPER_ERROR_M))
    poses = list(attitudes(PAPER_RANGE_DEG, PAPER_STEP_DEG, PAPER_STEP_DEG))
    drawn = np.degrees(drawn_errors(poses, PAPER_SIDE_M, PAPER_ERROR_M, np.random.default_rng(1)))
    paper = " ".join(f"{x:.2f}" for x in PAPER_RESULT_DEG)
    yield Line("3.2", "largest error of roll pitch yaw, drawn in 8 mm, deg", paper, _three(drawn))
    yield Line("3.2", "the same in the worst case, deg", "", _three(worst))
    for range_deg in RANGES_DEG:
        grown = np.degrees(worst_errors(attitudes(range_deg, PAPER_STEP_DEG, 90.0), PAPER_SIDE_M, PAPER_ERROR_M))
        yield Line(
            "3.2", f"worst case, roll and pitch within +-{range_deg:.0f} deg", "grows with the range", _three(grown)
        )


def _table_1() -> Iterator[Line]:
    """Solve eq. 1 for every cell, two angles standing for 0 < phi < pi/2."""
    for name_A, phi_A in TABLE_1_RAD:
        for name_B, phi_B in TABLE_1_RAD:
            found = solve(phi_A, phi_B, 0.0)
            turns = (
                " ".join(f"{math.degrees(psi):.1f}" for psi in found.psi_B)
                if found.case.value.startswith("psi_B")
                else ""
            )
            yield Line(
                "table 1",
                f"phi_A = {name_A}, phi_B = {name_B}",
                _printed(phi_A, phi_B),
                f"{found.case} {turns}".rstrip(),
            )


def _printed(phi_A: float, phi_B: float) -> str:
    """Return the cell of the paper's table 1."""
    level = math.pi / 2.0
    if {phi_A, phi_B} == {0.0, level}:
        return "psi_A, psi_B free"
    if 0.0 in (phi_A, phi_B):
        return "no solution"
    if level in (phi_A, phi_B):
        return "psi_B = psi_A +- pi/2"
    return "- acos(...), phi_A + phi_B >= pi/2" if phi_A + phi_B >= level else "no solution"


def _degrees(angles: tuple[float, ...]) -> str:
    return ", ".join(f"{math.degrees(x):.0f}" for x in angles) + " deg"


def _three(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return " ".join(f"{x:.2f}" for x in values)

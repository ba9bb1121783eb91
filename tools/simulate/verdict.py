"""Did the simulated flight hold its path, and did the tracker know where it was?"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

import numpy as np
from rich.table import Table
from rich.text import Text

from tools.simulate.flight import Flight
from tools.simulate.mission import Phase
from tracker.types import Array

_SETTLING_S = 1.0


@dataclass(frozen=True, slots=True)
class Line:
    """One figure against its limit; at_most: whether less is better."""

    what: str
    value: float
    limit: float
    unit: str
    at_most: bool = True

    @property
    def passed(self) -> bool:
        """Say whether the value keeps the limit; a figure that is not a number never does."""
        return self.value <= self.limit if self.at_most else self.value >= self.limit


@dataclass(frozen=True, slots=True)
class Verdict:
    """The flight's figures."""

    lines: tuple[Line, ...]

    @property
    def passed(self) -> bool:
        """Say whether every figure keeps its limit."""
        return all(line.passed for line in self.lines)

    def to_json(self) -> str:
        """Write the figures as a JSON object, ending in a newline."""
        lines = [{**asdict(line), "value": _finite(line.value), "passed": line.passed} for line in self.lines]
        return json.dumps({"passed": self.passed, "figures": lines}, indent=2, allow_nan=False) + "\n"

    def to_table(self) -> Table:
        """Lay the figures out for a terminal."""
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
        table.add_column("flight")
        table.add_column("value", justify="right")
        table.add_column("limit", justify="right")
        table.add_column("")
        for line in self.lines:
            sign = "<=" if line.at_most else ">="
            mark = Text("ok", "green") if line.passed else Text("MISSED", "red")
            table.add_row(line.what, f"{line.value:.3g} {line.unit}", f"{sign} {line.limit:g} {line.unit}", mark)
        return table


def judge(flight: Flight) -> Verdict:
    """Judge a flight.

    Where the limits come from. Estimate: the paper wants 10 mm (section 1.1); attitude, a quarter of the 4.45 to 5.6
    deg it computes for points 8 mm off (section 3.2). Path: fed with true poses, 15 a second and 30 ms old, the same
    vehicle in the same draught (9 flights of 15 to 60 s) hovers within 14 to 37 mm RMS, its first second left out, and
    on the square is at most 120 mm from the moving reference, so no farther from the path. A tracker good to 10 mm adds
    little to that, one that lags or jumps does. So 50 mm and 150 mm.
    """
    hover = (flight.phase == Phase.HOVER.value) & (flight.t_s > _start_s(flight, Phase.HOVER) + _SETTLING_S)
    square = flight.phase == Phase.SQUARE.value
    off_m = np.linalg.norm(flight.p_BinW - flight.commanded_inW, axis=1)
    across_m = distance_to_path(flight.p_BinW[square], flight.corners_inW)
    position_m = np.linalg.norm(flight.error_inW, axis=1)
    turn_deg = np.degrees(np.linalg.norm(flight.turn_error, axis=1))
    return Verdict(
        (
            Line("mission flown to its end", float(flight.landed), 1.0, "", at_most=False),
            Line("hover, off the point, RMS", _rms(off_m[hover]) * 1e3, 50.0, "mm"),
            Line("square, off the path, max", _max(across_m) * 1e3, 150.0, "mm"),
            Line("landing, off the point", float(np.linalg.norm(_landing_offset(flight))) * 1e3, 150.0, "mm"),
            Line("position estimate, RMS error", _rms(position_m) * 1e3, 10.0, "mm"),
            Line("attitude estimate, RMS error", _rms(turn_deg), 1.2, "deg"),
        )
    )


def distance_to_path(p: Array, corners: Array) -> Array:
    """Return how far points (n, 3) are from a line of corners (k, 3) [m], (n,)."""
    a, b = corners[:-1], corners[1:]
    along = b - a
    length2 = np.maximum((along * along).sum(axis=1), 1e-12)
    share = np.clip(((p[:, None] - a) * along).sum(axis=2) / length2, 0.0, 1.0)
    return np.asarray(np.linalg.norm(p[:, None] - (a + share[..., None] * along), axis=2).min(axis=1))


def _landing_offset(flight: Flight) -> Array:
    return np.asarray((flight.p_BinW[-1] - flight.corners_inW[0])[:2])


def _start_s(flight: Flight, phase: Phase) -> float:
    times = flight.t_s[flight.phase == phase.value]
    return float(times[0]) if len(times) else 0.0


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _max(values: Array) -> float:
    return float(values.max()) if len(values) else float("nan")


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None

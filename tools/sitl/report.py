"""What a simulated flight came to: figures against limits, and the rehearsal's outcomes."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

import numpy as np
from rich.table import Table
from rich.text import Text

from bridge.summary import Summary
from tools.simulate.autopilot.reports import GUIDED, LAND
from tools.simulate.mission import Mission, Phase
from tools.simulate.verdict import Line, Verdict, distance_to_path
from tools.sitl.faults import Outcome
from tools.sitl.world import Sample
from tracker.maths import so3
from tracker.sources.paths import Pose
from tracker.types import Array, Estimate

_SETTLING_S = 1.0
_FLOWN = (Phase.HOVER, Phase.SQUARE, Phase.TURN)


@dataclass(frozen=True, slots=True, eq=False)
class SitlReport:
    """The flight's figures.

    verdict: figures against their limits.  marks_s: when what was reached, since the autopilot's start [s].
    flags: EKF_STATUS_REPORT's flags seen in flight.  texts: what the autopilot said, with times [s].
    """

    autopilot: str
    verdict: Verdict
    summary: Summary
    marks_s: dict[str, float]
    flags: tuple[str, ...]
    texts: tuple[tuple[float, str], ...]
    outcomes: tuple[Outcome, ...]

    def to_json(self) -> str:
        """Write all of it as a JSON object, ending in a newline."""
        return (
            json.dumps(
                {
                    "autopilot": self.autopilot,
                    **json.loads(self.verdict.to_json()),
                    "marks_s": self.marks_s,
                    "ekf_flags": self.flags,
                    "latency_ms": asdict(self.summary)["latency_ms"],
                    "faults": [asdict(outcome) for outcome in self.outcomes],
                    "texts": self.texts,
                },
                indent=2,
            )
            + "\n"
        )

    def faults_table(self) -> Table:
        """Lay the rehearsal out for a terminal."""
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
        for head in ("fault", "excursion", "by rights", "in quiet", "EKF error", "EKF ratio", "fail-safe"):
            table.add_column(head, justify="left" if head == "fault" else "right", no_wrap=True)
        for each in self.outcomes:
            table.add_row(
                f"{each.fault.name}: {each.fault.what}, {each.fault.lasts_s:g} s",
                f"{each.excursion_mm:.0f} mm",
                f"{each.fault.moves_mm:.0f} mm",
                f"{each.quiet_mm:.0f} mm",
                f"{each.ekf_error_mm:.0f} mm",
                f"{each.worst_ratio:.2f}",
                Text("ACTED", "red") if each.failsafe else "no",
            )
        return table


def judge(history: list[Sample], estimates: list[tuple[Estimate, Pose]], mission: Mission, landed: bool) -> Verdict:
    """Judge a flight.

    Limits of tracker, hover and square are the demo's (`tools.simulate.verdict`). The autopilot's own error: ArduPilot
    in SITL, fed with true poses at 15 Hz, is wrong by 5 to 8 mm RMS an axis on a square; with the tracker's allowed
    10 mm that makes 20 mm.
    """
    place = np.array([each.p_BinW for each in history])
    wanted = np.array([each.wanted_inW for each in history])
    phase = np.array([each.phase for each in history])
    t_s = np.array([each.t_ns for each in history]) / 1e9
    off_m = np.linalg.norm(place - wanted, axis=1)
    hover, square = phase == Phase.HOVER, phase == Phase.SQUARE
    if hover.any():
        hover &= t_s > t_s[hover][0] + _SETTLING_S
    errors_mm = [each.ekf_error_mm for each in history if each.phase in _FLOWN and each.ekf_error_mm is not None]
    modes = {each.mode for each in history if each.phase in _FLOWN}
    ratios = [each.worst_ratio for each in history if each.phase in _FLOWN]
    position_mm, turn_deg = _tracking(estimates)
    return Verdict(
        (
            Line("flown to the end, and landed", float(landed), 1.0, "", at_most=False),
            Line("guided all the while, no fail-safe", float(modes == {GUIDED}), 1.0, "", at_most=False),
            Line("hover, off the point, RMS", 1e3 * _rms(off_m[hover]), 50.0, "mm"),
            Line("square, off the path, max", 1e3 * _largest(place[square], mission), 150.0, "mm"),
            Line("tracker, position error, RMS", _rms(position_mm), 10.0, "mm"),
            Line("tracker, attitude error, RMS", _rms(turn_deg), 1.2, "deg"),
            Line("autopilot, position error, RMS", _rms(np.array(errors_mm)), 20.0, "mm"),
            Line("EKF variances in flight, largest", max(ratios, default=np.nan), 0.8, ""),
        )
    )


def flags_of(history: list[Sample]) -> tuple[str, ...]:
    """Return the filter's flags seen in flight, as hexadecimals."""
    return tuple(sorted({hex(each.flags) for each in history if each.phase in _FLOWN}))


def landed_by_failsafe(history: list[Sample]) -> bool:
    """Say whether the autopilot went to LAND before it was told to."""
    return any(each.mode == LAND for each in history if each.phase in _FLOWN)


def _tracking(estimates: list[tuple[Estimate, Pose]]) -> tuple[Array, Array]:
    """Return the tracker's errors of position [mm] and attitude [deg]."""
    position = [1e3 * np.linalg.norm(estimate.p_BinW - p_BinW) for estimate, (p_BinW, _) in estimates]
    turn = [np.linalg.norm(so3.log(R_BtoW.T @ estimate.R_BtoW)) for estimate, (_, R_BtoW) in estimates]
    return np.array(position), np.degrees(np.array(turn))


def _largest(place: Array, mission: Mission) -> float:
    return float(distance_to_path(place, mission.corners_inW).max()) if len(place) else float("nan")


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")

"""Two runs beside each other: errors that were put in come out, and nothing else."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.log.entry import estimate_value
from tests.bridge.estimates import estimate
from tests.tools.export.flights import MS, START_NS, Line, S, every, write
from tools.compare.command import run_compare
from tools.compare.figures import compare, nis_share
from tools.compare.flown import Path7, read_flown
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.types import Array, frozen_array

PERIOD_NS = 66_666_667


def place(t_s: float) -> Array:
    """Return a swing whose speed never repeats within half a second [m]."""
    return np.array([0.4 * math.sin(1.3 * t_s) + 0.1 * math.sin(5.1 * t_s), 0.3 * math.cos(0.9 * t_s), 1.0])


def run_of(
    path: Path,
    shift_m: float = 0.0,
    late_s: float = 0.0,
    turn_rad: float = 0.0,
    nis: float = 12.0,
    times: Sequence[int] = every(PERIOD_NS, 20.0),
) -> Path:
    """Write a run that is so far off, so late, and turned so far about z."""
    lines = []
    for t_ns in times:
        R_BtoW = so3.exp(frozen_array([0.0, 0.0, turn_rad]))
        p_BinW = place((t_ns - START_NS) / S - late_s) + np.array([shift_m, 0.0, 0.0])
        value = estimate_value(estimate(t_ns, p_BinW=p_BinW, R_BtoW=R_BtoW), so3.quaternion(R_BtoW).tolist())
        lines.append(Line("/estimate", t_ns + 20 * MS, value | {"nis": nis, "nis_dof": 12}))
        latency = {"t_ns": t_ns, "stages": [], "links": [{"link": "a", "latency_ns": 3 * MS}]}
        lines.append(Line("/latency", t_ns + 20 * MS, latency))
    return write(path, lines)


def truth() -> Path7:
    t_ns = np.array(every(10 * MS, 21.0, START_NS - S // 2), dtype=np.int64)
    poses = np.array([[*place((t - START_NS) / S), 1.0, 0.0, 0.0, 0.0] for t in t_ns.tolist()])
    return Path7(t_ns, poses, np.ones(len(t_ns), np.bool_))


def test_a_run_beside_itself_differs_in_nothing(tmp_path: Path) -> None:
    one = read_flown(run_of(tmp_path / "a.mcap"))
    between = compare(one, one, None).between
    assert between.distance_mm.max() == 0.0
    assert between.turn_rad.max() < 1e-6
    assert between.lag_ms == pytest.approx(0.0, abs=0.01)


def test_an_offset_and_a_turn_are_found_as_they_are(tmp_path: Path) -> None:
    a, b = run_of(tmp_path / "a.mcap"), run_of(tmp_path / "b.mcap", shift_m=0.005, turn_rad=0.02)
    comparison = compare(read_flown(a), read_flown(b), truth())
    np.testing.assert_allclose(comparison.between.position_m, [[0.005, 0.0, 0.0]] * 300, atol=1e-12)
    np.testing.assert_allclose(comparison.between.turn_rad, 0.02, atol=1e-9)
    assert comparison.truths is not None
    assert comparison.truths[0].distance_mm.max() < 0.1
    np.testing.assert_allclose(comparison.truths[1].distance_mm, 5.0, atol=0.1)


@pytest.mark.parametrize("late_s", [-0.08, -0.02, 0.0, 0.013, 0.05])
def test_a_delay_is_found_to_a_few_milliseconds_with_its_sign(tmp_path: Path, late_s: float) -> None:
    a, b = run_of(tmp_path / "a.mcap"), run_of(tmp_path / "b.mcap", late_s=late_s)
    comparison = compare(read_flown(a), read_flown(b), truth())
    assert comparison.between.lag_ms == pytest.approx(1e3 * late_s, abs=3.0)
    assert comparison.truths is not None
    assert comparison.truths[1].lag_ms == pytest.approx(1e3 * late_s, abs=3.0)


def test_a_vehicle_that_stands_has_no_lag(tmp_path: Path) -> None:
    still = Path7(truth().t_ns, np.tile([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], (len(truth().t_ns), 1)), truth().joined)
    a = read_flown(run_of(tmp_path / "a.mcap"))
    comparison = compare(a, a, still)
    assert comparison.truths is not None
    assert comparison.truths[0].lag_ms is None


def test_runs_at_other_instants_are_compared_between_them_but_not_across_gaps(tmp_path: Path) -> None:
    a = run_of(tmp_path / "a.mcap")
    b = run_of(tmp_path / "b.mcap", times=range(START_NS + 30 * MS, START_NS + 10 * S, PERIOD_NS))
    between = compare(read_flown(b), read_flown(a), None).between
    assert between.t_ns.max() <= START_NS + 10 * S
    assert between.distance_mm.max() < 2.0


def test_runs_that_share_no_time_are_refused_in_one_line(tmp_path: Path) -> None:
    a = run_of(tmp_path / "a.mcap")
    b = run_of(tmp_path / "b.mcap", times=range(START_NS + 100 * S, START_NS + 103 * S, PERIOD_NS))
    with pytest.raises(OperatorError, match=r"b and a share no time \(150\.000 to 15\d\.\d+ s and 50\.000 to"):
        compare(read_flown(a), read_flown(b), None)


def test_nis_is_weighed_by_its_degrees_of_freedom(tmp_path: Path) -> None:
    found = nis_share(read_flown(run_of(tmp_path / "a.mcap", nis=60.0)))
    assert found is not None
    assert found[0] == pytest.approx(5.0)
    assert found[1] == 0.0


def test_the_command_prints_the_figures_and_draws_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = run_of(tmp_path / "a.mcap"), run_of(tmp_path / "b.mcap", shift_m=0.002)
    run_compare(a, b, None, tmp_path / "out.png", as_json=True)
    figures = json.loads(capsys.readouterr().out)
    assert figures["B less A"]["mean_mm"] == pytest.approx(2.0)
    assert figures["A"]["latency_ms"]["p50"] == pytest.approx(3.0)
    assert figures["same_mavlink_bytes"] is None
    picture = cv2.imread(str(tmp_path / "out.png"))
    assert picture is not None
    assert picture.std() > 10
    run_compare(a, b, None, None, as_json=False)
    assert "error mean mm" in capsys.readouterr().out
    run_compare(a, a, None, None, as_json=False)
    assert "-0.000" not in capsys.readouterr().out

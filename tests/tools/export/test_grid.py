"""Estimates and the autopilot's messages on one clock, with what was lost, late, restarted or set told."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.tools.export.flights import (
    ATTITUDE,
    LINK,
    MS,
    SERVO,
    START_NS,
    Line,
    S,
    attitude,
    clock,
    every,
    pose,
    poses,
    received,
    servo,
    timesync,
    truth_m,
    write,
)  # fmt: skip
from tools.export.export import ExportTerms, export
from tracker.errors import OperatorError

PERIOD_NS = 33_333_333
BOOT_NS = 7 * S


def table(log: Path, rate_hz: float = 50.0, gap_ms: float | None = None) -> tuple[list[dict[str, str]], dict[str, Any]]:
    """Export a log as csv and return its rows and its alignment report."""
    out = log.with_suffix(".csv")
    done = export(log, ExportTerms("csv", rate_hz, gap_ms), out)
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    report = json.loads(out.with_name("a.csv.alignment.json").read_text())
    assert done.count == len(rows) == report["rows"]
    return rows, report


def column(rows: list[dict[str, str]], name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([float(row[name]) for row in rows])


def stream(report: dict[str, Any], topic: str) -> dict[str, Any]:
    (found,) = (each for each in report["streams"] if each["stream"] == topic)
    return dict(found)


def test_times_are_a_fixed_step_apart_on_stream_time(tmp_path: Path) -> None:
    rows, _ = table(write(tmp_path / "a.mcap", poses(every(PERIOD_NS, 10.0))), rate_hz=40.0)
    times = np.array([int(row["t_ns"]) for row in rows])
    assert times[0] == START_NS
    assert set(np.diff(times)) == {25 * MS}
    np.testing.assert_allclose(column(rows, "t_s"), (times - START_NS) / S)
    truth = [truth_m(t_ns) for t_ns in times]
    np.testing.assert_allclose(column(rows, "x_m"), truth, atol=2e-3)


def test_what_the_autopilot_did_stands_beside_what_came_of_it_though_it_arrived_late(tmp_path: Path) -> None:
    """Late by 80 to 200 ms and in bursts: by the log's time sync each value is put where it was measured."""
    measured_ns = np.array(every(20 * MS, 10.0, START_NS + 3 * MS))
    late_ns = np.repeat(np.random.default_rng(1).integers(80 * MS, 200 * MS, 125), 4)
    arrived_ns = np.maximum.accumulate(measured_ns + late_ns)  # a link keeps the order
    servos = [servo(t, BOOT_NS, arrived) for t, arrived in zip(measured_ns.tolist(), arrived_ns.tolist(), strict=True)]
    syncs = [timesync(t_ns, BOOT_NS) for t_ns in every(S, 11.0)]
    rows, report = table(write(tmp_path / "a.mcap", [*poses(every(PERIOD_NS, 10.0)), *servos, *syncs]))
    both = slice(5, -20)
    followed = (column(rows, "ap_servo1_us")[both] - 1500) / 400
    np.testing.assert_allclose(followed, column(rows, "x_m")[both], atol=5e-3)
    told = stream(report, SERVO)
    assert told["times_by"] == {"autopilot's clock by time sync": 500}
    assert told["arrival_delay_ms"]["p50"] == pytest.approx(140, abs=25)
    assert "ap_servo2_us" not in rows[0], "a channel that never had a value is no column"


def test_without_a_time_sync_messages_stand_at_their_arrival_and_the_report_says_so(tmp_path: Path) -> None:
    servos = [servo(t_ns, BOOT_NS, t_ns + 30 * MS) for t_ns in every(20 * MS, 3.0)]
    _, report = table(write(tmp_path / "a.mcap", [*poses(every(PERIOD_NS, 3.0)), *servos]))
    assert stream(report, SERVO)["times_by"] == {"arrival": 150}
    assert report["autopilot_clocks"] == []


def test_two_restarts_of_the_autopilot_in_one_log_each_have_a_clock_of_their_own(tmp_path: Path) -> None:
    boots = [(START_NS, BOOT_NS), (START_NS + 5 * S, START_NS + 4 * S), (START_NS + 10 * S, START_NS + 9 * S)]
    lines = poses(every(PERIOD_NS, 15.0))
    for number, (from_ns, boot_ns) in enumerate(boots):
        drift = 20e-6 * number
        lines += [servo(t_ns, boot_ns, t_ns + 40 * MS) for t_ns in every(20 * MS, 4.0, from_ns + S // 2)]
        lines += [
            timesync(t_ns, boot_ns + round(drift * (t_ns - from_ns)), number)
            for t_ns in every(S, 4.5, from_ns + S // 2)
        ]
    rows, report = table(write(tmp_path / "a.mcap", lines))
    servo1, known = column(rows, "ap_servo1_us"), column(rows, "ap_servo_output_raw_flag") == 0
    assert known.sum() > 550
    np.testing.assert_allclose((servo1[known] - 1500) / 400, column(rows, "x_m")[known], atol=5e-3)
    (told,) = report["autopilot_clocks"]
    assert (told["link"], told["restarts"]) == (LINK, 2)
    assert [round(boot["skew_ppm"]) for boot in told["boots"]] == [0, 20, 40]
    assert stream(report, SERVO)["gaps"]["count"] == 2


def test_gaps_are_empty_flagged_and_counted(tmp_path: Path) -> None:
    times = [t_ns for t_ns in every(PERIOD_NS, 10.0) if not START_NS + 4 * S < t_ns < START_NS + 5 * S]
    rows, report = table(write(tmp_path / "a.mcap", poses(times)))
    flags, x_m = column(rows, "estimate_flag").astype(int), column(rows, "x_m")
    assert ((flags & 4 > 0) == np.isnan(x_m)).all()
    assert 47 <= np.count_nonzero(flags & 4) <= 52
    assert {row["state"] for row, flag in zip(rows, flags, strict=True) if flag & 4} == {""}
    told = stream(report, "/estimate")
    assert told["gaps"] == {
        "count": 1,
        "longest_ms": pytest.approx(1033, abs=40),
        "limit_ms": pytest.approx(100, rel=0.02),
    }
    assert told["rows"]["absent"] == np.count_nonzero(flags & 4)
    filled, _ = table(tmp_path / "a.mcap", gap_ms=1500.0)
    assert not np.isnan(column(filled, "x_m")).any()
    assert np.count_nonzero(column(filled, "estimate_flag").astype(int) & 1) >= 47


def test_a_jump_of_the_estimate_is_not_bridged(tmp_path: Path) -> None:
    lines = [
        pose(t_ns, reset_counter=int(t_ns > START_NS + S), x_m=float(t_ns > START_NS + S))
        for t_ns in every(PERIOD_NS, 2.0)
    ]
    rows, _ = table(write(tmp_path / "a.mcap", lines), rate_hz=200.0)
    x_m = column(rows, "x_m")
    assert set(x_m[np.isfinite(x_m)]) == {0.0, 1.0}


def test_an_attitude_across_north_turns_the_short_way(tmp_path: Path) -> None:
    yaw = {t_ns: 3.0 + 0.5 * (t_ns - START_NS) / S for t_ns in every(40 * MS, 2.0)}
    lines = [attitude(t_ns, BOOT_NS, t_ns, float(np.angle(np.exp(1j * rad)))) for t_ns, rad in yaw.items()]
    rows, _ = table(write(tmp_path / "a.mcap", lines), rate_hz=100.0)
    heading = np.unwrap([2 * np.arctan2(float(row["ap_qz"]), float(row["ap_qw"])) for row in rows], period=2 * np.pi)
    np.testing.assert_allclose(np.diff(heading), 0.005, atol=1e-4)
    assert stream(json.loads((tmp_path / "a.csv.alignment.json").read_text()), ATTITUDE)["samples"] == 50


def test_a_wall_clock_that_is_set_changes_no_time_and_is_told(tmp_path: Path) -> None:
    walls = [clock(t_ns, t_ns + 1_000 * S + (3600 * S if t_ns > START_NS + 5 * S else 0)) for t_ns in every(S, 10.0)]
    rows, report = table(write(tmp_path / "a.mcap", [*poses(every(PERIOD_NS, 10.0)), *walls]))
    assert len(rows) == pytest.approx(500, abs=2)
    assert report["wall_clock"]["jumps"] == [{"t_ns": START_NS + 6 * S, "step_s": 3600.0}]
    assert [part["readings"] for part in report["wall_clock"]["parts"]] == [6, 4]


def test_a_run_that_took_no_account_of_the_wall_clock_says_nothing_of_it(tmp_path: Path) -> None:
    log = write(tmp_path / "a.mcap", [*poses(every(PERIOD_NS, 1.0)), clock(START_NS, 5)], {"pace": "fast"})
    assert table(log)[1]["wall_clock"] is None


def test_a_second_sender_of_the_same_message_gets_columns_of_its_own(tmp_path: Path) -> None:
    fields = {"servo1_raw": 1100}
    lines = [servo(t_ns, BOOT_NS, t_ns) for t_ns in every(20 * MS, 1.0)]
    lines += [received(SERVO, fields, -1, t_ns, system_id=2) for t_ns in every(20 * MS, 1.0)]
    rows, report = table(write(tmp_path / "a.mcap", lines))
    assert float(rows[10]["ap_servo1_us_2"]) == pytest.approx(1100)
    assert float(rows[10]["ap_servo1_us"]) == pytest.approx(1500 + 400 * truth_m(int(rows[10]["t_ns"])), abs=2)
    assert [each["system_id"] for each in report["streams"]] == [1, 2]


def test_an_hour_in_which_nothing_was_logged_makes_no_rows(tmp_path: Path) -> None:
    lines = poses([*every(PERIOD_NS, 2.0), *every(PERIOD_NS, 2.0, START_NS + 3600 * S)])
    rows, report = table(write(tmp_path / "a.mcap", lines))
    assert len(rows) < 2000
    (pause,) = report["pauses"]
    assert pause["to_ns"] - pause["from_ns"] > 3500 * S
    assert np.count_nonzero(column(rows, "estimate_flag") == 0) >= 190


def test_a_time_that_cannot_be_stretches_no_table(tmp_path: Path) -> None:
    lines = poses(every(PERIOD_NS, 2.0))
    wild = pose(2**61)
    lines.append(Line(wild.topic, START_NS + S, wild.value))
    rows, report = table(write(tmp_path / "a.mcap", lines))
    assert len(rows) <= 100
    assert report["unusable_records"] == 1


def test_a_record_that_lacks_what_is_read_is_left_out_and_counted(tmp_path: Path) -> None:
    lines = [*poses(every(PERIOD_NS, 2.0)), *(servo(t_ns, BOOT_NS, t_ns) for t_ns in every(20 * MS, 2.0))]
    for line in (lines[10], lines[-10]):
        line.value.pop("nis", line.value.pop("fields", None))
    _, report = table(write(tmp_path / "a.mcap", lines))
    assert report["unusable_records"] == 2


def test_samples_that_come_twice_or_go_back_are_left_out_and_counted(tmp_path: Path) -> None:
    lines = poses(every(PERIOD_NS, 2.0))
    twice = lines[10]
    lines.append(Line(twice.topic, lines[12].log_ns, twice.value))
    _, report = table(write(tmp_path / "a.mcap", lines))
    assert stream(report, "/estimate")["not_after_the_one_before"] == 1


def test_a_log_with_nothing_to_export_is_told_in_one_line(tmp_path: Path) -> None:
    log = write(tmp_path / "a.mcap", [clock(START_NS, 1)])
    with pytest.raises(OperatorError, match="holds no estimate and no message of an autopilot to export"):
        export(log, ExportTerms("csv", 50.0), tmp_path / "a.csv")


def test_a_log_without_estimates_has_the_autopilots_columns_and_no_trajectory(tmp_path: Path) -> None:
    log = write(tmp_path / "a.mcap", [servo(t_ns, BOOT_NS, t_ns) for t_ns in every(20 * MS, 1.0)])
    rows, _ = table(log)
    assert tuple(rows[0]) == ("t_ns", "t_s", "ap_servo1_us", "ap_servo_output_raw_flag")
    with pytest.raises(OperatorError, match="holds no estimate to make a trajectory of"):
        export(log, ExportTerms("tum", 50.0), tmp_path / "a.tum")


@pytest.mark.parametrize(
    ("terms", "complaint"),
    [
        (("csv", 0.0), "--rate_hz: 0 Hz must be 0.1 to 2000 Hz"),
        (("csv", float("nan")), "--rate_hz: nan Hz must be"),
        (("csv", None, 50.0), "50 ms: only rows at a fixed rate have gaps; give --rate_hz too"),
        (("csv", 10.0, -1.0), "-1 ms must be positive"),
        (("tlog", 10.0), "leave it out"),
    ],
)
def test_terms_that_cannot_be_are_refused(terms: tuple[Any, ...], complaint: str) -> None:
    with pytest.raises(OperatorError, match=complaint):
        ExportTerms(*terms)

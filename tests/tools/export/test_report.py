"""What the operator reads of an export's alignment."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tools.export.flights import MS, START_NS, S, clock, every, poses, servo, timesync, write
from tools.export.command import run_export
from tools.export.export import ExportTerms


def told(log: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Export a log and return what stands on stderr."""
    run_export(log, ExportTerms("csv", 50.0), None)
    captured = capsys.readouterr()
    assert captured.out == ""
    return captured.err


def test_each_stream_is_a_line_and_each_clock_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = poses(every(66_666_667, 5.0))
    lines += [servo(t_ns, 7 * S, t_ns + 30 * MS) for t_ns in every(20 * MS, 5.0)]
    lines += [timesync(t_ns, 7 * S) for t_ns in every(S, 5.0)]
    lines += [clock(t_ns, t_ns + (60 * S if t_ns > START_NS + 2 * S else 0)) for t_ns in every(S, 5.0)]
    text = told(write(tmp_path / "a.mcap", lines), capsys)
    assert "SERVO_OUTPUT_RAW  autopilot's clock by time sync" in text
    assert "offset 7000.0 ms, skew +0.0 ppm, jitter 0.00 ms" in text
    assert f"the wall clock was set by +60.000 s at {START_NS + 3 * S} ns" in text
    assert text.endswith(f"rows written to {tmp_path / 'a.csv'}\n")


def test_a_wall_clock_that_stands_still_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [*poses(every(66_666_667, 20.0)), *(clock(t_ns, 5) for t_ns in every(S, 20.0))]
    text = told(write(tmp_path / "a.mcap", lines), capsys)
    assert text.count("the wall clock") == 1
    assert "was set 19 times: here it does not run with stream time" in text

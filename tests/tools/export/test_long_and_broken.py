"""Logs that are long, cut, killed or damaged: what is there comes out, what is lost is said, memory stays."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from rich.console import Console

from tests.bridge.recordings import START_NS as RECORDED_NS
from tests.bridge.recordings import record, turns
from tests.tools.export.flights import MS, S, every, poses, servo, timesync, write
from tools.bench.export import measure_export, write_long
from tools.compare.flown import read_flown
from tools.export.export import ExportTerms, export
from tools.export.progress import progress
from tools.request import CpuClocks
from tracker.errors import OperatorError

T = TypeVar("T")
ROOT = Path(__file__).parents[3]
FORMATS = ("csv", "mat", "parquet", "tum")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return the bytes of a log of ten seconds with estimates and an autopilot."""
    servos = [servo(t_ns, 7 * S, t_ns + 30 * MS) for t_ns in every(20 * MS, 10.0)]
    syncs = [timesync(t_ns, 7 * S) for t_ns in every(S, 10.0)]
    path = tmp_path_factory.mktemp("whole") / "a.mcap"
    return write(path, [*poses(every(33_333_333, 10.0)), *servos, *syncs]).read_bytes()


def outcome(attempt: Callable[[], T]) -> tuple[str, T | None]:
    """Return why something was refused, "" if it was not, and what it gave."""
    try:
        return "", attempt()
    except OperatorError as error:
        return str(error), None


def test_memory_does_not_grow_with_the_log(tmp_path: Path) -> None:
    """As many minutes as a test affords, written as fast as it goes through the real writer."""
    peaks = []
    for minutes in (2, 6):
        log = tmp_path / f"{minutes}.mcap"
        write_long(log, minutes / 60)
        tracemalloc.start()
        done = export(log, ExportTerms("csv", 25.0), tmp_path / "out.csv")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert done.count == pytest.approx(minutes * 60 * 25, abs=3)
    assert peaks[1] < 1.15 * peaks[0]


def test_the_benchmark_of_a_long_log_measures_what_it_says() -> None:
    ticks = iter(range(0, 10**12, 10**9))
    figures = measure_export(0.01, 20.0, "parquet", CpuClocks(lambda: next(ticks), lambda: 0))
    assert figures.hours == 0.01
    assert figures.rows == pytest.approx(720, abs=3)
    assert (figures.write_cpu_s, figures.export_cpu_s) == (1.0, 1.0)
    assert figures.log_mb > 0.1


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("share", [0.02, 0.3, 0.7, 0.95])
def test_a_log_cut_anywhere_gives_what_is_there_and_says_what_is_missing(
    whole: bytes, tmp_path: Path, format: str, share: float
) -> None:
    log, out = tmp_path / "a.mcap", tmp_path / f"a.{format}"
    log.write_bytes(whole[: round(share * len(whole))])
    complaint, done = outcome(lambda: export(log, ExportTerms(format, 20.0), out))
    if done is None:
        assert "bytes lost" in complaint
        assert "\n" not in complaint
        assert share < 0.3
        assert not out.exists()
    else:
        assert 0 < done.count <= 201
        assert done.lost


def test_a_killed_flight_exports_up_to_its_last_second(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    command = [sys.executable, "-m", "tests.bridge.recording_process", str(path), "0"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if int(line) > RECORDED_NS + 4 * S:
                break
        process.kill()
        last_ns = max(map(int, process.stdout.read().split()[:-1]), default=int(line))
    done = export(path, ExportTerms("csv", 50.0), tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert "no end mark" in str(done.lost[0])
    assert last_ns - int(rows[-1]["t_ns"]) < 1.1 * S
    assert json.loads((tmp_path / "a.csv.alignment.json").read_text())["lost"] == [str(done.lost[0])]


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_log_is_read_around_its_damage_or_refused_in_one_line(
    whole: bytes, tmp_path: Path, seed: int
) -> None:
    generator = np.random.default_rng(seed)
    data = bytearray(whole)
    for place in generator.integers(8, len(data), 1 + seed):
        data[place] = int(generator.integers(256))
    log = tmp_path / "a.mcap"
    log.write_bytes(data)
    attempts: list[Callable[[], object]] = [
        lambda: export(log, ExportTerms("parquet", 20.0), tmp_path / "a.parquet"),
        lambda: export(log, ExportTerms("csv"), tmp_path / "a.csv"),
        lambda: export(log, ExportTerms("tlog"), tmp_path / "a.tlog"),
        lambda: read_flown(log),
    ]
    for attempt in attempts:
        complaint, done = outcome(attempt)
        assert (done is None) == bool(complaint)
        assert "\n" not in complaint


def test_a_bar_is_shown_on_a_terminal_alone() -> None:
    for terminal in (True, False):
        screen = StringIO()
        console = Console(file=screen, force_terminal=terminal, width=80)
        with progress(console, 1000, 2) as on_offset:
            for offset in (0, 500, 999, 0, 500, 999):
                on_offset(offset)
        assert ("reading the log" in screen.getvalue()) is terminal


def test_a_log_without_the_autopilots_topics_has_estimates_alone(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", turns(100))
    done = export(tmp_path / "a.mcap", ExportTerms("csv", 30.0), tmp_path / "a.csv")
    assert done.alignment is not None
    assert [stream["stream"] for stream in done.alignment["streams"]] == ["/estimate"]

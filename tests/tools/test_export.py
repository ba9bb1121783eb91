"""Exports: every number survives, and a failed one leaves nothing behind."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import threading
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.bridge.estimates import estimate, step
from tests.bridge.recordings import record, turns
from tools.export.export import Exported, ExportTerms
from tools.export.export import export as export_by
from tools.export.lines import CSV_COLUMNS
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.types import Silence, frozen_array

ROOT = Path(__file__).parents[2]


def export(log: Path, format: str, out: Path) -> Exported:
    """Export each estimate at its own time."""
    return export_by(log, ExportTerms(format), out)


finite = st.floats(-1e6, 1e6, allow_nan=False)
vectors = st.tuples(finite, finite, finite)
turning = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
times_ns = st.integers(0, 2**62)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "flight.mcap"
    record(path, turns(30))
    return path


@settings(deadline=None, max_examples=40)
@given(poses=st.lists(st.tuples(times_ns, vectors, turning), max_size=20))
def test_tum_gives_every_time_and_pose_back_exactly(
    tmp_path_factory: pytest.TempPathFactory, poses: list[tuple[int, tuple[float, ...], tuple[float, ...]]]
) -> None:
    folder = tmp_path_factory.mktemp("tum")
    estimates = [estimate(t_ns, p_BinW=p, R_BtoW=so3.exp(np.array(theta))) for t_ns, p, theta in poses]
    record(folder / "a.mcap", [(Silence(one.t_ns), step(one), (), one.t_ns) for one in estimates])
    report = export(folder / "a.mcap", "tum", folder / "a.tum")
    lines = (folder / "a.tum").read_text().splitlines()
    assert (report.count, report.lost, len(lines)) == (len(poses), (), len(poses))
    for one, line in zip(estimates, lines, strict=True):
        t_s, *numbers = line.split(" ")
        assert len(t_s.partition(".")[2]) == 9
        assert Decimal(t_s) * 10**9 == one.t_ns
        assert list(map(float, numbers[:3])) == one.p_BinW.tolist()
        x, y, z, w = map(float, numbers[3:])
        assert [w, x, y, z] == so3.quaternion(one.R_BtoW).tolist()


def test_csv_has_a_named_column_with_its_unit_for_each_number(log: Path, tmp_path: Path) -> None:
    assert export(log, "csv", tmp_path / "a.csv").count == 30
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == CSV_COLUMNS
    for (_, taken, _, _), row in zip(turns(30), rows, strict=True):
        one = taken.estimates[0]
        assert int(row["t_ns"]) == one.t_ns
        assert [float(row[f"v{axis}_m_s"]) for axis in "xyz"] == one.v_BinW.tolist()
        assert [float(row[f"w{axis}_rad_s"]) for axis in "xyz"] == one.w_BinB.tolist()
        deviations = [float(row[name]) for name in CSV_COLUMNS if name.startswith("sd_")]
        np.testing.assert_allclose(np.square(deviations), np.diag(one.covariance), rtol=1e-12)
        assert (row["state"], int(row["nis_dof"])) == ("tracking", 6)


def test_a_number_that_is_not_finite_reads_nan(tmp_path: Path) -> None:
    unknown = estimate(7, covariance=np.full((12, 12), np.nan), v_BinW=frozen_array([np.inf, 0.0, 0.0]))
    record(tmp_path / "a.mcap", [(Silence(7), step(unknown), (), 7)])
    export(tmp_path / "a.mcap", "csv", tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["vx_m_s"], row["sd_wz_rad_s"]) == ("nan", "nan")


def test_a_log_cut_short_gives_what_is_there_and_says_what_is_missing(log: Path, tmp_path: Path) -> None:
    data = log.read_bytes()
    log.write_bytes(data[: len(data) * 2 // 3])
    for format in ("tum", "csv"):
        report = export(log, format, tmp_path / "out")
        assert 0 <= report.count < 30
        assert report.lost


def test_an_unknown_format_names_the_known_ones(log: Path, tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="unknown format 'bag'; known are csv, mat, parquet, tlog, tum"):
        export(log, "bag", tmp_path / "a.bag")


def test_the_log_itself_is_never_the_output(log: Path, tmp_path: Path) -> None:
    before = log.read_bytes()
    (tmp_path / "link").symlink_to(log)
    for path in (log, tmp_path / "link"):
        with pytest.raises(OperatorError, match="this command goes by that file, which is kept"):
            export(log, "tum", path)
    assert log.read_bytes() == before


@pytest.mark.parametrize("where", ["", "missing/a.tum"])
def test_an_output_that_cannot_be_written_is_told_in_one_line(log: Path, tmp_path: Path, where: str) -> None:
    before = set(tmp_path.iterdir())
    with pytest.raises(OperatorError, match=r"^export .*"):
        export(log, "tum", tmp_path / where)
    assert set(tmp_path.iterdir()) == before


def test_a_full_disk_is_told_in_one_line(log: Path, full_disk: Path) -> None:
    with pytest.raises(OperatorError, match="No space left on device"):
        export(log, "csv", full_disk)


def test_a_disk_that_fills_up_while_writing_leaves_no_half_export(log: Path, tmp_path: Path) -> None:
    before = set(tmp_path.iterdir())
    script = (
        "import resource, sys; from pathlib import Path; from tools.export.export import ExportTerms, export\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))\n"
        "export(Path(sys.argv[1]), ExportTerms('csv'), Path(sys.argv[2]))"
    )
    command = [sys.executable, "-c", script, str(log), str(tmp_path / "a.csv")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert "OperatorError: export" in done.stderr
    assert "File too large" in done.stderr
    assert set(tmp_path.iterdir()) == before


def test_a_log_that_cannot_be_read_leaves_an_earlier_export_alone(tmp_path: Path) -> None:
    (tmp_path / "bad.mcap").write_bytes(b"no log at all")
    (tmp_path / "a.tum").write_text("an earlier export\n")
    with pytest.raises(OperatorError, match="is no MCAP"):
        export(tmp_path / "bad.mcap", "tum", tmp_path / "a.tum")
    assert (tmp_path / "a.tum").read_text() == "an earlier export\n"


def test_an_export_replaces_its_output_with_usual_permissions_and_leaves_no_scratch_file(
    log: Path, tmp_path: Path
) -> None:
    (tmp_path / "a.tum").write_text("an earlier export\n")
    (tmp_path / "by_hand").touch()
    export(log, "tum", tmp_path / "a.tum")
    assert (tmp_path / "a.tum").read_text().count("\n") == 30
    assert (tmp_path / "a.tum").stat().st_mode == (tmp_path / "by_hand").stat().st_mode
    assert {path.name for path in tmp_path.iterdir()} == {"a.tum", "by_hand", "flight.mcap"}


def test_a_pipe_is_written_as_it_goes(log: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    received: list[str] = []
    drain = threading.Thread(target=lambda: received.append((tmp_path / "pipe").read_text()))
    drain.start()
    export(log, "tum", tmp_path / "pipe")
    drain.join()
    assert received[0].count("\n") == 30
    assert (tmp_path / "pipe").is_fifo()

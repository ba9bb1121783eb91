"""Each format read back by the programs it is meant for: pandas, pyarrow, scipy, evo, pymavlink."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import scipy.io
from evo.tools import file_interface
from pymavlink import mavutil

from bridge.dialect import Encoder, Identity
from bridge.pack import heartbeat
from tests.bridge.recordings import record, turns
from tests.tools.export.flights import MS, START_NS, Line, S, clock, every, poses, received, servo, timesync, write
from tools.export.export import ExportTerms, export
from tools.export.lines import CSV_COLUMNS
from tracker.types import Silence, Step, TrackState

PERIOD_NS = 33_333_333


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Return a log of estimates and servos, with a gap of half a second in the estimates."""
    times = [t_ns for t_ns in every(PERIOD_NS, 8.0) if not 53 * S < t_ns < 53.5 * S]
    servos = [servo(t_ns, 7 * S, t_ns + 30 * MS) for t_ns in every(20 * MS, 8.0)]
    syncs = [timesync(t_ns, 7 * S) for t_ns in every(S, 9.0)]
    return write(tmp_path / "a.mcap", [*poses(times), *servos, *syncs])


def frames(log: Path, rate_hz: float | None) -> dict[str, pd.DataFrame]:
    """Return the same table by way of csv, parquet and mat."""
    for format in ("csv", "parquet", "mat"):
        export(log, ExportTerms(format, rate_hz), log.with_suffix(f".{format}"))
    mat = scipy.io.loadmat(log.with_suffix(".mat"))
    columns = {name: _plain(values) for name, values in mat.items() if not name.startswith("__")}
    return {
        "csv": pd.read_csv(log.with_suffix(".csv"), keep_default_na=False, na_values=["nan"]),
        "parquet": pq.read_table(log.with_suffix(".parquet")).to_pandas(),
        "mat": pd.DataFrame(columns),
    }


def _plain(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return np.char.strip(values) if values.dtype.kind == "U" else values[:, 0]


@pytest.mark.parametrize("rate_hz", [None, 20.0, 100.0])
def test_csv_parquet_and_mat_hold_the_same_numbers_to_the_last_bit(log: Path, rate_hz: float | None) -> None:
    tables = frames(log, rate_hz)
    reference = tables.pop("parquet")
    assert len(reference) > 150
    assert reference["t_ns"].dtype == np.int64
    for table in tables.values():
        assert list(table.columns) == list(reference.columns)
        for name in reference.columns:
            np.testing.assert_array_equal(table[name].to_numpy(), reference[name].to_numpy(), err_msg=name)
    if rate_hz is not None:
        assert {"x_m", "qw", "ap_servo1_us", "estimate_flag", "ap_servo_output_raw_flag"} <= set(reference.columns)
        assert reference["x_m"].isna().any()


def test_every_column_says_its_unit_or_has_none(log: Path) -> None:
    export(log, ExportTerms("parquet", 20.0), log.with_suffix(".parquet"))
    without = {"qw", "qx", "qy", "qz", "state", "reset_counter", "nis", "nis_dof"}
    units = ("_ns", "_s", "_m", "_rad", "_us", "_flag")
    names = set(pq.read_schema(log.with_suffix(".parquet")).names) - without
    assert all(name.endswith(units) for name in names), names


def test_estimates_at_their_own_times_are_whole_numbers_where_they_count(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", turns(30))
    export(tmp_path / "a.mcap", ExportTerms("parquet"), tmp_path / "a.parquet")
    table = pq.read_table(tmp_path / "a.parquet").to_pandas()
    assert tuple(table.columns) == CSV_COLUMNS
    assert (table["reset_counter"].dtype, table["nis_dof"].dtype) == (np.int64, np.int64)
    expected = [taken.estimates[0].p_BinW[0] for _, taken, _, _ in turns(30)]
    np.testing.assert_array_equal(table["x_m"], expected)


@pytest.mark.parametrize("format", ["csv", "parquet", "mat", "tum", "tlog"])
def test_a_log_without_a_single_estimate_gives_a_file_that_can_be_read(tmp_path: Path, format: str) -> None:
    record(tmp_path / "a.mcap", [(Silence(7), Step(TrackState.SEARCHING), (), 7)])
    out = tmp_path / f"a.{format}"
    assert export(tmp_path / "a.mcap", ExportTerms(format), out).count == 0
    if format == "csv":
        assert tuple(pd.read_csv(out).columns) == CSV_COLUMNS
    elif format == "parquet":
        assert pq.read_table(out).num_rows == 0
    elif format == "mat":
        assert "x_m" in scipy.io.loadmat(out)


@pytest.mark.parametrize("rate_hz", [None, 20.0])
def test_evo_reads_a_tum_file_as_the_trajectory_it_is(log: Path, rate_hz: float | None) -> None:
    export(log, ExportTerms("tum", rate_hz), log.with_suffix(".tum"))
    export(log, ExportTerms("parquet", rate_hz), log.with_suffix(".parquet"))
    trajectory = file_interface.read_tum_trajectory_file(str(log.with_suffix(".tum")))
    table = pq.read_table(log.with_suffix(".parquet")).to_pandas().dropna(subset=["x_m"])
    assert trajectory.check()[0], trajectory.check()[1]
    np.testing.assert_array_equal(trajectory.positions_xyz, table[["x_m", "y_m", "z_m"]])
    np.testing.assert_array_equal(trajectory.orientations_quat_wxyz, table[["qw", "qx", "qy", "qz"]])
    np.testing.assert_allclose(trajectory.timestamps, table["t_ns"] / 1e9, atol=1e-9)


def test_pymavlinks_own_reader_reads_a_tlog_in_order_with_wall_clock_times(tmp_path: Path) -> None:
    encode = Encoder(Identity(1, 197))
    wall_ns = 1_700_000_000 * S
    lines = [clock(t_ns, wall_ns + t_ns - START_NS) for t_ns in every(S, 3.0)]
    for k, t_ns in enumerate(every(100 * MS, 3.0)):
        raw = base64.b64encode(encode(heartbeat(t_ns), k)).decode()
        sent = {"link": "udpout:127.0.0.1:14550", "t_ns": t_ns, "raw": raw}
        lines.append(Line("/mavlink/sent/HEARTBEAT", t_ns + 50 * MS, sent))
        late = received("/mavlink/received/HEARTBEAT", {}, -1, t_ns)
        lines.append(Line(late.topic, t_ns + 80 * MS, late.value | {"raw": raw, "link": "serial:/dev/ttyAMA0:921600"}))
    done = export(write(tmp_path / "a.mcap", lines), ExportTerms("tlog"), tmp_path / "a.tlog")
    connection = mavutil.mavlink_connection(str(tmp_path / "a.tlog"))
    messages = list(iter(lambda: connection.recv_match(type="HEARTBEAT"), None))
    connection.close()
    assert len(messages) == done.count == 60
    assert {message._link for message in messages[::2]} == {1}
    assert {message._link for message in messages[1::2]} == {0}
    stamps = [message._timestamp for message in messages]
    assert stamps == sorted(stamps)
    assert stamps[0] == pytest.approx(1_700_000_000.0, abs=1e-3)
    assert stamps[1] == pytest.approx(1_700_000_000.05, abs=1e-3)

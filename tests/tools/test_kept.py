"""No command writes over what it goes by."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from bridge.settings import shipped_configs
from tests.bridge.recordings import record, turns
from tools.cli import EXIT_OPERATOR, run_command_line
from tools.kept import keep, keep_flight
from tracker.errors import OperatorError

KEPT = "this command goes by that file, which is kept; name another"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    record(tmp_path / "flight.mcap", turns(3))
    return tmp_path / "flight.mcap"


@pytest.mark.parametrize(
    "arguments",
    [
        "run --source log:LOG --log LOG --overwrite",
        "run --source video:LOG,LOG --log LOG --overwrite",
        "replay LOG --config lab --log LOG --overwrite",
        "replay LOG --config lab --summary LOG",
        "compare LOG LOG --out LOG",
        "export LOG --format tum --out LOG",
        "sysid LOG --out LOG",
    ],
)
def test_a_log_outlives_the_command_that_reads_it(
    arguments: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = log.read_bytes()
    assert run_command_line(arguments.replace("LOG", str(log)).split()) == EXIT_OPERATOR
    assert KEPT in capsys.readouterr().err
    assert log.read_bytes() == before


@pytest.mark.parametrize("own", ["flight.tlog", "flight.0.tlog", "flight.12.tlog"])
def test_the_tlog_that_a_flight_wrote_outlives_exports(own: str, log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = log.with_name(own)
    path.write_bytes(b"as it was flown")
    assert run_command_line(["export", str(log), "--format", "tlog", "--out", str(path)]) == EXIT_OPERATOR
    assert capsys.readouterr().err.endswith(
        f"export {path}: is what the flight itself wrote beside its log; name another file\n"
    )
    for _ in range(2):  # again too: an export is replaced
        assert run_command_line(["export", str(log), "--format", "tlog"]) == 0
    assert path.read_bytes() == b"as it was flown"
    assert log.with_suffix(".export.tlog").read_bytes()


@pytest.mark.parametrize(
    "arguments", ["excite --config MY --out MY", "run --config MY --source sim:hover --summary MY"]
)
def test_a_config_outlives_the_command_that_goes_by_it(
    arguments: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "my.toml"
    shutil.copy(shipped_configs()["lab"], path)
    before = path.read_bytes()
    assert run_command_line(arguments.replace("MY", str(path)).split()) == EXIT_OPERATOR
    assert KEPT in capsys.readouterr().err
    assert path.read_bytes() == before


def test_a_summary_does_not_take_the_place_of_its_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = str(tmp_path / "flight.mcap")
    assert run_command_line(["run", "--source", "sim:hover", "--log", both, "--summary", both]) == EXIT_OPERATOR
    assert "--summary" in capsys.readouterr().err


def test_a_demo_does_not_take_the_place_of_a_flight(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = log.read_bytes()
    assert run_command_line(["demo", "--duration_s", "15", "--out", str(log.parent)]) == EXIT_OPERATOR
    assert capsys.readouterr().err.endswith(
        f"log {log}: is of another flight (recording:somewhere) and is kept; name another folder\n"
    )
    assert log.read_bytes() == before


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_log_of_the_same_source_may_be_replaced_however_it_ended(log: Path, share: float) -> None:
    log.write_bytes(log.read_bytes()[: round(share * log.stat().st_size)])
    keep_flight(log, "recording:somewhere")
    keep_flight(log.with_name("none.mcap"), "recording:somewhere")


def test_another_way_to_the_same_file_is_seen_and_a_device_is_none(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "there.toml")
    with pytest.raises(OperatorError, match=KEPT):
        keep((tmp_path / "there.toml",), tmp_path / "link", "--out")
    (tmp_path / "there.toml").touch()
    with pytest.raises(OperatorError, match=KEPT):
        keep((tmp_path / "there.toml",), tmp_path / "link", "--out")
    keep((Path("/dev/null"),), Path("/dev/null"), "--out")

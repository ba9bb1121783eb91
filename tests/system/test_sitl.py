"""`posebridge sitl`: an autopilot's software flown through rendered cameras, the whole tracker and bridge."""

from __future__ import annotations

import io
import itertools
import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from tools.request import Clocks
from tools.sitl.command import show
from tools.sitl.faults import FAULTS
from tools.sitl.radio import free_port
from tools.sitl.report import SitlReport
from tools.sitl.session import LOG, REPORT, SitlRequest, fly
from tools.sitl.setup import parameter_file
from tracker.errors import OperatorError

MISSION_S = 30.0


def flown(binary: Path | None, out: Path, *, faults: bool, connect: str | None = None) -> SitlReport:
    reading = itertools.count(1, 1000)
    clocks = Clocks(lambda: next(reading), lambda: next(reading), lambda: 10**18, lambda _: None)
    return fly(SitlRequest(binary, "heli", "lab", out, faults, MISSION_S, connect), clocks, Console(file=io.StringIO()))


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> SitlReport:
    """Fly the simulated autopilot once for all tests here, with the rehearsal."""
    return flown(None, tmp_path_factory.mktemp("sitl"), faults=True)


def test_every_figure_of_the_flight_keeps_its_limit(report: SitlReport) -> None:
    assert not [line for line in report.verdict.lines if not line.passed]


def test_the_autopilot_gets_its_origin_from_the_bridge_before_it_knows_its_position(report: SitlReport) -> None:
    texts = [text for _, text in report.texts]
    assert texts.index("EKF3 IMU0 origin set") < texts.index("EKF3 IMU0 is using external nav data")
    assert report.flags == ("0x33f",)


def test_every_fault_is_rehearsed_and_none_makes_the_failsafe_act(report: SitlReport) -> None:
    assert [outcome.fault for outcome in report.outcomes] == list(FAULTS)
    assert not [outcome.fault.name for outcome in report.outcomes if outcome.failsafe]


def test_no_fault_carries_the_vehicle_farther_than_it_may(report: SitlReport) -> None:
    """150 mm is what a square may be off its path; a told jump moves the vehicle by itself besides."""
    for outcome in report.outcomes:
        assert outcome.excursion_mm < outcome.fault.moves_mm + 150.0, outcome


def test_a_step_of_the_hosts_calendar_changes_nothing_for_the_autopilot(report: SitlReport) -> None:
    step = next(outcome for outcome in report.outcomes if outcome.fault.name == "clock step")
    assert step.ekf_error_mm < 20.0
    assert step.worst_ratio < 0.2


def test_the_report_is_json_and_can_be_shown(report: SitlReport, tmp_path: Path) -> None:
    told = json.loads(report.to_json())
    assert told["passed"] is True
    assert len(told["faults"]) == len(FAULTS)
    screen = io.StringIO()
    show(report, SitlRequest(None, "heli", "lab", tmp_path, faults=True), Console(file=screen, width=200))
    assert "square, off the path, max" in screen.getvalue()


@pytest.mark.parametrize(
    ("request_", "complaint"),
    [
        (lambda out: SitlRequest(None, "boat", "lab", out, faults=False), "--frame boat: not known; known are heli"),
        (
            lambda out: fly(
                SitlRequest(out / "nothing", "heli", "lab", out, faults=False),
                Clocks(lambda: 0, lambda: 0, lambda: 0, lambda _: None),
            ),
            "nothing: no program there",
        ),
    ],
)
def test_what_cannot_be_flown_is_one_line(request_: object, complaint: str, tmp_path: Path) -> None:
    assert callable(request_)
    with pytest.raises(OperatorError, match=complaint):
        request_(tmp_path)


@pytest.mark.sitl
def test_ardupilots_own_program_flies_the_same_plan(tmp_path: Path) -> None:
    """The real thing, where ARDUPILOT_SITL names it (docs/sitl.md). See conftest.py for where it does not."""
    report = flown(Path(os.environ["ARDUPILOT_SITL"]), tmp_path, faults=True)
    assert not [line for line in report.verdict.lines if not line.passed]
    assert not [outcome.fault.name for outcome in report.outcomes if outcome.failsafe]
    assert json.loads((tmp_path / REPORT).read_text())["autopilot"] == "ArduPilot"
    assert (tmp_path / LOG).stat().st_size > 100_000


@pytest.fixture
def running_program(tmp_path: Path) -> Iterator[str]:
    """Start ArduPilot's program as docs/sitl.md tells a user to; return the URI of its SERIAL0."""
    parameters, port = tmp_path / "vision.parm", free_port()
    parameters.write_text(parameter_file(30, {}), encoding="utf-8")
    command = (
        *(os.environ["ARDUPILOT_SITL"], "--base-port", str(port), "-I0", "--model", "JSON:127.0.0.1"),
        *("--speedup", "100", "--wipe", "--defaults", str(parameters), "--home", "47.0,8.0,400,0"),
    )
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as program:
        assert program.stdout is not None
        next(line for line in program.stdout if b"Waiting for connection" in line)
        yield f"tcp:127.0.0.1:{port}"
        program.kill()


@pytest.mark.sitl
def test_one_that_runs_already_is_taken_and_flies_the_plan(running_program: str, tmp_path: Path) -> None:
    report = flown(None, tmp_path, faults=False, connect=running_program)
    assert not [line for line in report.verdict.lines if not line.passed]
    assert report.autopilot == "ArduPilot"

"""Identification, whole: a plan, flown by the simulated helicopter before rendered cameras; its own values found."""

from __future__ import annotations

import io
import itertools
import json
from pathlib import Path

import pytest
from rich.console import Console

from bridge.settings import load_settings
from tests.tools.sysid.synthetic import truth
from tools.cli import EXIT_OPERATOR, run_command_line
from tools.demo import LOG
from tools.excite.fly import ExcitedFlight, fly_plan
from tools.excite.plan import make_plan
from tools.request import Clocks, DemoRequest, Pace
from tools.simulate.helicopter import Helicopter
from tools.sysid.log_data import read_log
from tools.sysid.parameters import INDEX, NAMES
from tools.sysid.report import Report
from tools.sysid.session import identify_log

SWEEP_S = 7.0
OWN = NAMES[: INDEX["delay"]]
"""The helicopter's own values; delay, trims and levels may be zero, where a share of them means nothing."""


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ExcitedFlight]:
    """Fly a plan once, as fast as it goes; return the log."""
    reading = itertools.count(1, 1000)
    clocks = Clocks(lambda: next(reading), lambda: next(reading), lambda: 0, lambda _: None)
    folder = tmp_path_factory.mktemp("excited")
    plan = make_plan(load_settings("lab"), SWEEP_S)
    flight = fly_plan(DemoRequest(60.0, 1, folder, Pace.FAST), plan.sequence, clocks, Console(file=io.StringIO()))
    return folder / LOG, flight


@pytest.fixture(scope="module")
def report(flown: tuple[Path, ExcitedFlight]) -> Report:
    """Identify it once."""
    log, _ = flown
    return identify_log(log, read_log(log))


def test_the_plan_is_flown_to_its_end_within_the_room_it_was_given(flown: tuple[Path, ExcitedFlight]) -> None:
    _, flight = flown
    half_m = make_plan(load_settings("lab"), SWEEP_S).half_m
    assert flight.landed
    assert (flight.reach_m[:2] < half_m[:2]).all()
    assert flight.summary.lost == 0


def test_the_helicopters_own_values_come_out_within_five_per_cent_and_their_stated_error(report: Report) -> None:
    true = truth(Helicopter())
    found = report.plain()["parameters"]
    off = {name: found[name]["value"] / true[INDEX[name]] - 1.0 for name in OWN}
    assert {name: share for name, share in off.items() if abs(share) > 0.05} == {}
    outside = {
        name: (found[name]["interval_95"], true[INDEX[name]])
        for name in OWN
        if not found[name]["interval_95"][0] <= true[INDEX[name]] <= found[name]["interval_95"][1]
    }
    assert outside == {}


def test_delay_and_trims_are_found_within_their_stated_error(report: Report) -> None:
    true = truth(Helicopter())
    found = report.plain()["parameters"]
    assert abs(found["delay"]["value"]) < 0.003
    for axis in ("roll", "pitch", "yaw", "heave"):
        trim = found[f"{axis}_trim"]
        assert abs(trim["value"] - true[INDEX[f"{axis}_trim"]]) < 3.0 * trim["standard_error"] < 0.02


def test_stated_errors_are_small_enough_to_mean_something(report: Report) -> None:
    found = report.plain()["parameters"]
    assert max(found[name]["standard_error"] / found[name]["value"] for name in OWN) < 0.04


def test_the_model_foretells_flight_that_it_has_not_seen(report: Report) -> None:
    plain = report.plain()
    assert all(plain["held_out"][name]["fit_percent"] > 80.0 for name in ("roll", "pitch", "yaw", "up"))
    assert all(each["coherence"] > 0.9 and each["cost"] < 50.0 for each in plain["frequency"].values())
    assert plain["residuals_white_share"] > 0.85


def test_the_page_needs_nothing_beside_it(report: Report) -> None:
    page = report.to_html()
    assert page.count("<svg") == 5
    assert all(name.replace("_", " ") in page for name in NAMES)
    assert "src=" not in page
    json.dumps(report.plain(), allow_nan=False)


def test_a_log_without_a_vehicle_sheet_or_a_wrong_model_is_one_line(
    flown: tuple[Path, ExcitedFlight], capsys: pytest.CaptureFixture[str]
) -> None:
    log, _ = flown
    assert run_command_line(["sysid", str(log), "--model", "cruise"]) == EXIT_OPERATOR
    assert "known are hover" in capsys.readouterr().err

"""A log read for the fit: the same flight back, cut where it must be, refused with a remedy where it cannot be used."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

from tests.tools.sysid.logs import Writing, write_log
from tests.tools.sysid.synthetic import Conditions, fly
from tools.cli import EXIT_OPERATOR, run_command_line
from tools.sysid.flight_data import FlightData
from tools.sysid.log_data import read_log
from tracker.errors import OperatorError


@functools.cache
def _flight() -> FlightData:
    return fly(Conditions(sweep_s=4.0))


def _short() -> FlightData:
    (track,) = _flight().tracks
    return FlightData((track.part(0, 150),), _flight().sticks)


def test_estimates_and_sticks_come_back_as_they_were_flown(tmp_path: Path) -> None:
    read = read_log(write_log(tmp_path / "a.mcap", _flight(), Writing()))
    (track,), (flown,) = read.data.tracks, _flight().tracks
    kept = slice(len(flown) - len(track), None)
    assert len(track) >= len(flown) - 1
    assert track.t_s - 100.0 == pytest.approx(flown.t_s[kept], abs=1e-6)
    assert track.p_inW == pytest.approx(flown.p_inW[kept])
    assert track.R_BtoW == pytest.approx(flown.R_BtoW[kept], abs=1e-9)
    assert track.sigma == pytest.approx(flown.sigma[kept], rel=1e-6)
    assert read.data.sticks.at_s - 100.0 == pytest.approx(_flight().sticks.at_s, abs=2e-6)  # by TIMESYNC, not arrival
    assert read.data.sticks.held == pytest.approx(_flight().sticks.held.clip(-99, 99), abs=0.0011)
    assert read.servo_hz == pytest.approx(50.0)


def test_without_timesync_the_servos_are_as_late_as_their_messages(tmp_path: Path) -> None:
    read = read_log(write_log(tmp_path / "a.mcap", _flight(), Writing(timesync=False, late_ms=8.0)))
    assert np.median(read.data.sticks.at_s - 100.0 - _flight().sticks.at_s) == pytest.approx(0.008, abs=1e-5)
    assert read.clock.sigma_s >= 0.005


def test_a_jump_of_the_estimate_begins_another_track(tmp_path: Path) -> None:
    read = read_log(write_log(tmp_path / "a.mcap", _flight(), Writing(reset_at=200)))
    assert [len(track) for track in read.data.tracks][1:] == [len(_flight().tracks[0]) - 200]
    assert len(read.data.tracks) == 2


def test_the_centre_of_mass_moves_where_the_marker_lies_off_it(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", _flight(), Writing())
    plain = read_log(path)
    sheet = plain.vehicle.model_copy(update={"centre_of_mass_mm": (10.0, 0.0, -20.0)})
    moved = read_log(path, sheet)
    offset = plain.data.tracks[0].R_BtoW @ np.array([0.01, 0.0, -0.02])
    assert moved.data.tracks[0].p_inW - plain.data.tracks[0].p_inW == pytest.approx(offset, abs=1e-12)


@pytest.mark.parametrize(
    ("writing", "complaint"),
    [
        (Writing(servos=False), "holds no SERVO_OUTPUT_RAW"),
        (Writing(sheet=False), "holds no [vehicle] sheet; give --config"),
    ],
)
def test_a_log_that_cannot_be_used_is_one_line_with_a_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], writing: Writing, complaint: str
) -> None:
    path = write_log(tmp_path / "a.mcap", _flight(), writing)
    assert run_command_line(["sysid", str(path)]) == EXIT_OPERATOR
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1


def test_too_short_a_flight_is_refused(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", _short(), Writing())
    with pytest.raises(
        OperatorError, match=r"s in the air with servos and poses, at least 15 s are needed; fly a plan"
    ):
        read_log(path)


def test_a_servo_that_is_not_told_of_is_named(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", _flight(), Writing())
    sheet = read_log(path).vehicle
    servos = tuple(servo.model_copy(update={"channel": servo.channel + 4}) for servo in sheet.servos)
    with pytest.raises(OperatorError, match=r"says nothing of servo5_raw"):
        read_log(path, sheet.model_copy(update={"servos": servos}))


def test_a_config_lends_its_sheet_to_a_log_without(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", _flight(), Writing(sheet=False))
    sheet = read_log(write_log(tmp_path / "b.mcap", _flight(), Writing())).vehicle
    assert read_log(path, sheet).data.duration_s > 15.0

"""What a sender of poses can do wrong: the simulated autopilot suffers from it as ArduPilot does (docs/sitl.md)."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import pytest

from bridge.settings import load_settings
from tools.sitl.mistakes import MISTAKES, Mistake
from tools.sitl.trial import Trial, attempt

AS_EVER_MM = 50.0
"""An error of its own position that shows no mistake."""


@cache
def tried(name: str) -> Trial:
    """Try one mistake on the simulated autopilot."""
    return attempt(named(name), load_settings("lab"), None, Path("unused"))


def named(name: str) -> Mistake:
    (mistake,) = (each for each in MISTAKES if each.name == name)
    return mistake


def test_without_a_mistake_it_knows_where_it_is() -> None:
    trial = tried("none")
    assert trial.ekf_error_mm < AS_EVER_MM
    assert not trial.lost_position


def test_two_seconds_of_silence_are_borne_and_the_height_is_the_barometers_meanwhile() -> None:
    trial = tried("silence of 2 s")
    assert trial.ekf_error_mm > 2.0 * tried("none").ekf_error_mm
    assert not trial.lost_position
    assert not trial.landed


def test_after_seven_seconds_of_silence_the_position_is_lost_and_it_lands() -> None:
    trial = tried("silence of 10 s")
    assert trial.lost_position
    assert trial.landed


def test_a_pose_repeated_under_fresh_stamps_carries_it_away_by_metres() -> None:
    assert tried("the last pose repeated for 3 s, stamps fresh").ekf_error_mm > 1000.0


def test_outliers_stay_outside_the_gate() -> None:
    trial = tried("one pose in twenty 5 m off, 10 s")
    assert trial.worst_ratio > 1.0
    assert trial.ekf_error_mm < AS_EVER_MM


def test_a_told_jump_is_followed_at_once_and_an_untold_one_is_not() -> None:
    told, untold = tried("3 m jump for 5 s, told by reset_counter"), tried("3 m jump for 5 s, not told")
    assert told.ekf_error_mm == pytest.approx(3000.0, abs=AS_EVER_MM)
    assert told.worst_ratio < 0.5
    assert untold.ekf_error_mm < AS_EVER_MM
    assert untold.worst_ratio > 1.0


def test_counters_that_fight_carry_it_off_its_path_though_it_knows_where_it_is() -> None:
    trial = tried("two pose messages, reset_counter 1 in one, 5 s")
    assert trial.off_path_mm > 2.0 * tried("none").off_path_mm
    assert trial.ekf_error_mm < 2.0 * AS_EVER_MM
    assert trial.worst_ratio < 0.5


def test_a_variance_that_is_not_a_number_is_an_internal_error_unless_it_is_the_first() -> None:
    assert "Internal Errors 0x400" in tried("variance of y alone not a number, 5 s").texts
    assert tried("variance of x not a number, 5 s").texts == ()


def test_poses_much_older_than_told_make_it_err_by_a_third_of_a_metre_and_more() -> None:
    assert tried("poses 400 ms older than VISO_DELAY_MS").ekf_error_mm > 300.0


@pytest.mark.sitl
@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_the_simulated_autopilot_is_no_kinder_than_ardupilots_own_program(mistake: Mistake, tmp_path: Path) -> None:
    """Two vehicles differ: a factor of four in the error is the same story. The fail-safe acts on both or neither."""
    real = attempt(mistake, load_settings("lab"), Path(os.environ["ARDUPILOT_SITL"]), tmp_path)
    own = tried(mistake.name)
    assert not real.grounded
    assert own.ekf_error_mm + AS_EVER_MM > real.ekf_error_mm / 4.0
    assert own.landed == real.landed
    assert own.lost_position or own.landed or not real.lost_position

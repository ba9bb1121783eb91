"""The delay found in a wiggle, against wiggles whose delay is known."""

from __future__ import annotations

import numpy as np
import pytest

from bridge.preflight.delay import Delay, TooLittle, find_delay
from tests.bridge.preflight.wiggles import Wiggle, wiggle
from tracker.maths import so3


def found(made: Wiggle) -> Delay | TooLittle:
    return find_delay(made.pose_t_ns, made.R_FtoN, made.gyro_t_ns, made.w_G)


def surely(made: Wiggle) -> Delay:
    delay = found(made)
    assert isinstance(delay, Delay), delay
    return delay


@pytest.mark.parametrize("late_s", [-0.05, 0.0, 0.0123, 0.08, 0.25])
def test_the_delay_is_found_to_a_fraction_of_a_sample(late_s: float) -> None:
    delay = surely(wiggle(1, late_s))
    assert abs(delay.late_s - late_s) < 4.0 * delay.sigma_s
    assert delay.sigma_s < 0.002  # poses come every 33 ms, gyro readings every 20 ms


def test_without_noise_the_delay_is_exact() -> None:
    made = wiggle(2, 0.0371, attitude_sigma=0.0, gyro_sigma=0.0, gyro_hz=200.0)
    assert surely(made).late_s == pytest.approx(0.0371, abs=2e-4)


def test_the_standard_error_is_true() -> None:
    """60 wiggles: errors over their sigmas have a mean square of 1; four sigma of that mean square are 4 sqrt(2/60)."""
    ratios = []
    for seed in range(60):
        delay = surely(wiggle(100 + seed, 0.03))
        ratios.append((delay.late_s - 0.03) / delay.sigma_s)
    mean_square = float(np.mean(np.square(ratios)))
    assert abs(mean_square - 1.0) < 4.0 * np.sqrt(2.0 / 60.0)


def test_axes_turned_against_the_autopilots_are_seen_and_do_not_spoil_the_delay() -> None:
    R_GtoF = so3.from_euler(0.0, 0.0, np.radians(90.0))
    delay = surely(wiggle(3, 0.02, R_GtoF=R_GtoF))
    assert abs(delay.late_s - 0.02) < 4.0 * delay.sigma_s
    assert delay.R_GtoF is not None
    np.testing.assert_allclose(delay.R_GtoF, R_GtoF, atol=0.03)
    assert delay.turned_deg == pytest.approx(90.0, abs=1.0)


def test_turning_about_one_axis_only_gives_the_delay_but_not_the_axes() -> None:
    delay = surely(wiggle(4, 0.04, axes=(0.0, 0.0, 1.0), attitude_sigma=0.001, gyro_sigma=0.002))
    assert abs(delay.late_s - 0.04) < 4.0 * delay.sigma_s + 1e-3
    assert delay.R_GtoF is None
    assert delay.turned_deg is None


@pytest.mark.parametrize(
    ("made", "why"),
    [
        (wiggle(5, 0.0, size=0.01), "wiggle more briskly"),
        (wiggle(6, 0.7), "agree"),
        (wiggle(7, 0.0, duration_s=1.0), "too short|are needed"),
        (Wiggle([], [], [], []), "are needed"),
        (wiggle(8, 0.0, duration_s=2.5, size=0.2, attitude_sigma=0.03), "uncertain|agree"),
    ],
    ids=["hardly moved", "too late", "too short", "nothing", "too noisy"],
)
def test_too_little_to_go_by_is_refused_with_a_reason(made: Wiggle, why: str) -> None:
    refused = found(made)
    assert isinstance(refused, TooLittle)
    assert any(each in refused.why for each in why.split("|")), refused.why


def test_another_vehicles_gyro_is_refused() -> None:
    mine, other = wiggle(9, 0.0), wiggle(10, 0.0)
    assert isinstance(found(Wiggle(mine.pose_t_ns, mine.R_FtoN, other.gyro_t_ns, other.w_G)), TooLittle)


def test_poses_missing_for_a_while_do_not_matter() -> None:
    made = wiggle(11, 0.05)
    kept = [k for k in range(len(made.pose_t_ns)) if not 100 < k < 140]
    delay = find_delay([made.pose_t_ns[k] for k in kept], [made.R_FtoN[k] for k in kept], made.gyro_t_ns, made.w_G)
    assert isinstance(delay, Delay)
    assert abs(delay.late_s - 0.05) < 4.0 * delay.sigma_s

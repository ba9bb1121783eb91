"""Samples onto a grid: exact where they can be, empty where they must be, and without aliases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tools.export.resample import ABSENT, FILLED, SHORTENED, Layout, Resampled, Spacing, Times, resample
from tracker.types import Array

MS, S = 1_000_000, 1_000_000_000
PERIOD_NS = 33_333_333
PLAIN = Layout()


def jittered(count: int, seed: int = 0, sigma_ns: float = 1e6) -> Times:
    steps = np.random.default_rng(seed).normal(PERIOD_NS, sigma_ns, count)
    return np.cumsum(np.maximum(np.rint(steps), 1)).astype(np.int64)


def to_grid(
    t_ns: Times, samples: Array, rate_hz: float, layout: Layout = PLAIN, gap_ns: int = 100 * MS
) -> tuple[Times, Resampled]:
    step_ns = 1e9 / rate_hz
    first, last = int(np.ceil(t_ns[0] / step_ns)), int(t_ns[-1] / step_ns)
    grid_ns = np.rint(np.arange(first, last + 1) * step_ns).astype(np.int64)
    joined = np.ones(len(t_ns), np.bool_)
    return grid_ns, resample(t_ns, samples, joined, grid_ns, layout, Spacing(PERIOD_NS, gap_ns, step_ns))


@given(st.integers(0, 1000), st.floats(-5, 5), st.floats(-5, 5), st.sampled_from([3.0, 7.0, 10.0, 30.0, 100.0]))
@settings(deadline=None, max_examples=25)
def test_a_straight_line_comes_out_as_it_was_at_any_rate(seed: int, level: float, slope: float, rate_hz: float) -> None:
    """Right up to both ends: a filter cut on one side only would pull them towards the middle."""
    t_ns = jittered(200, seed)
    grid_ns, found = to_grid(t_ns, level + slope * (t_ns[:, None] / S), rate_hz)
    np.testing.assert_allclose(found.values[:, 0], level + slope * grid_ns / S, atol=1e-6)


@pytest.mark.parametrize("frequency_hz", [6.0, 9.0, 13.0, 14.5])
def test_what_is_faster_than_half_the_output_rate_does_not_come_back_as_something_slower(frequency_hz: float) -> None:
    t_ns = jittered(1500, sigma_ns=0.0)
    _, found = to_grid(t_ns, np.sin(2 * np.pi * frequency_hz * t_ns / S)[:, None], 10.0)
    whole = found.values[found.flags == 0, 0]
    assert len(whole) > 400
    assert np.abs(whole).max() < 3e-3


@pytest.mark.parametrize("frequency_hz", [0.2, 1.0, 2.0])
def test_what_is_slow_passes_without_delay(frequency_hz: float) -> None:
    t_ns = jittered(1500)
    grid_ns, found = to_grid(t_ns, np.sin(2 * np.pi * frequency_hz * t_ns / S)[:, None], 10.0)
    phasor = np.mean(found.values[20:-20, 0] * np.exp(-2j * np.pi * frequency_hz * grid_ns[20:-20] / S)) * 2j
    assert abs(phasor) == pytest.approx(1.0, abs=0.03)
    assert np.angle(phasor) == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("rate_hz", [10.0, 100.0])
def test_a_gap_longer_than_the_limit_stays_empty_and_a_shorter_one_is_filled_and_marked(rate_hz: float) -> None:
    t_ns = np.arange(300, dtype=np.int64) * PERIOD_NS
    keep = np.ones(300, np.bool_)
    keep[100:102] = False  # three periods
    keep[200:230] = False  # a second
    grid_ns, found = to_grid(t_ns[keep], t_ns[keep, None] / S, rate_hz, gap_ns=110 * MS)
    in_short = (grid_ns > t_ns[99]) & (grid_ns < t_ns[102])
    in_long = (grid_ns > t_ns[199]) & (grid_ns < t_ns[230])
    assert in_short.any()
    assert (found.flags[in_short] & FILLED).all()
    assert (found.flags[in_long] == ABSENT).all()
    assert np.isnan(found.values[in_long]).all()
    assert np.isfinite(found.values[~in_long]).all()
    assert not (found.flags[~in_short & ~in_long] & FILLED).any()
    if rate_hz == 10.0:
        beside = (grid_ns > t_ns[199] - 300 * MS) & (grid_ns <= t_ns[199])
        assert (found.flags[beside] & SHORTENED).all()


def test_nothing_is_drawn_across_a_jump_of_the_estimate() -> None:
    t_ns = np.arange(100, dtype=np.int64) * PERIOD_NS
    samples = np.where(np.arange(100) < 50, 0.0, 1.0)[:, None]
    joined = np.arange(100) != 50
    for step_ns in (1e7, 1e8):
        grid_ns = np.rint(np.arange(int(t_ns[-1] / step_ns)) * step_ns).astype(np.int64)
        found = resample(t_ns, samples, joined, grid_ns, PLAIN, Spacing(PERIOD_NS, 100 * MS, step_ns))
        values = found.values[:, 0]
        assert set(np.round(values[np.isfinite(values)], 9)) == {0.0, 1.0}


@pytest.mark.parametrize("rate_hz", [5.0, 10.0, 100.0])
def test_a_steady_turn_stays_a_steady_turn_through_either_sign_of_its_quaternion(rate_hz: float) -> None:
    t_ns = jittered(600)
    q = Rotation.from_rotvec(np.outer(t_ns / S, [0.3, -0.5, 1.0])).as_quat(scalar_first=True)
    q *= np.where(np.random.default_rng(1).random(len(q)) < 0.5, -1.0, 1.0)[:, None]
    grid_ns, found = to_grid(t_ns, q, rate_hz, Layout(quaternion=0))
    np.testing.assert_allclose(np.linalg.norm(found.values, axis=1), 1.0, atol=1e-12)
    truth = Rotation.from_rotvec(np.outer(grid_ns / S, [0.3, -0.5, 1.0]))
    error = (truth.inv() * Rotation.from_quat(found.values, scalar_first=True)).magnitude()
    assert error.max() < 1e-4


@pytest.mark.parametrize("rate_hz", [10.0, 100.0])
def test_a_held_value_is_always_one_that_was_there(rate_hz: float) -> None:
    t_ns = jittered(300)
    grid_ns, found = to_grid(t_ns, (np.arange(300) // 7 % 5).astype(np.float64)[:, None], rate_hz, Layout(held=(0,)))
    before = np.searchsorted(t_ns, grid_ns, side="right") - 1
    np.testing.assert_array_equal(found.values[:, 0], before // 7 % 5)


def test_pieces_of_the_grid_are_the_same_as_the_whole() -> None:
    t_ns = jittered(600)
    samples = np.random.default_rng(2).normal(size=(600, 2))
    grid_ns, whole = to_grid(t_ns, samples, 10.0)
    spacing, joined = Spacing(PERIOD_NS, 100 * MS, 1e8), np.ones(600, np.bool_)
    pieces = [resample(t_ns, samples, joined, grid_ns[k : k + 40], PLAIN, spacing) for k in range(0, len(grid_ns), 40)]
    np.testing.assert_allclose(np.concatenate([piece.values for piece in pieces]), whole.values, atol=1e-12)
    np.testing.assert_array_equal(np.concatenate([piece.flags for piece in pieces]), whole.flags)

"""Percentiles of any number of durations from a table that does not grow."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.histogram import BINS_PER_DECADE, LEAST_NS, Histogram
from bridge.summary import NO_SAMPLES

HALF_BIN = 10 ** (0.5 / BINS_PER_DECADE)


def of(*durations_ns: int) -> Histogram:
    histogram = Histogram()
    for duration_ns in durations_ns:
        histogram.add(duration_ns)
    return histogram


def test_without_samples_nothing_is_known() -> None:
    assert Histogram().percentiles() is NO_SAMPLES


def test_one_sample_is_every_percentile() -> None:
    spread = of(12_345_678).percentiles()
    assert spread.count == 1
    assert spread.max == 12.345678
    assert {spread.p50, spread.p95, spread.p99} <= {spread.p50}
    assert spread.p50 == pytest.approx(12.345678, rel=HALF_BIN - 1.0)


@given(st.lists(st.integers(LEAST_NS, 50_000_000_000), min_size=1, max_size=200))
def test_each_percentile_is_a_sample_within_half_a_bin(durations_ns: list[int]) -> None:
    spread = of(*durations_ns).percentiles()
    ordered = sorted(durations_ns)
    for share, value in ((0.5, spread.p50), (0.95, spread.p95), (0.99, spread.p99)):
        assert value is not None
        true_ms = ordered[math.ceil(share * len(ordered)) - 1] / 1e6
        assert true_ms / HALF_BIN * (1 - 1e-9) <= value <= true_ms * HALF_BIN * (1 + 1e-9)
    assert spread.max == max(durations_ns) / 1e6
    values = [value for value in (spread.p50, spread.p95, spread.p99, spread.max) if value is not None]
    assert values == sorted(values)


def test_a_hundred_samples_leave_one_above_the_99th_percentile() -> None:
    spread = of(*[1_000_000] * 99, 500_000_000).percentiles()
    assert spread.p99 == pytest.approx(1.0, rel=0.01)
    assert spread.max == 500.0


@pytest.mark.parametrize("duration_ns", [-5_000, 0, 1, 999, 10**12, 10**15])
def test_a_duration_off_the_table_counts_all_the_same(duration_ns: int) -> None:
    spread = of(duration_ns, 1_000_000, 1_000_000).percentiles()
    assert spread.count == 3
    assert spread.p50 == pytest.approx(1.0, rel=0.01)
    assert spread.max == max(duration_ns, 1_000_000) / 1e6


def test_the_table_does_not_grow() -> None:
    rng = np.random.default_rng(1)
    histogram = Histogram()
    size = len(histogram._bins)
    for duration_ns in (10 ** rng.uniform(2, 13, 5000)).astype(int).tolist():
        histogram.add(duration_ns)
    assert len(histogram._bins) == size < 2000

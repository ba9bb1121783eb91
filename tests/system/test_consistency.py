"""The filter's own figures of its errors against the truth, over many flights through rendered cameras."""

from __future__ import annotations

import numpy as np
import pytest

from tools.bench.consistency import Consistency, average, measure_consistency

SEEDS = 25
PARTS = ("position", "attitude", "velocity", "rate")


@pytest.fixture(scope="module", params=[1.0, 2.2], ids=["linear", "gamma-2.2"])
def result(request: pytest.FixtureRequest) -> Consistency:
    return measure_consistency(SEEDS, request.param)


@pytest.mark.parametrize("part", PARTS)
def test_errors_are_no_larger_than_the_covariance_says(result: Consistency, part: str) -> None:
    assert result.nees[part].mean <= result.nees[part].band[1], result.nees[part]


@pytest.mark.parametrize("part", ["attitude", "rate"])
def test_what_turns_errs_as_much_as_the_covariance_says(result: Consistency, part: str) -> None:
    assert result.nees[part].honest, result.nees[part]


def test_innovations_are_as_large_as_the_filter_expects(result: Consistency) -> None:
    assert result.nis.honest, result.nis


def test_every_instant_has_an_estimate_and_none_is_wrong(result: Consistency) -> None:
    assert result.missing == 0
    assert result.wrong == 0


def test_a_band_holds_the_averages_of_honest_errors_as_often_as_it_says() -> None:
    """19 of 20, within four sigma for 400 draws."""
    rng = np.random.default_rng(1)
    inside = sum(average(rng.chisquare(3.0, 150), np.full(150, 3.0)).honest for _ in range(400))
    assert abs(inside - 380) <= 4.0 * np.sqrt(400 * 0.05 * 0.95)


def test_a_filter_that_is_a_fifth_too_sure_is_found_out() -> None:
    rng = np.random.default_rng(2)
    errors = average(rng.chisquare(3.0, 150) * 1.2**2, np.full(150, 3.0))
    assert not errors.honest
    assert errors.mean > errors.band[1]

"""The usual round in one call: what gate and fit find one after the other, and nothing where there is a choice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.rigs import PROCESS, covariance, ring_rig, sightings, state
from tracker.filter.at_once import fit_at_once
from tracker.filter.batch import Sighted, make_batch, sighted
from tracker.filter.fit import Fit, fit
from tracker.filter.predict import Prediction, predict
from tracker.types import BallSighting

RIG = ring_rig(2)
SIGMA_PX, GATE = 0.1, 0.999
PERIOD_NS, APART_NS = 33_333_333, 5_000_000
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (1.0, -0.5, 0.3), (0.4, -0.8, 1.5))


def ahead() -> Prediction:
    return predict(FLYING, PERIOD_NS, PROCESS)


def seen(seed: int) -> tuple[BallSighting, ...]:
    views = [(0, PERIOD_NS), (1, PERIOD_NS + APART_NS)]
    return sightings(FLYING, RIG, views, SIGMA_PX, np.random.default_rng(seed))


def at_once(prediction: Prediction, balls: tuple[BallSighting, ...]) -> Fit | None:
    return fit_at_once(prediction, sighted(balls, PERIOD_NS), RIG, GATE)


@pytest.mark.parametrize("seed", range(5))
def test_one_call_gives_to_the_last_bit_what_gate_and_fit_give_one_after_the_other(seed: int) -> None:
    of: Sighted = sighted(seen(seed), PERIOD_NS)
    whole, stepwise = fit_at_once(ahead(), of, RIG, GATE), fit(ahead(), make_batch(ahead(), of, RIG), RIG)
    assert whole is not None
    assert stepwise is not None
    assert whole.sighted is stepwise.sighted
    for name, part, other in zip(Fit._fields[1:], whole[1:], stepwise[1:], strict=True):
        assert np.array_equal(np.asarray(part), np.asarray(other)), name


def test_a_sighting_beyond_its_gate_leaves_the_choice_open() -> None:
    good, *others = seen(1)
    assert at_once(ahead(), (good._replace(uv_px=good.uv_px + 400.0), *others)) is None


def test_sightings_that_contradict_each_other_within_their_gates_leave_the_choice_open() -> None:
    good, *others = seen(1)
    broad = predict(replace(FLYING, P=covariance(0.05, 0.3, 2.5, 1.6)), PERIOD_NS, PROCESS)
    lying = (good._replace(uv_px=good.uv_px + 3.0), *others)
    assert max(make_batch(broad, sighted(lying, PERIOD_NS), RIG).distances2()) < 13.8
    assert at_once(broad, lying) is None


def test_a_turn_that_two_balls_do_not_show_leaves_the_choice_open() -> None:
    two = tuple(one for one in seen(1) if one.ball != 0)
    broad = predict(replace(FLYING, P=covariance(0.002, 0.3, 0.1, 0.5)), PERIOD_NS, PROCESS)
    assert at_once(broad, two) is None

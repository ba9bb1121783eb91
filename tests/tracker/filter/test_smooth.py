"""Looking back over some updates: exact where it can be, and never less sure than what was known at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.rigs import PROCESS, at, difference, ring_rig, sightings, state
from tracker.filter.ekf import Update, update
from tracker.filter.history import History
from tracker.filter.matern import carried
from tracker.filter.predict import first_guess, predict
from tracker.filter.smooth import smoothed
from tracker.state import RATE, REPORTED, VELOCITY, State
from tracker.types import Array, Rejected

RIG = ring_rig(2)
PERIOD_NS = 66_666_667
GATE, SIGMA_PX = 0.999, 0.05
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (0.6, -0.4, 0.2), (0.3, -0.2, 0.8))


def flight(rounds: int, seed: int, *, turns: bool = False) -> tuple[list[State], list[Update]]:
    """Return the truth of some rounds and the updates by what two cameras see; turns: one after the other."""
    rng, truths, updates = np.random.default_rng(seed), [FLYING], list[Update]()
    ahead = first_guess(FLYING, PROCESS)
    for k in range(rounds):
        t_ns = k * PERIOD_NS
        if k:
            truths.append(at(FLYING, t_ns))
            ahead = predict(updates[-1].state, t_ns, PROCESS)
        looking = (k % 2,) if turns and k else (0, 1)
        found = update(ahead, sightings(truths[-1], RIG, [(c, t_ns) for c in looking], SIGMA_PX, rng), RIG, GATE)
        assert not isinstance(found, Rejected)
        updates.append(found)
    return truths, updates


def without_noise(updates: list[Update]) -> list[Update]:
    """Return two updates as if nothing had driven the vehicle between them."""
    before, after = updates[:2]
    size = len(before.state.P)
    mean, F = carried(before.state.mean, PERIOD_NS * 1e-9, before.state.manoeuvre_s, size)
    P_ahead = F @ before.state.P @ F.T
    H = np.eye(size)[:3]
    gain = P_ahead @ H.T @ np.linalg.inv(H @ P_ahead @ H.T + 1e-8 * np.eye(3))
    step = gain @ np.array([1e-4, -2e-4, 1e-4])
    later = replace(after.state, mean=mean, P=P_ahead - gain @ H @ P_ahead).moved(step)
    return [before, after._replace(state=later, P_ahead=P_ahead)]


def test_what_nothing_drives_is_carried_on_to_just_where_it_was_found_later() -> None:
    before, after = without_noise(flight(2, 1)[1])
    back = smoothed([before, after])
    size = len(back.P)
    mean, F = carried(back.mean, PERIOD_NS * 1e-9, back.manoeuvre_s, size)
    sigma = np.sqrt(np.diag(after.state.P))
    off = replace(back, mean=mean).error_to(after.state)
    assert np.abs(off / np.where(sigma > 0.0, sigma, 1.0)).max() < 1e-2
    both = np.outer(sigma, sigma)
    assert np.abs((F @ back.P @ F.T - after.state.P)[both > 0.0] / both[both > 0.0]).max() < 1e-4


def test_the_last_state_is_as_it_was() -> None:
    _, updates = flight(3, 2)
    assert smoothed(updates[-1:]) is updates[-1].state


def test_a_state_that_none_was_predicted_from_is_as_it_was() -> None:
    _, (before, after) = flight(2, 3)
    assert smoothed([before, after._replace(P_ahead=None)]) is before.state


def test_the_first_update_of_a_track_tells_nothing_of_what_was_before() -> None:
    _, updates = flight(2, 4)
    assert updates[0].P_ahead is None
    assert updates[1].P_ahead is not None


def test_what_a_straggler_adds_to_its_instant_is_not_forgotten() -> None:
    _, (first, second, third) = flight(3, 6)
    straggler = second._replace(state=replace(second.state, P=second.state.P / 2.0), P_ahead=None)
    history = History(lag_rounds=1)
    for one in (first, second, straggler, third):
        history.remember(one)
    assert history.since(second.state.t_ns) == [straggler, third]
    assert history.since(second.state.t_ns + 1) == []
    assert history.since(first.state.t_ns - 1) == []


def sigmas(one: State) -> Array:
    return np.sqrt(np.diag(one.P)[:REPORTED])


@pytest.mark.parametrize("turns", [False, True], ids=["together", "in-turn"])
def test_what_comes_later_leaves_no_part_less_sure(turns: bool) -> None:
    _, updates = flight(12, 5, turns=turns)
    for k in range(len(updates) - 1):
        more, less = sigmas(smoothed(updates[k : k + 2])), sigmas(updates[k].state)
        assert (more <= less * (1.0 + 1e-6)).all(), k


def errors(flights: int, lag: int, *, turns: bool) -> tuple[Array, Array]:
    """Return errors (n, 12) and sigmas (n, 12) of the states of some flights, so many rounds late."""
    found, said = [], []
    for seed in range(flights):
        truths, updates = flight(16, 100 + seed, turns=turns)
        for k in range(6, 14):
            one = smoothed(updates[k : k + 1 + lag])
            found.append(difference(truths[k], one)[:REPORTED])
            said.append(sigmas(one))
    return np.array(found), np.array(said)


def test_speeds_and_rates_err_less_than_half_as_much_a_round_late() -> None:
    (at_once, _), (late, _) = (errors(6, lag, turns=False) for lag in (0, 1))
    for part in (VELOCITY, RATE):
        assert np.square(late[:, part]).mean() < np.square(at_once[:, part]).mean() / 4.0


def test_cameras_that_look_in_turn_err_less_than_half_as_much_a_round_late() -> None:
    (at_once, _), (late, _) = (errors(6, lag, turns=True) for lag in (0, 1))
    assert np.square(late[:, :3]).mean() < np.square(at_once[:, :3]).mean() / 4.0


@pytest.mark.parametrize("lag", [1, 3])
def test_what_is_said_of_the_errors_is_no_less_than_they_are(lag: int) -> None:
    found, said = errors(6, lag, turns=True)
    assert (np.square(found / said).mean(axis=0) < 1.6).all()

"""The noise model of residuals, a track's first ones among them."""

from __future__ import annotations

import numpy as np

from tests.tools.sysid.synthetic import Conditions, fly, truth
from tools.simulate.helicopter import Helicopter
from tools.sysid import noise
from tools.sysid.fit import fit_starts
from tools.sysid.flight_data import FlightData
from tools.sysid.response import START_SIGMA, Unknowns, all_residuals, first_states
from tracker.types import Array

TRACKS, COUNT, STAYS = 400, 30, 0.9


def test_residuals_are_unit_noise_from_the_first_on() -> None:
    unit = noise.fitted(rows := _coloured()).whitened
    left = np.stack([unit(each) for each in rows])
    assert left.shape == (TRACKS, COUNT, 2)
    power = (left**2).mean(axis=0)
    assert np.abs(power - 1.0).max() < 5.0 * np.sqrt(2.0 / TRACKS)
    assert np.abs((left[:, 1:] * left[:, :-1]).mean(axis=0)).max() < 5.0 / np.sqrt(TRACKS)


def test_a_tracks_first_rates_are_held_by_its_first_residuals() -> None:
    """They are forgotten within 0.2 s: a noise model that leaves the first residuals out lets them be anything."""
    data = fly(Conditions(sweep_s=4.0))
    theta = truth(Helicopter())
    model = noise.fitted(all_residuals(Unknowns(theta, first_states(data)), data))
    late = FlightData((data.tracks[0].part(150, 400),), data.sticks)
    found = fit_starts(theta, late, model)
    first_deg = np.degrees(np.abs(all_residuals(found, late)[0][0, 3:]))
    assert first_deg.max() < 1.0
    assert np.abs(found.starts[0, 6:9]).max() < START_SIGMA[6]


def _coloured() -> list[Array]:
    """Return stationary noise (COUNT, 2) of many tracks that keeps STAYS of itself from one to the next."""
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(COUNT, TRACKS, 2))
    for k in range(1, COUNT):
        rows[k] = STAYS * rows[k - 1] + np.sqrt(1.0 - STAYS**2) * rows[k]
    return list(np.swapaxes(rows, 0, 1) * [2.0, 0.5])

"""Parameters found again from flights of the simulated helicopter without cameras."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tools.sysid.synthetic import Conditions, fly, truth
from tools.simulate.helicopter import Helicopter
from tools.sysid.certainty import certainty
from tools.sysid.fit import fit
from tools.sysid.frequency import bode
from tools.sysid.identify import identify
from tools.sysid.parameters import AXES, COUNT, INDEX
from tools.sysid.start import starting_point
from tracker.errors import OperatorError

_SHORT = Conditions(sweep_s=4.0)


def test_the_truth_lies_within_two_standard_errors_as_often_as_it_should() -> None:
    """Chance alone counts, nothing for the model: 5 flights of 20 parameters give 100 cases, 95 % of them expected.

    The parameters of one flight go together, so the band is wide: 86 of 100.
    """
    within = []
    for seed in range(5):
        data = fly(replace(_SHORT, seed=seed))
        found = fit(starting_point(data), data)
        error = found.unknowns.theta - truth(Helicopter())
        within.append(np.abs(error) < 2.0 * certainty(found, 0.0, 0.0).chance)
    assert np.mean(within) >= 0.86


def test_another_helicopter_with_slow_servos_is_found_as_well() -> None:
    """A slow stabiliser and more damping; its servos obey 40 ms late."""
    other = replace(Helicopter(), tilt_damping_n_m_s=1.4e-3, rotor_lag_s=0.12, drag_n_s_m=0.08, collective_share=0.4)
    data = fly(replace(_SHORT, seed=3, delay_ticks=2, sigma_rad=0.002), other)
    found = fit(starting_point(data), data)
    error = np.abs(found.unknowns.theta - truth(other, delay_s=0.04))
    assert (error < 4.0 * certainty(found, 0.0, 0.0).total).all()
    assert error[INDEX["delay"]] < 0.004


def test_equation_error_comes_within_a_factor_of_three() -> None:
    data = fly(_SHORT)
    start, true = starting_point(data), truth(Helicopter())
    certain = slice(0, INDEX["delay"])
    assert np.abs(np.log(start[certain] / true[certain])).max() < np.log(3.0)


def test_coherence_is_high_where_the_stick_moves_the_vehicle() -> None:
    data = fly(_SHORT)
    assert all(bode(axis, truth(Helicopter()), data).heard > 0.8 for axis in AXES)


def test_a_flight_without_excitation_is_refused_in_one_line() -> None:
    data = fly(replace(_SHORT, size=0.0, gust_m_s=0.2))
    with pytest.raises(OperatorError, match=r"coherence 0\.\d+, at least 0\.6 is needed; fly a plan of"):
        identify(data, 0.0, 0.002)


def test_uncertainty_grows_by_what_is_known_of_clock_and_pulses() -> None:
    data = fly(_SHORT)
    found = fit(truth(Helicopter()), data)
    sharp, blunt = certainty(found, 0.0, 0.0), certainty(found, 0.01, 0.1)
    assert blunt.total[INDEX["delay"]] == pytest.approx(np.hypot(sharp.total[INDEX["delay"]], 0.01))
    assert blunt.total[INDEX["yaw_trim"]] == pytest.approx(np.hypot(sharp.total[INDEX["yaw_trim"]], 0.1 / 12**0.5))
    assert (sharp.chance >= sharp.bound).all()
    assert sharp.correlation.shape == (COUNT, COUNT)

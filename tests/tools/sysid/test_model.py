"""The hover model: steady states, agreement with the simulated helicopter, its linear form, its derivatives."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.tools.sysid.synthetic import Conditions, fly, truth
from tools.simulate.dynamics import GRAVITY
from tools.simulate.helicopter import Helicopter, full_climb_m_s, full_tilt, full_yaw_rate
from tools.sysid import noise
from tools.sysid.fit import _derivatives
from tools.sysid.flight_data import FlightData, Track, make_sticks
from tools.sysid.frequency import transfer
from tools.sysid.parameters import AXES, INDEX, Axis
from tools.sysid.response import Unknowns, all_residuals, first_states, respond
from tracker.maths import so3
from tracker.types import Array

_RATE_HZ = 50.0


def _still(duration_s: float) -> Track:
    """Return a track whose only use is its times."""
    t_s = np.arange(0.0, duration_s, 1.0 / _RATE_HZ)
    count = len(t_s)
    return Track(t_s, np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)), np.ones((count, 6)))


def _untrimmed() -> Array:
    theta = truth(Helicopter())
    theta[14:] = 0.0
    return theta


def _step(axis: Axis, size: float, duration_s: float = 8.0) -> tuple[Array, Array]:
    """Return the velocities and the attitudes that a held stick comes to."""
    held = np.zeros((1, 4))
    held[0, AXES.index(axis)] = size
    answer = respond(_untrimmed(), np.zeros(12), _still(duration_s), make_sticks(np.array([-1.0]), held))
    return answer.velocity, answer.R_BtoW


def test_full_cyclic_tilts_as_far_as_the_helicopter_does() -> None:
    for axis, sign in ((Axis.ROLL, 1.0), (Axis.PITCH, 1.0)):
        _, attitude = _step(axis, sign)
        roll, pitch, _ = so3.to_euler(attitude[-1])
        assert (roll if axis is Axis.ROLL else pitch) == pytest.approx(full_tilt(Helicopter()), rel=1e-4)


def test_yaw_and_climb_settle_at_the_helicopters_own_rates() -> None:
    _, attitude = _step(Axis.YAW, 1.0)
    turned = so3.log(attitude[-2].T @ attitude[-1])[2] * _RATE_HZ
    assert turned == pytest.approx(full_yaw_rate(Helicopter()), rel=1e-4)
    velocity, _ = _step(Axis.HEAVE, 1.0)
    assert velocity[-1, 2] == pytest.approx(full_climb_m_s(Helicopter()), rel=1e-3)


def test_a_steady_tilt_flies_as_fast_as_gravity_and_drag_allow() -> None:
    """Along the tilted disc's plane: g sin(tilt) = drag v cos(tilt) for level flight with the lift made up for."""
    velocity, attitude = _step(Axis.PITCH, 0.1, duration_s=12.0)
    tilt = so3.to_euler(attitude[-1])[1]
    assert velocity[-1, 0] == pytest.approx(GRAVITY * math.tan(tilt) / truth(Helicopter())[INDEX["drag"]], rel=0.01)


def test_the_model_follows_the_simulated_helicopter_without_gusts_or_noise() -> None:
    data = fly(Conditions(gust_m_s=0.0, sigma_m=0.0, sigma_rad=0.0, sweep_s=4.0))
    (left,) = all_residuals(Unknowns(truth(Helicopter()), first_states(data)), data)
    settled = left[15:]
    assert np.abs(settled[:, :3]).max() < 0.01
    assert np.abs(settled[:, 3:]).max() < math.radians(0.25)


def test_small_motion_is_the_linear_models() -> None:
    """A sine of 2 % of full stick: the rate's amplitude and phase are the transfer function's."""
    theta, f_hz = _untrimmed(), 1.5
    theta[INDEX["delay"]] = 0.03
    at_s = np.arange(-4.0, 12.0, 0.002)
    for number, axis in enumerate(AXES):
        held = np.zeros((len(at_s), 4))
        held[:, number] = 0.02 * np.sin(2.0 * np.pi * f_hz * (at_s + 0.001))
        track = _still(12.0)
        answer = respond(theta, np.zeros(12), track, make_sticks(at_s, held))
        turns = np.array([so3.log(a.T @ b) for a, b in zip(answer.R_BtoW, answer.R_BtoW[1:], strict=False)]) * _RATE_HZ
        values = answer.velocity[:, 2] if axis is Axis.HEAVE else turns[:, number]
        middle_s = track.t_s[1:] - 0.5 / _RATE_HZ
        late = middle_s > 12.0 - 6.0 / f_hz
        phasor = 2.0 * np.mean(values[late] * np.exp(-2j * np.pi * f_hz * middle_s[late])) / (0.02 / 1j)
        phasor /= np.sinc(f_hz / _RATE_HZ)  # means over a frame are a little smaller
        assert abs(phasor / transfer(axis, theta, np.array([f_hz]))[0] - 1.0) < 0.02


def test_an_answer_comes_by_the_delay_later() -> None:
    theta = _untrimmed()
    track = _still(3.0)
    sticks = make_sticks(np.array([-1.0, 1.0]), np.array([[0.0, 0.0, 0.0, 0.0], [0.3, 0.0, 0.3, 0.3]]))
    prompt = respond(theta, np.zeros(12), track, sticks)
    theta[INDEX["delay"]] = 0.06  # three frames
    late = respond(theta, np.zeros(12), track, sticks)
    assert np.allclose(late.R_BtoW[3:], prompt.R_BtoW[:-3], atol=1e-6)
    assert np.allclose(late.velocity[3:], prompt.velocity[:-3], atol=1e-6)


def test_derivatives_do_not_depend_on_the_step_they_are_taken_with(monkeypatch: pytest.MonkeyPatch) -> None:
    data = fly(Conditions(sweep_s=4.0))
    part = FlightData((data.tracks[0].part(20, 140),), data.sticks)
    unknowns = Unknowns(truth(Helicopter()), first_states(part))
    white = noise.white(np.ones(6))
    (coarse,) = _derivatives(unknowns, part, white)
    monkeypatch.setattr("tools.sysid.fit._STEP", 1e-5)
    (fine,) = _derivatives(unknowns, part, white)
    assert np.allclose(coarse, fine, atol=2e-3 * np.abs(fine).max(axis=(0, 1)).clip(1e-9))

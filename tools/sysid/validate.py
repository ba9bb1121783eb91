"""How good a fitted model is: on flight it has not seen, and by what it leaves over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.sysid.flight_data import FlightData
from tools.sysid.response import respond
from tracker.types import Array

LAGS = 20
"""Lags of the residuals' autocorrelation that are looked at."""

OUTPUTS = ("forward", "left", "up", "roll", "pitch", "yaw")
UNITS = ("m/s", "m/s", "m/s", "deg", "deg", "deg")


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Measured and modelled outputs of a track: t_s (m,); measured, modelled (m, 6), see OUTPUTS and UNITS."""

    t_s: Array
    measured: Array
    modelled: Array


def compare(theta: Array, starts: Array, data: FlightData) -> list[Comparison]:
    """Run the model through each track, with nothing but the sticks and the first state."""
    comparisons = []
    for start, track in zip(starts, data.tracks, strict=True):
        answer = respond(theta, start, track, data.sticks)
        measured = np.hstack((track.velocity(), _angles_deg(track.R_BtoW)[1:]))
        modelled = np.hstack((answer.velocity, _angles_deg(answer.R_BtoW)[1:]))
        comparisons.append(Comparison(track.t_s[1:], measured, modelled))
    return comparisons


def fit_percent(comparisons: list[Comparison]) -> Array:
    """Return 100 (1 - |y - y_hat| / |y - mean y|) of each output (6,): 100 is perfect, 0 no better than the mean."""
    y, y_hat = _stacked(comparisons)
    spread = np.maximum(np.linalg.norm(y - y.mean(axis=0), axis=0), 1e-12)
    return np.asarray(100.0 * (1.0 - np.linalg.norm(y - y_hat, axis=0) / spread))


def theil(comparisons: list[Comparison]) -> Array:
    """Return Theil's inequality coefficient of each output (6,): 0 is perfect, 1 the worst; below 0.3 is good.

    Source: Jategaonkar, 2nd ed. (2015), 11.4.
    """
    y, y_hat = _stacked(comparisons)
    rms = [np.sqrt(np.mean(each**2, axis=0)) for each in (y - y_hat, y, y_hat)]
    return np.asarray(rms[0] / np.maximum(rms[1] + rms[2], 1e-12))


@dataclass(frozen=True, slots=True, eq=False)
class Whiteness:
    """Autocorrelation of the whitened residuals: values (channels, LAGS + 1), and the band that white noise keeps to.

    share: how many of the values after the first lie within, 0..1, expected 0.95.
    """

    values: Array
    band: float

    @property
    def share(self) -> float:
        """Return the share within the band."""
        return float(np.mean(np.abs(self.values[:, 1:]) <= self.band))


def whiteness(left: tuple[Array, ...]) -> Whiteness:
    """Judge the whitened residuals of each track (m, channels)."""
    count = sum(len(each) for each in left)
    values = np.zeros((left[0].shape[1], LAGS + 1))
    for each in left:
        centred = each - each.mean(axis=0)
        for lag in range(LAGS + 1):
            values[:, lag] += (centred[lag:] * centred[: len(centred) - lag]).sum(axis=0)
    return Whiteness(values / values[:, :1], 1.96 / float(np.sqrt(count)))


def _angles_deg(R_BtoW: Array) -> Array:
    """Return roll, pitch and an unwrapped yaw (m, 3) [deg]."""
    roll = np.arctan2(R_BtoW[:, 2, 1], R_BtoW[:, 2, 2])
    pitch = np.arcsin(np.clip(-R_BtoW[:, 2, 0], -1.0, 1.0))
    yaw = np.unwrap(np.arctan2(R_BtoW[:, 1, 0], R_BtoW[:, 0, 0]))
    return np.asarray(np.degrees(np.column_stack((roll, pitch, yaw))))


def _stacked(comparisons: list[Comparison]) -> tuple[Array, Array]:
    return np.vstack([each.measured for each in comparisons]), np.vstack([each.modelled for each in comparisons])

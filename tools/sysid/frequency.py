"""The frequency response as measured, with its coherence, beside the model's own.

Stick and answer are both means over the time between two frames, whose effect on either cancels in their ratio. It is
measured in closed loop: where coherence is high the sticks' excitation, not the feedback of gusts, makes the answer,
and the ratio is the vehicle's (Tischler and Remple, 2nd ed. 2012, 5.9, 7.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from tools.sysid.flight_data import FlightData, Track, turns
from tools.sysid.parameters import AXES, INDEX, Axis
from tracker.types import Array

Complex = NDArray[np.complex128]
WINDOW_S = 6.0
HIGHEST = 0.8
"""Of the Nyquist frequency; above it frames alias."""

FAINT = 10.0 ** (-25.0 / 10.0)
"""Where the stick's power is below this share of its peak there is nothing to measure."""

LEAST_COHERENCE = 0.6
ANSWERS = {Axis.ROLL: "roll rate", Axis.PITCH: "pitch rate", Axis.YAW: "yaw rate", Axis.HEAVE: "climb rate"}


@dataclass(frozen=True, slots=True, eq=False)
class Bode:
    """One axis: measured response (n,) with coherence at f_hz, and the model's; heard: its coherence over the band.

    cost: Tischler's mismatch, below 100 is good, below 50 excellent.
    """

    axis: Axis
    f_hz: Array
    measured: Complex
    modelled: Complex
    coherence: Array
    heard: float
    cost: float


def bode(axis: Axis, theta: Array, data: FlightData) -> Bode:
    """Measure one axis and hold the model against it.

    Source: Welch's method with Hann windows of 6 s, two thirds overlapping: H = S_uy / S_uu,
    coherence = abs(S_uy)^2 / (S_uu S_yy).
    """
    number = AXES.index(axis)
    pairs = [(_mean_sticks(track, data)[:, number], _answers(track)[:, number]) for track in data.tracks]
    step_s = float(np.median(np.diff(data.tracks[0].t_s)))
    f_hz, uu, yy, uy = _spectra(pairs, step_s)
    coherence = np.abs(uy) ** 2 / np.maximum(uu * yy, 1e-300)
    band = (f_hz >= 1.0 / WINDOW_S) & (f_hz <= HIGHEST * 0.5 / step_s)
    band &= uu > FAINT * uu[band].max(initial=0.0)
    weight = uu[band]
    heard = float(coherence[band] @ weight / weight.sum()) if weight.sum() > 0.0 else 0.0
    f_hz, measured, coherence = f_hz[band], (uy / np.maximum(uu, 1e-300))[band], coherence[band]
    modelled = transfer(axis, theta, f_hz)
    return Bode(axis, f_hz, measured, modelled, coherence, heard, _cost(measured, modelled, coherence))


def transfer(axis: Axis, theta: Array, f_hz: Array) -> Complex:
    """Return the linear model's response from an axis's stick to its rate, see ANSWERS (n,).

    Source: docs/sysid.md, eq. 1 to 5 at hover, small angles.
    """
    s = 2j * np.pi * np.asarray(f_hz)
    late = np.exp(-s * theta[INDEX["delay"]])

    def of(name: str) -> float:
        return float(theta[INDEX[name]])

    if axis is Axis.YAW:
        return np.asarray(late * of("yaw_gain") / (s + of("yaw_damping")))
    if axis is Axis.HEAVE:
        return np.asarray(late * of("heave_gain") / ((of("lift_lag") * s + 1.0) * (s + of("heave_damping"))))
    body = s * s + of(f"{axis}_damping") * s + of(f"{axis}_stiffness")
    return np.asarray(late * of(f"{axis}_gain") * s / ((of("rotor_lag") * s + 1.0) * body))


def _mean_sticks(track: Track, data: FlightData) -> Array:
    return data.sticks.mean(track.t_s[:-1], track.t_s[1:])


def _answers(track: Track) -> Array:
    """Return the rates about B's axes [rad/s] and the climb [m/s], means between frames (m - 1, 4)."""
    rates = turns(track.R_BtoW[:-1], track.R_BtoW[1:]) / np.diff(track.t_s)[:, None]
    return np.column_stack((rates, track.velocity()[:, 2]))


def _spectra(pairs: list[tuple[Array, Array]], step_s: float) -> tuple[Array, Array, Array, Complex]:
    """Return frequencies and the spectra uu, yy and uy of several tracks, each weighted by its length."""
    window = min(round(WINDOW_S / step_s), *(len(u) for u, _ in pairs))
    how = {"fs": 1.0 / step_s, "nperseg": window, "noverlap": 2 * window // 3, "detrend": "linear"}
    sums: list[Array] = [np.zeros(0)] * 3
    f_hz = np.zeros(0)
    for u, y in pairs:
        parts = []
        for a, b in ((u, u), (y, y), (u, y)):
            f_hz, part = signal.csd(a, b, **how)
            parts.append(len(u) * part)
        sums = [part if not total.size else total + part for total, part in zip(sums, parts, strict=True)]
    return f_hz, np.real(sums[0]), np.real(sums[1]), np.asarray(sums[2], dtype=np.complex128)


def _cost(measured: Complex, modelled: Complex, coherence: Array) -> float:
    """Return the mismatch. Source: Tischler and Remple, 2nd ed. (2012), eq. 11.3 to 11.6."""
    if not len(measured):
        return float("nan")
    weight = (1.58 * (1.0 - np.exp(-(coherence**2)))) ** 2
    ratio = measured / modelled
    error_db, error_deg = 20.0 * np.log10(np.maximum(np.abs(ratio), 1e-12)), np.degrees(np.angle(ratio))
    return float(20.0 * np.mean(weight * (error_db**2 + 0.01745 * error_deg**2)))

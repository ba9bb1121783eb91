"""Does the vehicle accelerate where its tilt and its yaw say it must? The one sign of a wrong yaw in flight.

A yaw that is 90 deg off against the position frame flew a real autopilot 200 m away, no failsafe acting: its velocity
variance stays 0 while no velocity is fused. Here it is seen within seconds of manoeuvring.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.types import Array

GRAVITY = 9.81
INTERVAL_S = 0.2  # velocity is differenced over this long
LONGEST_S = 0.5  # intervals with a gap this long are left out
FORGET_S = 20.0
KNOWN_DEG = 10.0  # one sigma below which the error is spoken of
ALARM_DEG = 15.0  # 10 deg flew well, 20 deg circled 1.3 m wide
SIGMAS = 3.0
# What is known before: air drag of small vehicles [1/s], and steady acceleration by trim and wind [m/s^2].
_DRAG, _DRAG_SIGMA, _STEADY_SIGMA = 0.3, 0.25, 0.5
_SOUGHT, _DRAG_AT = [0, 1, 3, 4], 2  # places among the columns of a row
_FLOOR = 0.02  # of the residual, one sigma [m/s^2]: no velocity is better


@dataclass(frozen=True, slots=True)
class YawReading:
    """What the watch knows.

    error_deg: reported yaw less the true one, positive clockwise; sigma_deg: one sigma [deg].
    gain: measured acceleration over that of the tilt; near 1 when all is well.
    known: sigma is small enough to speak.  alarm: words for the pilot, empty when all is well.
    """

    error_deg: float
    sigma_deg: float
    gain: float
    known: bool
    alarm: str

    @property
    def brief(self) -> str:
        """The alarm in a STATUSTEXT's length, empty when all is well."""
        return "yaw wrong: take over by hand and land" if self.alarm else ""  # without a figure it is said once


NOTHING = YawReading(0.0, math.inf, 0.0, known=False, alarm="")


class YawWatch:
    """Compare acceleration with tilt, in constant memory.

    Derivation: with N + iE as a complex number, thrust balances weight, so tilt alone accelerates by
        u = g exp(i yaw) (-tan pitch + i tan roll / cos pitch).
    Measured, over INTERVAL_S, is a = h u - d v + b + noise: h = |h| exp(-i e) with e the error of the yaw in u, d drag,
    b trim and wind. Least squares for h and b, older samples forgotten exponentially. Drag is not learned, for gusts
    teach it wrongly, but its uncertainty counts (Schmidt's "consider"): in a circle v stands at a right angle to u, and
    drag looks like yaw. The variance is that of the residuals, widened by their neighbours' correlation.
    """

    def __init__(self, forget_s: float = FORGET_S) -> None:
        self._forget_s = forget_s
        self._information = np.zeros((5, 5))
        self._vector = np.zeros(5)
        self._energy = 0.0
        self._weight = 0.0
        self._neighbours = 0.0
        self._last_residual = np.zeros(2)
        self._tilt: tuple[float, float] | None = None
        self._start: tuple[int, Array] | None = None
        self._last: tuple[int, Array] = (0, np.zeros(2))
        self._sum = np.zeros(2)

    def take_tilt(self, roll: float, pitch: float) -> None:
        """Take the vehicle's tilt by the autopilot's own ATTITUDE: forward-right-down, Z-Y-X [rad].

        It must not come from the bridge's pose: balls mounted askew turn that tilt along with the yaw.
        """
        self._tilt = (roll, pitch)

    def take_pose(self, t_ns: int, v_N: Sequence[float] | Array, yaw: float) -> None:
        """Take the bridge's velocity (2,) or (3,), north first [m/s], and yaw [rad] at t_ns [ns]."""
        if self._tilt is None or abs(self._tilt[1]) > 1.0 or abs(self._tilt[0]) > 1.0:
            self._start = None
            return
        v = np.array([v_N[0], v_N[1]])
        u = tilt_acceleration(*self._tilt, yaw)
        if self._start is None or not 0 <= t_ns - self._start[0] <= LONGEST_S * 1e9:
            self._begin(t_ns, u, v)
            return
        before_ns, u_before = self._last
        self._sum += (u + u_before) / 2.0 * (t_ns - before_ns) / 1e9
        self._last = (t_ns, u)
        lasted_s = (t_ns - self._start[0]) / 1e9
        if lasted_s >= INTERVAL_S:
            began = self._start[1]
            self._learn((v - began) / lasted_s, self._sum / lasted_s, (v + began) / 2.0, lasted_s)
            self._begin(t_ns, u, v)

    def reading(self) -> YawReading:
        """Return what is known now."""
        if self._weight < 5.0:
            return NOTHING
        x, covariance = self._solve()
        gain = math.hypot(x[0], x[1])
        if gain < 1e-6:
            return NOTHING
        slope = np.array([-x[1], x[0], 0.0, 0.0]) / gain**2
        sigma_deg = math.degrees(math.sqrt(float(slope @ covariance @ slope)))
        error_deg = -math.degrees(math.atan2(x[1], x[0]))
        wrong = abs(error_deg) - SIGMAS * sigma_deg > ALARM_DEG
        return YawReading(
            error_deg, sigma_deg, gain, sigma_deg < KNOWN_DEG, _alarm(error_deg, sigma_deg) if wrong else ""
        )

    def _begin(self, t_ns: int, u: Array, v: Array) -> None:
        self._start = (t_ns, v)
        self._last = (t_ns, u)
        self._sum = np.zeros(2)

    def _learn(self, a: Array, u: Array, v: Array, lasted_s: float) -> None:
        """Add one interval's acceleration."""
        rows = np.array([[u[0], -u[1], -v[0], 1.0, 0.0], [u[1], u[0], -v[1], 0.0, 1.0]])
        kept = math.exp(-lasted_s / self._forget_s)
        self._information = kept * self._information + rows.T @ rows
        self._vector = kept * self._vector + rows.T @ a
        self._energy = kept * self._energy + float(a @ a)
        self._weight = kept * self._weight + 1.0
        residual = a - rows @ _with_drag(self._fit(0.1**2)[0])
        self._neighbours = kept * self._neighbours + float(residual @ self._last_residual)
        self._last_residual = residual

    def _solve(self) -> tuple[Array, Array]:
        """Return the unknowns (h real, h imaginary, steady north, steady east) and their covariance."""
        x, _ = self._fit(0.1**2)
        variance = self._variance(x)
        x, information = self._fit(variance)
        correlation = min(max(self._neighbours / (2.0 * self._weight * variance), 0.0), 0.8)
        inverse = np.linalg.inv(information)
        by_drag = inverse @ self._information[np.ix_(_SOUGHT, (_DRAG_AT,))] * _DRAG_SIGMA
        noise = inverse * variance * (1.0 + correlation) / (1.0 - correlation)
        return x, np.asarray(noise + by_drag @ by_drag.T)

    def _fit(self, variance: float) -> tuple[Array, Array]:
        """Solve for what is sought, its prior scaled to a residual variance [m^2/s^4]."""
        prior = variance / np.array([1e4, 1e4, _STEADY_SIGMA**2, _STEADY_SIGMA**2])
        information = self._information[np.ix_(_SOUGHT, _SOUGHT)] + np.diag(prior)
        vector = self._vector[_SOUGHT] - self._information[_SOUGHT, _DRAG_AT] * _DRAG
        return np.asarray(np.linalg.solve(information, vector)), information

    def _variance(self, x: Array) -> float:
        """Return the residuals' variance per axis, never below the floor's [m^2/s^4]."""
        whole = _with_drag(x)
        left = self._energy - 2.0 * float(whole @ self._vector) + float(whole @ self._information @ whole)
        return max(left / max(2.0 * self._weight - 4.0, 1.0), _FLOOR**2)


def _with_drag(x: Array) -> Array:
    return np.array([x[0], x[1], _DRAG, x[2], x[3]])


def tilt_acceleration(roll: float, pitch: float, yaw: float) -> Array:
    """Return the acceleration north and east (2,) that a tilt gives while thrust bears the weight [m/s^2]."""
    u = GRAVITY * complex(math.cos(yaw), math.sin(yaw)) * complex(-math.tan(pitch), math.tan(roll) / math.cos(pitch))
    return np.array([u.real, u.imag])


def _alarm(error_deg: float, sigma_deg: float) -> str:
    return f"yaw is {error_deg:+.0f} +/- {sigma_deg:.0f} deg off against the motion: it steers the wrong way"

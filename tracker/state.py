"""The vehicle's state and its error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from tracker.maths import so3
from tracker.types import Array, frozen_array

POSITION, ATTITUDE, VELOCITY, RATE = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
ACCELERATION, ANGULAR_ACCELERATION = slice(12, 15), slice(15, 18)
JERK, ANGULAR_JERK = slice(18, 21), slice(21, 24)
OFFSETS = 24  # errors of the clock offsets of cameras 1, 2, ... begin here
REPORTED = 12  # the first of the errors, which `Estimate.covariance` is of


@dataclass(frozen=True, slots=True, eq=False)
class Process:
    """How briskly the vehicle manoeuvres, from its envelope and not from any recording.

    acceleration_m_s2, angular_acceleration_rad_s2: one sigma of what the briskest manoeuvre reaches on each axis.
    manoeuvre_s: how long it keeps one acceleration.
    initial_speed_m_s, initial_rate_rad_s: one sigma at first sight, on each axis.
    tilt_rad: one sigma of roll and of pitch over a whole flight.  tilt_s: how long the vehicle keeps one tilt.
    clock_offset_s: one sigma of a camera's unknown clock offset against camera 0; 0 when there is none.
    pixel_noise_px: one sigma of what a camera adds to its fits, until it is learned.
    """

    acceleration_m_s2: float
    angular_acceleration_rad_s2: float
    manoeuvre_s: float
    initial_speed_m_s: float
    initial_rate_rad_s: float
    tilt_rad: float
    tilt_s: float
    clock_offset_s: float
    pixel_noise_px: float


R_ZZ = 11  # of `State.mean`: the attitude's last element, how upright the body is
STILL = frozen_array(np.zeros(3))
FIRST_CLOCK = frozen_array(np.zeros(1))  # the offset of a single camera's
_P, _R, _V, _W = slice(0, 3), slice(3, 12), slice(12, 15), slice(15, 18)
_A, _ALPHA, _J, _BETA, _CLOCKS = slice(18, 21), slice(21, 24), slice(24, 27), slice(27, 30), slice(30, None)
_PARTS = MappingProxyType(
    {
        "p_BinW": _P, "R_BtoW": _R, "v_BinW": _V, "w_BinB": _W, "a_BinW": _A, "alpha_BinB": _ALPHA, "j_BinW": _J,
        "beta_BinB": _BETA, "offsets_s": _CLOCKS,
    }
)  # fmt: skip
"""Where each part stands in `State.mean`, the attitude by rows."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Nominal state, covariance, and what was learned of manoeuvres and pixels on the way, at t_ns.

    mean: (30 + cameras,) the nominal state as one vector, as compiled code takes it; only to be read. Its parts are
        p_BinW (3,) [m], R_BtoW (3, 3) by rows, v_BinW (3,) [m/s], w_BinB (3,) [rad/s], a_BinW (3,) [m/s^2],
        alpha_BinB (3,) [rad/s^2], j_BinW (3,) [m/s^3], beta_BinB (3,) [rad/s^3], offsets_s (cameras,) [s].
    P: (n, n) of the errors in the order position (W), rotation vector (B, R = R_hat exp(theta)), velocity (W), rate
        (B), acceleration (W), angular acceleration (B), jerk (W), angular jerk (B), clock offsets of cameras 1, 2, ...;
        n = 23 + cameras.
    levels: (2, levels) probability of each level of `manoeuvre`, for translation and for rotation.
    noise: (cameras, 4) variances that a camera adds to its fits, and how much is known of them, see `noise`.
    manoeuvre_s: how long an acceleration lasts [s].
    """

    t_ns: int
    mean: Array
    P: Array
    levels: Array = field(default_factory=lambda: np.ones((2, 1)))
    noise: Array = field(default_factory=lambda: np.zeros((1, 4)))
    manoeuvre_s: float = 1.0

    @property
    def p_BinW(self) -> Array:
        """Return the body's place (3,) [m]."""
        return self.mean[_P]

    @property
    def R_BtoW(self) -> Array:
        """Return the attitude (3, 3)."""
        return self.mean[_R].reshape(3, 3)

    @property
    def v_BinW(self) -> Array:
        """Return the velocity (3,) [m/s]."""
        return self.mean[_V]

    @property
    def w_BinB(self) -> Array:
        """Return the angular rate (3,) [rad/s]."""
        return self.mean[_W]

    @property
    def a_BinW(self) -> Array:
        """Return the acceleration (3,) [m/s^2]."""
        return self.mean[_A]

    @property
    def alpha_BinB(self) -> Array:
        """Return the angular acceleration (3,) [rad/s^2]."""
        return self.mean[_ALPHA]

    @property
    def j_BinW(self) -> Array:
        """Return the jerk (3,) [m/s^3]."""
        return self.mean[_J]

    @property
    def beta_BinB(self) -> Array:
        """Return the angular jerk (3,) [rad/s^3]."""
        return self.mean[_BETA]

    @property
    def offsets_s(self) -> Array:
        """Return the clock offsets (cameras,): a frame stamped t shows the vehicle at t + offset [s].

        Camera 0's clock counts, so its offset is 0.
        """
        return self.mean[_CLOCKS]

    def moved(self, dx: Array) -> State:
        """Return the state with the error dx (n,) put in; the covariance stays as it is."""
        mean = self.mean.copy()
        mean[:3] += dx[POSITION]
        mean[3:12] = (self.R_BtoW @ so3.exp(dx[ATTITUDE])).reshape(9)
        mean[12:30] += dx[VELOCITY.start : OFFSETS]
        mean[31:] += dx[OFFSETS:]
        return replace(self, mean=mean)

    def error_to(self, other: State) -> Array:
        """Return the error (n,) that moves this state to another one."""
        turn, step = so3.log(self.R_BtoW.T @ other.R_BtoW), other.mean - self.mean
        return np.concatenate((step[_P], turn, step[12:30], step[31:]))

    def with_parts(self, **parts: Array) -> State:
        """Return the state with other parts of its mean, by their names."""
        mean = self.mean.copy()
        for name, part in parts.items():
            mean[_PARTS[name]] = part.reshape(-1)
        return replace(self, mean=mean)

    def with_clocks_open(self, breaks_s: Mapping[int, float]) -> State:
        """Return the state less sure of the clock offsets of some cameras, by one sigma of each [s].

        Camera 0's clock counts: when it jumps, it is the offsets of all others that are less sure.
        """
        P = self.P.copy()
        for camera, break_s in breaks_s.items():
            jump = np.full(len(P) - OFFSETS, break_s) if camera == 0 else np.zeros(len(P) - OFFSETS)
            jump[camera - 1 : camera] = break_s
            P[OFFSETS:, OFFSETS:] += np.outer(jump, jump)
        return replace(self, P=P)

    def with_clocks(self, offsets_s: Array, covariance_s2: Array) -> State:
        """Return the state with these clock offsets (cameras,), known to a covariance apart from all else."""
        P = self.P.copy()
        P[OFFSETS:], P[:, OFFSETS:] = 0.0, 0.0
        P[OFFSETS:, OFFSETS:] = covariance_s2
        return replace(self.with_parts(offsets_s=offsets_s), P=P)


def mean_of(
    p_BinW: Array, R_BtoW: Array, v_BinW: Array = STILL, w_BinB: Array = STILL, offsets_s: Array = FIRST_CLOCK
) -> Array:
    """Return the `State.mean` of a vehicle that keeps its velocity and its rate; arguments as the parts there."""
    return np.concatenate((p_BinW, R_BtoW.reshape(9), v_BinW, w_BinB, np.zeros(12), offsets_s))


def start_covariance(process: Process, offsets_s: Array, position_m: float, attitude_rad: float) -> Array:
    """Return P (n, n) of a vehicle just found, of which only the pose is known.

    offsets_s: one sigma of the clock offset of each camera but the first.
    """
    sigma = np.empty(OFFSETS + len(offsets_s))
    sigma[POSITION] = position_m
    sigma[ATTITUDE] = attitude_rad
    sigma[VELOCITY] = process.initial_speed_m_s
    sigma[RATE] = process.initial_rate_rad_s
    sigma[ACCELERATION] = process.acceleration_m_s2
    sigma[ANGULAR_ACCELERATION] = process.angular_acceleration_rad_s2
    sigma[JERK] = 2.0 * process.acceleration_m_s2 / process.manoeuvre_s
    sigma[ANGULAR_JERK] = 2.0 * process.angular_acceleration_rad_s2 / process.manoeuvre_s
    sigma[OFFSETS:] = offsets_s
    return np.diag(sigma**2)

"""The vehicle's state and its error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tracker.maths import so3
from tracker.types import Array

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


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Nominal state, covariance, and what was learned of manoeuvres and pixels on the way, at t_ns.

    p_BinW (3,) [m], R_BtoW (3, 3), v_BinW (3,) [m/s], w_BinB (3,) [rad/s]; P (n, n) of the errors in the order
    position (W), rotation vector (B, R = R_hat exp(theta)), velocity (W), rate (B), acceleration (W), angular
    acceleration (B), jerk (W), angular jerk (B), clock offsets of cameras 1, 2, ...; n = 23 + cameras.
    a_BinW (3,) [m/s^2], alpha_BinB (3,) [rad/s^2], j_BinW (3,) [m/s^3], beta_BinB (3,) [rad/s^3].
    offsets_s: (cameras,) a frame stamped t shows the vehicle at t + offset; camera 0's clock counts, so its is 0 [s].
    levels: (2, levels) probability of each level of `manoeuvre`, for translation and for rotation.
    noise: (cameras, 2) variance that a camera adds to each fit, and how much is known of it, see `noise`.
    manoeuvre_s: how long an acceleration lasts [s].
    """

    t_ns: int
    p_BinW: Array
    R_BtoW: Array
    v_BinW: Array
    w_BinB: Array
    P: Array
    a_BinW: Array = field(default_factory=lambda: np.zeros(3))
    alpha_BinB: Array = field(default_factory=lambda: np.zeros(3))
    j_BinW: Array = field(default_factory=lambda: np.zeros(3))
    beta_BinB: Array = field(default_factory=lambda: np.zeros(3))
    offsets_s: Array = field(default_factory=lambda: np.zeros(1))
    levels: Array = field(default_factory=lambda: np.ones((2, 1)))
    noise: Array = field(default_factory=lambda: np.zeros((1, 2)))
    manoeuvre_s: float = 1.0

    def moved(self, dx: Array) -> State:
        """Return the state with the error dx (n,) put in; the covariance stays as it is."""
        offsets_s = self.offsets_s.copy()
        offsets_s[1:] += dx[OFFSETS:]
        return replace(
            self,
            p_BinW=self.p_BinW + dx[POSITION],
            R_BtoW=self.R_BtoW @ so3.exp(dx[ATTITUDE]),
            v_BinW=self.v_BinW + dx[VELOCITY],
            w_BinB=self.w_BinB + dx[RATE],
            a_BinW=self.a_BinW + dx[ACCELERATION],
            alpha_BinB=self.alpha_BinB + dx[ANGULAR_ACCELERATION],
            j_BinW=self.j_BinW + dx[JERK],
            beta_BinB=self.beta_BinB + dx[ANGULAR_JERK],
            offsets_s=offsets_s,
        )

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
        return replace(self, P=P, offsets_s=offsets_s)

    @property
    def mean(self) -> Array:
        """Return the nominal state as one vector, for compiled code: p, R by rows, v, w, a, alpha, j, beta, offsets.

        Only to be read: it is the vector that `at_mean` was given, if the state's parts are still parts of that.
        """
        whole = self.p_BinW.base
        if (
            whole is not None
            and self.R_BtoW.base is whole
            and self.v_BinW.base is whole
            and self.w_BinB.base is whole
            and self.a_BinW.base is whole
            and self.alpha_BinB.base is whole
            and self.j_BinW.base is whole
            and self.beta_BinB.base is whole
            and self.offsets_s.base is whole
        ):
            return whole
        parts = (
            self.p_BinW, self.R_BtoW, self.v_BinW, self.w_BinB, self.a_BinW, self.alpha_BinB, self.j_BinW,
            self.beta_BinB, self.offsets_s,
        )  # fmt: skip
        return np.concatenate([part.reshape(-1) for part in parts])

    def with_mean(self, mean: Array) -> State:
        """Return the state with another nominal state, as `mean` gives it."""
        return replace(
            self,
            p_BinW=mean[0:3],
            R_BtoW=mean[3:12].reshape(3, 3),
            v_BinW=mean[12:15],
            w_BinB=mean[15:18],
            a_BinW=mean[18:21],
            alpha_BinB=mean[21:24],
            j_BinW=mean[24:27],
            beta_BinB=mean[27:30],
            offsets_s=mean[30:],
        )

    def at_mean(self, t_ns: int, mean: Array, P: Array, levels: Array, noise: Array) -> State:
        """Return the state of t_ns, with all that an update may change; quicker than `dataclasses.replace`."""
        return State(
            t_ns, mean[0:3], mean[3:12].reshape(3, 3), mean[12:15], mean[15:18], P, mean[18:21], mean[21:24],
            mean[24:27], mean[27:30], mean[30:], levels, noise, self.manoeuvre_s,
        )  # fmt: skip


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

"""The model's answer to a flight's sticks, held against what was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.sysid import parameters
from tools.sysid.flight_data import FlightData, Sticks, Track, in_heading, turns
from tools.sysid.model import STATES, simulate
from tracker.maths import so3
from tracker.types import Array

CHANNELS = ("forward", "left", "up", "roll", "pitch", "yaw")
"""Residuals: velocity in the heading frame [m/s], attitude as a rotation vector in B [rad]."""

START_SIGMA = np.repeat([0.15, 0.05, 1.5, 1.0, 5.0], [3, 3, 3, 2, 1])
"""How far a segment's first state may lie from where the start was guessed, one sigma."""


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """The model's run through a track: velocity (m - 1, 3) as `Track.velocity`, R_BtoW (m, 3, 3) of the marker."""

    velocity: Array
    R_BtoW: Array


def respond(theta: Array, start: Array, track: Track, sticks: Sticks) -> Response:
    """Run the model through a track.

    Args:
        theta: parameters.  start: state (12,) at the track's first sample, its attitude against the measured one.
    """
    count = len(track)
    out, attitude = np.empty((count, STATES)), np.empty((count, 3, 3))
    level = so3.exp(np.array([*theta[-2:], 0.0]))
    R_start = np.ascontiguousarray(track.R_BtoW[0] @ level.T)
    simulate(theta, start, R_start, track.t_s, sticks.at_s, sticks.held, sticks.total, out, attitude)
    moved = np.diff(out[:, 3:6], axis=0) / np.diff(track.t_s)[:, None]
    return Response(in_heading(moved, track.R_BtoW[1:]), attitude @ level)


def residuals(theta: Array, start: Array, track: Track, sticks: Sticks) -> Array:
    """Return measured less modelled (m - 1, 6), see CHANNELS; the first attitude is the start's."""
    answer = respond(theta, start, track, sticks)
    return np.hstack((track.velocity() - answer.velocity, turns(answer.R_BtoW, track.R_BtoW)[1:]))


def measured_sigma(track: Track) -> Array:
    """Return one sigma of the residuals (m - 1, 6) by the log's covariances."""
    variance = track.sigma**2
    speed = np.sqrt(variance[1:, :3] + variance[:-1, :3]) / np.diff(track.t_s)[:, None]
    return np.hstack((speed, track.sigma[1:, 3:]))


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """All that a fit looks for: the parameters (20,), then the first state of each track (tracks, 12)."""

    theta: Array
    starts: Array

    def flat(self) -> Array:
        """Return them as one array."""
        return np.concatenate((self.theta, self.starts.ravel()))

    @staticmethod
    def of(flat: Array) -> Unknowns:
        """Read them back."""
        return Unknowns(flat[: parameters.COUNT], flat[parameters.COUNT :].reshape(-1, STATES))


def all_residuals(unknowns: Unknowns, data: FlightData) -> list[Array]:
    """Return the residuals of each track."""
    return [
        residuals(unknowns.theta, start, track, data.sticks)
        for start, track in zip(unknowns.starts, data.tracks, strict=True)
    ]


def first_states(data: FlightData) -> Array:
    """Guess the first states (tracks, 12) from the first samples: speed and rates by differences, the rest at rest."""
    starts = np.zeros((len(data.tracks), STATES))
    for start, track in zip(starts, data.tracks, strict=True):
        span_s = track.t_s[2] - track.t_s[0]
        start[0:3] = (track.p_inW[2] - track.p_inW[0]) / span_s
        start[6:9] = so3.log(track.R_BtoW[0].T @ track.R_BtoW[2]) / span_s
    return starts

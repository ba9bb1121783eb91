"""What the fit takes of a flight: tracks without a gap, and the sticks that the servos were told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class Sticks:
    """Sticks held from each time on: roll, pitch, yaw and heave as shares of full stick, about B's axes.

    at_s: (n,) [s].  held: (n, 4).  total: their integral up to at_s (n, 4) [s].
    """

    at_s: Array
    held: Array
    total: Array

    def mean(self, start_s: Array, end_s: Array) -> Array:
        """Return the mean stick between times (m, 4)."""
        span_s = np.maximum(end_s - start_s, 1e-9)[:, None]
        return (self._until(end_s) - self._until(start_s)) / span_s

    def _until(self, t_s: Array) -> Array:
        k = np.maximum(np.searchsorted(self.at_s, t_s, side="right") - 1, 0)
        return np.asarray(self.total[k] + self.held[k] * (t_s - self.at_s[k])[:, None])


def make_sticks(at_s: Array, held: Array) -> Sticks:
    """Put sticks (n, 4) in order, held from each of the times at_s (n,) [s] until the next."""
    at_s, held = np.ascontiguousarray(at_s, np.float64), np.ascontiguousarray(held, np.float64)
    total = np.zeros_like(held)
    total[1:] = np.cumsum(held[:-1] * np.diff(at_s)[:, None], axis=0)
    return Sticks(at_s, held, total)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Estimates with no gap between them.

    t_s: (m,) [s].  p_inW: (m, 3) of the centre of mass [m].  R_BtoW: (m, 3, 3).
    sigma: (m, 6) of position [m] and attitude [rad], as the log says.
    """

    t_s: Array
    p_inW: Array
    R_BtoW: Array
    sigma: Array

    def __len__(self) -> int:
        return len(self.t_s)

    @property
    def duration_s(self) -> float:
        """Return how long it lasts [s]."""
        return float(self.t_s[-1] - self.t_s[0])

    def part(self, first: int, last: int) -> Track:
        """Return the samples from first to before last."""
        rows = slice(first, last)
        return Track(self.t_s[rows], self.p_inW[rows], self.R_BtoW[rows], self.sigma[rows])

    def velocity(self) -> Array:
        """Return the mean velocity since the sample before, in the heading frame: forward, left, up (m - 1, 3)."""
        return in_heading(np.diff(self.p_inW, axis=0) / np.diff(self.t_s)[:, None], self.R_BtoW[1:])


def in_heading(v_inW: Array, R_BtoW: Array) -> Array:
    """Turn vectors (m, 3) from W to the frame that is level and has the nose's heading."""
    yaw = np.arctan2(R_BtoW[:, 1, 0], R_BtoW[:, 0, 0])
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack((cos * v_inW[:, 0] + sin * v_inW[:, 1], cos * v_inW[:, 1] - sin * v_inW[:, 0], v_inW[:, 2]))


def turns(R_from: Array, R_to: Array) -> Array:
    """Return the rotation vectors (m, 3) in the first frame from rotations (m, 3, 3) to others, less than half a turn.

    Source: R - R' = 2 sin(angle) hat(axis), trace R = 1 + 2 cos(angle).
    """
    R = np.swapaxes(R_from, 1, 2) @ R_to
    twist = 0.5 * np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1)
    sine = np.sqrt((twist**2).sum(axis=1))
    angle = np.arctan2(sine, 0.5 * (R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2] - 1.0))
    return np.asarray(twist * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class FlightData:
    """A flight as the fit takes it."""

    tracks: tuple[Track, ...]
    sticks: Sticks

    @property
    def duration_s(self) -> float:
        """Return the length of all tracks [s]."""
        return sum(track.duration_s for track in self.tracks)

    def stopped(self) -> Array:
        """Return the share of the flight that each stick is at its stop (4,)."""
        held = np.vstack([self.sticks.mean(track.t_s[:-1], track.t_s[1:]) for track in self.tracks])
        return np.asarray(np.mean(np.abs(held) > STOP, axis=0))

    def split(self, share: float) -> tuple[FlightData, FlightData]:
        """Return the first share of it, more or less, and the rest; cut where the sticks are quiet."""
        cut_s = min(np.linspace(share - SLACK, share + SLACK, 33) * self.duration_s, key=self._unrest)
        before, after = [], []
        for track in self.tracks:
            cut = int(np.searchsorted(track.t_s, track.t_s[0] + max(cut_s, 0.0), side="right"))
            cut_s -= track.duration_s
            before.append(track.part(0, cut))
            after.append(track.part(cut, len(track)))
        enough = [tuple(track for track in tracks if len(track) >= SHORTEST) for tracks in (before, after)]
        return FlightData(enough[0], self.sticks), FlightData(enough[1], self.sticks)

    def _unrest(self, passed_s: float) -> float:
        """Return how much the sticks move about a time, the gaps between tracks left out."""
        for track in self.tracks:
            if passed_s <= track.duration_s:
                edges = track.t_s[0] + passed_s + np.linspace(-1.0, 0.5, 16)
                return float(self.sticks.mean(edges[:-1], edges[1:]).std(axis=0).sum())
            passed_s -= track.duration_s
        return np.inf


STOP, SLACK = 0.98, 0.08
SHORTEST = 30
"""Fewest samples of a track that is worth its own unknown start."""

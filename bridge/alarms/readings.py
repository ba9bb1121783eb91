"""What alarms judge by: a run's figures at one instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from bridge.telemetry.states import Surroundings
from tracker.types import TrackState


@dataclass(frozen=True, slots=True)
class Limits:
    """What a run must keep to.

    rate_min_hz: fewest poses a second that the autopilot, or the operator, asks for [Hz].
    latency_limit_ms: longest time from frame to datagram for 99 of 100 poses [ms].
    max_age_ms: an older pose is not sent [ms].
    """

    rate_min_hz: float = 15.0
    latency_limit_ms: float = 60.0
    max_age_ms: float = 100.0


class CameraReading(NamedTuple):
    """One camera.

    silent_ms: since its last frame [ms].  blind_s: since a ball of its images was last used, while tracking [s].
    clock_offset_ms, clock_sigma_ms: how much later than its stamps it was found to see, beyond what the config says,
        and one sigma of that [ms]; None while not estimated.
    configured_offset_ms: the config's clock_offset_ms.
    moved: whether it no longer stands where it stood when the flight began, or where the room file has it.
    shift_px, at_vehicle_mm, full_share: see `tracker.standing.CameraHealth`.
    """

    name: str
    silent_ms: float
    blind_s: float = 0.0
    clock_offset_ms: float | None = None
    clock_sigma_ms: float | None = None
    configured_offset_ms: float = 0.0
    moved: bool = False
    shift_px: float = 0.0
    at_vehicle_mm: float = 0.0
    full_share: float = 0.0


class BallReading(NamedTuple):
    """One ball. unseen_s: since any camera's sighting of it was last used, while tracking [s]."""

    name: str
    unseen_s: float


@dataclass(frozen=True, slots=True)
class Readings:
    """A run at one instant.

    t_ns: stream time [ns].  running_s: since the first frame [s].
    state, state_s: the track's, and for how long [s].
    rate_hz: of the last two seconds [Hz].  gap_ms: longest of the last ten, the one going on included [ms].
    age_ms: how old the oldest pose of the last two was when it could leave [ms].
    latency_p99_ms: of the newest datagrams [ms].  nis_ratio: mean NIS over its degrees of freedom, of the last ten
        seconds.  None for what is not known.
    last_rejection: what was left out last and why, "" for nothing.
    at_odds: the rays to the balls say that a camera has moved, and nothing tells which.
    epipolar_px: by how much those rays miss each other; None where not known [px].
    from_start: they said so from the beginning.
    """

    t_ns: int
    running_s: float
    state: TrackState
    state_s: float
    rate_hz: float
    gap_ms: float | None
    age_ms: float | None
    latency_p99_ms: float | None
    nis_ratio: float | None
    cameras: tuple[CameraReading, ...]
    balls: tuple[BallReading, ...]
    around: Surroundings
    limits: Limits
    last_rejection: str = ""
    at_odds: bool = False
    epipolar_px: float | None = None
    from_start: bool = False

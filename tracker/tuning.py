"""What the tracker is told of the vehicle, the room and itself."""

from __future__ import annotations

from dataclasses import dataclass

from tracker.state import Process


@dataclass(frozen=True, slots=True)
class Tuning:
    """Limits of the tracker; none belongs to a recording.

    process: how the vehicle may manoeuvre.
    gate_probability: of a true sighting to pass each chi-square gate.
    sync_window_ns: frames this close in time are one instant.
    coast_limit_ns: without a sighting for longer the track is lost.
    tilt_limit_rad: no vehicle that flies leans further; a pose that does is a mistake, such as a mirrored marker.
    continuity_limit_ns: a track lost for longer cannot claim to be the same on return, whatever its prediction says.
    lag_rounds: poses go out so many rounds late, put right by those rounds.
    calibrated_px: by how much balls missed when the room was calibrated, one sigma; None where nobody measured it.
    """

    process: Process
    gate_probability: float
    sync_window_ns: int
    coast_limit_ns: int
    continuity_limit_ns: int
    tilt_limit_rad: float
    lag_rounds: int = 0
    calibrated_px: float | None = None

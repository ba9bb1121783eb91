"""What the rest of the bridge tells telemetry about itself."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.wire import LinkState


@dataclass(frozen=True, slots=True)
class TimeSyncState:
    """How well one link's far clock is known against ours.

    offset_ms: far clock + offset is ours [ms].  skew_ppm: how much faster it grows [1e-6].
    rtt_ms, spread_ms: round trip of the newest samples and one sigma of their offsets [ms].
    converged: the estimate has settled.  None: not known yet.
    """

    link: str
    converged: bool
    offset_ms: float | None = None
    skew_ppm: float | None = None
    rtt_ms: float | None = None
    spread_ms: float | None = None
    samples: int = 0


@dataclass(frozen=True, slots=True)
class PeerState:
    """The autopilot at the far end of one link. profile: the rules it is spoken to by."""

    link: str
    name: str
    system_id: int
    component_id: int
    profile: str = ""
    version: str = ""


@dataclass(frozen=True, slots=True)
class LogState:
    """The log: its file, size [bytes], steps written and dropped, and what ended it early, if anything did."""

    path: str
    size_bytes: int
    written: int
    dropped: int
    error: str = ""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """All that telemetry does not see in the loop's turns, as it stands now. log: None when nothing is recorded."""

    links: tuple[LinkState, ...] = ()
    log: LogState | None = None
    time_syncs: tuple[TimeSyncState, ...] = ()
    peers: tuple[PeerState, ...] = ()

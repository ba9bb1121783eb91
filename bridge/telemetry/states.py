"""What the rest of the bridge tells telemetry about itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bridge.dialogue import DialogueState
from bridge.wire import LinkState


@dataclass(frozen=True, slots=True)
class TimeSyncState:
    """How well one link's far clock is known against ours.

    offset_ms: far clock + offset is ours [ms].  skew_ppm: how much faster our clock runs than the far one [1e-6].
    rtt_ms, spread_ms: median round trip of the newest samples and one sigma of their offsets [ms].
    converged: the estimate has settled.  samples: exchanges used since it was begun.  None: not known yet.
    refused: replies too slow or never asked for.  restarts: how often it was begun anew, as the far clock had jumped.
    """

    link: str
    converged: bool
    offset_ms: float | None = None
    skew_ppm: float | None = None
    rtt_ms: float | None = None
    spread_ms: float | None = None
    samples: int = 0
    refused: int = 0
    restarts: int = 0


@dataclass(frozen=True, slots=True)
class PeerState:
    """The far end of one link.

    name: the autopilot's kind, "" while none was heard.  profile: the rules it is spoken to by.
    away: heard once, and silent now.  origin: how far the matter of its origin has come, "" where it needs none.
    holding: why it gets no poses at present, "" when it does.
    too_old, too_close: poses not sent for their age, or because they followed the last one too closely.
    strangers: messages of others than the autopilot.
    """

    link: str
    name: str
    system_id: int
    component_id: int
    profile: str = ""
    away: bool = False
    origin: str = ""
    holding: str = ""
    too_old: int = 0
    too_close: int = 0
    strangers: int = 0


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


def surroundings_of(
    links: Sequence[LinkState], far_ends: Sequence[DialogueState], log: LogState | None
) -> Surroundings:
    """Return how links, the far end of each in the same order, and the log stand."""
    talks = [*zip((link.name for link in links), far_ends, strict=True)]
    syncs = (_sync_state(link, far) for link, far in talks)
    return Surroundings(
        tuple(links),
        log,
        tuple(sync for sync in syncs if sync is not None),
        tuple(_peer_state(*talk) for talk in talks),
    )


def _sync_state(link: str, far: DialogueState) -> TimeSyncState | None:
    """Return the state of the time sync; None where there is nobody to ask for the time."""
    if far.peer is None:
        return None
    sync = far.sync
    if sync is None:
        return TimeSyncState(link, converged=False)
    return TimeSyncState(
        link, sync.converged, sync.offset_ns / 1e6, sync.skew_ppm, sync.rtt_ms, sync.spread_ms, sync.samples,
        sync.refused, sync.restarts,
    )  # fmt: skip


def _peer_state(link: str, far: DialogueState) -> PeerState:
    name, system_id, component_id = "", 0, 0
    if far.peer is not None:
        name, system_id, component_id = str(far.peer.autopilot), far.peer.system_id, far.peer.component_id
    return PeerState(
        link, name, system_id, component_id, far.profile, far.away, far.origin, far.holding, far.too_old,
        far.too_close, far.strangers,
    )  # fmt: skip

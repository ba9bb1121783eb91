"""One page of a run's state, as it goes over the loopback and comes out of a log: plain values, bounded in size."""

from __future__ import annotations

from dataclasses import dataclass

import orjson

from bridge.alarms import Alarm
from bridge.dialogue import DialogueState
from bridge.summary import Percentiles
from bridge.telemetry.states import LogState
from bridge.wire import LinkState

VERSION = 1
MAX_BYTES = 60_000  # a datagram holds 65 507


@dataclass(frozen=True, slots=True)
class About:
    """Which run this is. pid, started: tell one run from the next.  source: its URI.  version: of posebridge."""

    source: str
    version: str = ""
    pid: int = 0
    started: int = 0


@dataclass(frozen=True, slots=True)
class Track:
    """What is known of the vehicle: its state in a word, and for how long [s]; how often lost, how often jumped."""

    state: str
    state_s: float
    lost: int
    resets: int
    last_rejection: str = ""


@dataclass(frozen=True, slots=True)
class Pose:
    """The newest estimate: body in the room, z up, with one sigma of each error.

    position_m: x, y, z.  euler_deg: roll, pitch, yaw, Z-Y-X.  speed_m_s: of the body.
    """

    position_m: tuple[float, float, float]
    position_sigma_m: tuple[float, float, float]
    euler_deg: tuple[float, float, float]
    attitude_sigma_deg: tuple[float, float, float]
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class Rate:
    """Poses a second and the gaps between them, by when they leave.

    now_hz: of the last two seconds.  mean_hz: of the whole run, by the frames' stamps.  need_hz: the limit.
    gap_now_ms: since the newest pose.  gap_recent_ms: longest of the last ten seconds.  gap_ever_ms: of the run.
    age_ms: how old the oldest pose of the last two seconds was when it left, by its frame's stamp.
    """

    poses: int
    now_hz: float
    mean_hz: float
    need_hz: float
    gap_now_ms: float | None
    gap_recent_ms: float | None
    gap_ever_ms: float | None
    age_ms: float | None


@dataclass(frozen=True, slots=True)
class Stage:
    """How long one stage takes over the whole run. counts: samples in each of `EDGES_MS`' bins."""

    name: str
    spread_ms: Percentiles
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Latency:
    """From the newest frame in memory to the datagram taken by the kernel.

    recent_p50_ms, recent_p99_ms: of the newest 256 datagrams.  total: of all.  stages: its parts, in order.
    """

    recent_p50_ms: float | None
    recent_p99_ms: float | None
    limit_ms: float
    total: Stage
    stages: tuple[Stage, ...]


@dataclass(frozen=True, slots=True)
class Nis:
    """Normalised innovation squared: of the last update, and over its degrees of freedom in the last ten seconds.

    low, high: the band that holds 95 % of such means when the filter's covariance is true.
    """

    value: float | None = None
    dof: int = 0
    mean_ratio: float | None = None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True)
class CameraView:
    """One camera. rate_hz, seen: of the last ten seconds; seen: share of its frames each ball was used from, by ball.

    clock_offset_ms, clock_sigma_ms: see `bridge.alarms.CameraReading`.
    room: what the room behind the vehicle tells of it, see `tracker.standing.Witness`; "" for nothing yet.
    room_shift_px: how far the room has moved in its picture since the flight began.
    """

    name: str
    frames: int
    rate_hz: float
    silent_ms: float
    seen: tuple[float, ...]
    clock_offset_ms: float | None = None
    clock_sigma_ms: float | None = None
    room: str = ""
    room_shift_px: float = 0.0


@dataclass(frozen=True, slots=True)
class Calibration:
    """Whether the cameras still stand where they did: what is wrong in a few words, "" for nothing.

    epipolar_px, spacing_mm: see `tracker.standing.Health`.
    """

    wrong: str = ""
    epipolar_px: float | None = None
    spacing_mm: float | None = None


@dataclass(frozen=True, slots=True)
class History:
    """The last two minutes, one value a second, the oldest first; None for a second without any."""

    poses: tuple[int, ...]
    gap_ms: tuple[float | None, ...]
    latency_ms: tuple[float | None, ...]
    nis_ratio: tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of one run.

    version: of this form.  sequence: grows by one each time.  t_ns: stream time [ns].  running_s: since the first
    frame [s].  ended: the run is over and this is its last word.
    """

    version: int
    sequence: int
    about: About
    t_ns: int
    running_s: float
    ended: bool
    track: Track
    pose: Pose | None
    rate: Rate
    latency: Latency
    nis: Nis
    calibration: Calibration
    balls: tuple[str, ...]
    cameras: tuple[CameraView, ...]
    rejected: dict[str, int]
    links: tuple[LinkState, ...]
    log: LogState | None
    far_ends: tuple[DialogueState, ...]
    history: History
    alarms: tuple[Alarm, ...]


def to_bytes(snapshot: Snapshot) -> bytes:
    """Return the snapshot as JSON; numbers that are not finite become null."""
    return orjson.dumps(snapshot)

"""What the loop's turns show beyond `bridge.monitor`: windows, histories, every camera and every ball."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass

from bridge.telemetry.bins import Bins
from bridge.wire import Sent
from tracker.rig import Rig
from tracker.standing import Health
from tracker.types import Estimate, Event, Frame, Rejected, Step, TrackState

RECENT = 256  # datagrams that the recent latencies are of
WINDOW = 10  # seconds
RATE_WINDOW_NS = 2_000_000_000
MOST_IN_WINDOW = 512


@dataclass(frozen=True, slots=True)
class Names:
    """What cameras and balls are called, and the clock offsets that the config gives the cameras [ms]."""

    cameras: tuple[str, ...]
    balls: tuple[str, ...]
    configured_offsets_ms: tuple[float, ...]


def names_of(rig: Rig) -> Names:
    """Return the names in a rig."""
    offsets_ms = tuple(camera.clock_offset_ns / 1e6 for camera in rig.cameras)
    balls = tuple(ball.name for ball in rig.marker.balls)
    return Names(tuple(camera.name for camera in rig.cameras), balls, offsets_ms)


class Gauges:
    """Gather what telemetry shows, a few microseconds a turn.

    Rates and gaps are counted by when poses leave, as the autopilot sees them, not by when their frames were taken.

    now_ns: stream time of the newest turn [ns].  newest: the last estimate.  state: the track's.
    health: what was last said of the calibration.
    gap_ever_ns: longest between two poses, None with fewer [ns].
    """

    def __init__(self, names: Names) -> None:
        self.names = names
        self.now_ns = 0
        self.newest: Estimate | None = None
        self.health: Health | None = None
        self.state = TrackState.SEARCHING
        self.last_rejection = ""
        self.bins = Bins(len(names.cameras), len(names.balls))
        self._first_ns: int | None = None
        self._state_ns = 0
        self.gap_ever_ns: int | None = None
        self._came_ns: deque[int] = deque(maxlen=MOST_IN_WINDOW)
        self._recent_ns: deque[int] = deque(maxlen=RECENT)
        self._frame_ns = [0] * len(names.cameras)
        self._used_ns = [[0] * len(names.balls) for _ in names.cameras]

    def take(self, event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int) -> None:
        """Enter one turn of the loop at stream time now_ns [ns]; time begins with the first frame or silence."""
        if self._first_ns is None:
            if event is None or isinstance(event, Rejected):
                return
            self._begin(now_ns)
        self.now_ns = max(now_ns, self.now_ns)
        here = self.bins.at(self.now_ns)
        if isinstance(event, Frame) and 0 <= event.camera < len(self._frame_ns):
            here.frames[event.camera] += 1
            self._frame_ns[event.camera] = self.now_ns
        if step.state is not self.state:
            self.state, self._state_ns = step.state, self.now_ns
        for sighting in step.sightings:
            here.seen[sighting.camera][sighting.ball] += 1
            self._used_ns[sighting.camera][sighting.ball] = self.now_ns
        self.health = step.health or self.health
        if step.rejections:
            last = step.rejections[-1]
            self.last_rejection = f"{last.reason.value}, {last.detail}"
        for estimate in step.estimates:
            self._take_estimate(estimate)
        for record in sent:
            if record.available_ns:
                latency_ns = record.sent_ns - record.available_ns
                self._recent_ns.append(latency_ns)
                here.latency_ns = max(here.latency_ns, latency_ns)

    def move_on(self, now_ns: int) -> None:
        """Enter that time went on and nothing happened."""
        if self._first_ns is not None and now_ns > self.now_ns:
            self.now_ns = now_ns
            self.bins.at(now_ns)

    @property
    def running_s(self) -> float:
        """Return the stream time since the first frame [s]."""
        return 0.0 if self._first_ns is None else (self.now_ns - self._first_ns) / 1e9

    @property
    def state_s(self) -> float:
        """Return for how long the track has been in its state [s]."""
        return (self.now_ns - self._state_ns) / 1e9 if self._first_ns is not None else 0.0

    @property
    def gap_now_ms(self) -> float | None:
        """Return the time since the newest estimate came, None before the first [ms]."""
        return (self.now_ns - self._came_ns[-1]) / 1e6 if self._came_ns else None

    def rate_hz(self) -> float:
        """Return the poses a second of the last two, 0 while there is no track [Hz]."""
        if self.state is not TrackState.TRACKING:
            return 0.0
        first = bisect_left(self._came_ns, self.now_ns - RATE_WINDOW_NS)
        count = len(self._came_ns) - first
        lasted_ns = self._came_ns[-1] - self._came_ns[first] if count else 0
        return (count - 1) * 1e9 / lasted_ns if lasted_ns else 0.0

    def age_ms(self) -> float | None:
        """Return how old the oldest pose of the last two seconds was when it left, by its frame's stamp [ms]."""
        ages_ns = [each.age_ns for each in self.bins.last(2) if each.poses]
        return max(ages_ns) / 1e6 if ages_ns else None

    def worst_gap_ms(self) -> float | None:
        """Return the longest gap of the window, the one going on included; None before the first estimate [ms]."""
        going_on_ms = self.gap_now_ms
        if going_on_ms is None:
            return None
        return max(going_on_ms, *(each.gap_ns / 1e6 for each in self.bins.last(WINDOW)))

    def recent_ms(self, *shares: float) -> list[float | None]:
        """Return the latencies that these shares of the newest datagrams do not exceed, None without any [ms]."""
        rising_ns = sorted(self._recent_ns)
        return [rising_ns[math.ceil(share * len(rising_ns)) - 1] / 1e6 if rising_ns else None for share in shares]

    @property
    def recent_is_whole(self) -> bool:
        """Say whether enough datagrams went for one of a hundred of them to mean something."""
        return len(self._recent_ns) == RECENT

    def nis(self) -> tuple[float, int]:
        """Return the sums of NIS and of degrees of freedom over the window's updates."""
        bins = self.bins.last(WINDOW)
        return sum(each.nis for each in bins), sum(each.dof for each in bins)

    def silent_ms(self, camera: int) -> float:
        """Return the time since a camera's last frame [ms]."""
        return (self.now_ns - self._frame_ns[camera]) / 1e6

    def blind_s(self, camera: int) -> float:
        """Return for how long a camera has given frames of which no ball was used, while tracking [s]."""
        used_s = self._since_used_s(self._used_ns[camera])
        return max(0.0, used_s - self.silent_ms(camera) / 1e3)

    def unseen_s(self, ball: int) -> float:
        """Return for how long no camera's sighting of a ball was used, while tracking [s]."""
        return self._since_used_s([camera[ball] for camera in self._used_ns])

    def _since_used_s(self, used_ns: list[int]) -> float:
        if self.state is not TrackState.TRACKING:
            return 0.0
        return (self.now_ns - max(self._state_ns, *used_ns)) / 1e9

    def _begin(self, now_ns: int) -> None:
        self._first_ns = self.now_ns = self._state_ns = now_ns
        self._frame_ns = [now_ns] * len(self._frame_ns)

    def _take_estimate(self, estimate: Estimate) -> None:
        here = self.bins.at(self.now_ns)
        here.poses += 1
        here.nis += estimate.nis
        here.dof += estimate.nis_dof
        here.age_ns = max(here.age_ns, self.now_ns - estimate.t_ns)
        if self._came_ns:
            gap_ns = self.now_ns - self._came_ns[-1]
            here.gap_ns = max(here.gap_ns, gap_ns)
            self.gap_ever_ns = max(self.gap_ever_ns or 0, gap_ns)
        self.newest = estimate
        self._came_ns.append(self.now_ns)

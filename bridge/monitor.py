"""The run's figures as they come in: rates, latencies, counts, all in bounded memory."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass

from bridge.alarms import Alarm
from bridge.dialogue import DialogueState
from bridge.histogram import Histogram
from bridge.status import Reading
from bridge.summary import ClockOffset, LogSummary, Summary
from bridge.wire import LinkState, Sent
from tracker.types import Estimate, Event, Frame, Step, TrackState

RATE_WINDOW_NS = 2_000_000_000
SEND = "send"
TOTAL = "frame to datagram"


@dataclass(frozen=True, slots=True)
class Tally:
    """What a run's turns come to, counted: see the fields of these names in `bridge.summary.Summary`."""

    estimates_sent: int
    rate_hz: float
    frames: Mapping[str, int]
    rejected: Mapping[str, int]
    lost: int
    resets: int


class Monitor:
    """Watch every turn of the loop.

    camera_names: names of the rig's cameras, for the frame counts.
    state: the track's, after the newest step.  last_rejection: what was left out last and why, "" for nothing.
    """

    def __init__(self, camera_names: tuple[str, ...]) -> None:
        self._names = camera_names
        self._frames: Counter[int] = Counter()
        self._rejected: Counter[str] = Counter()
        self.last_rejection = ""
        self._latency = Histogram()
        self._stages: defaultdict[str, Histogram] = defaultdict(Histogram)
        self._recent: deque[int] = deque()
        self._count = 0
        self._first_ns: int | None = None
        self._worst_gap_ns: int | None = None
        self._newest: Estimate | None = None
        self._ready_ns = 0  # stopwatch at the newest estimate's end
        self.state = TrackState.SEARCHING
        self._lost = 0
        self._resets = 0

    def take(self, event: Event | None, step: Step, sent: tuple[Sent, ...]) -> None:
        """Count one turn: the event (None at the end of all), what the tracker made of it, what left on the links."""
        if isinstance(event, Frame):
            self._frames[event.camera] += 1
        if step.rejections:
            self._rejected.update([rejected.reason.value for rejected in step.rejections])
            self.last_rejection = f"{step.rejections[-1].reason.value}, {step.rejections[-1].detail}"
        self._lost += step.state is TrackState.LOST and self.state is not TrackState.LOST
        self.state = step.state
        for estimate in step.estimates:
            self._take_estimate(estimate)
        newest_ns = None if self._newest is None else self._newest.t_ns
        for record in sent:
            if record.available_ns:
                self._latency.add(record.sent_ns - record.available_ns)
                if record.t_ns == newest_ns:  # the last stage: from the estimate's end to the kernel's taking it
                    self._stages[SEND].add(record.sent_ns - self._ready_ns)

    def _take_estimate(self, estimate: Estimate) -> None:
        if self._newest is None:
            self._first_ns = estimate.t_ns
        else:
            gap_ns = estimate.t_ns - self._newest.t_ns
            self._worst_gap_ns = max(gap_ns, self._worst_gap_ns or 0)
            self._resets += estimate.reset_counter != self._newest.reset_counter
        self._newest = estimate
        self._count += 1
        for name, duration_ns in estimate.stages_ns.items():
            self._stages[name].add(duration_ns)
        self._ready_ns = estimate.available_ns + sum(estimate.stages_ns.values())
        self._recent.append(estimate.t_ns)
        while estimate.t_ns - self._recent[0] > RATE_WINDOW_NS:
            self._recent.popleft()

    def durations(self) -> Mapping[str, Histogram]:
        """Return every stage by name, in order, and from frame to datagram under `TOTAL`."""
        return {**self._stages, TOTAL: self._latency}

    def reading(
        self,
        links: tuple[LinkState, ...],
        log: str,
        far_ends: tuple[DialogueState, ...] = (),
        alarms: tuple[Alarm, ...] = (),
    ) -> Reading:
        """Return what the status line shows now; alarms: those that stand, what matters most first."""
        spread = self._latency.percentiles()
        newest = self._newest
        shown = newest if self.state is TrackState.TRACKING else None
        return Reading(
            state=self.state.value,
            rate_hz=_rate_hz(len(self._recent), self._recent[-1] - self._recent[0]) if shown else 0.0,
            latency_p50_ms=spread.p50,
            latency_p99_ms=spread.p99,
            position_m=None if shown is None else (shown.p_BinW[0], shown.p_BinW[1], shown.p_BinW[2]),
            nis=None if shown is None or not shown.nis_dof else shown.nis / shown.nis_dof,
            links_up=sum(link.up for link in links),
            links=len(links),
            far_ends=tuple(far.brief for far in far_ends if far.brief),
            log=log,
            clocks={name: offset for name, offset in self._clocks(shown).items() if offset.is_certain},
            alarm=alarms[0].cause if alarms else "",
            alarms=len(alarms),
        )

    def _clocks(self, estimate: Estimate | None) -> dict[str, ClockOffset]:
        """Return the clocks of the cameras but the first as an estimate has them."""
        if estimate is None:
            return {}
        offsets = zip(self._names, estimate.clock_offsets_s, estimate.clock_sigmas_s, strict=False)
        return {name: ClockOffset(1e3 * float(offset), 1e3 * float(sigma)) for name, offset, sigma in [*offsets][1:]}

    def tally(self) -> Tally:
        """Return what was counted so far; without percentiles, so it costs little."""
        lasted_ns = 0 if self._newest is None or self._first_ns is None else self._newest.t_ns - self._first_ns
        return Tally(
            estimates_sent=self._count,
            rate_hz=_rate_hz(self._count, lasted_ns),
            frames={name: self._frames[index] for index, name in enumerate(self._names)},
            rejected=dict(sorted(self._rejected.items())),
            lost=self._lost,
            resets=self._resets,
        )

    def summary(
        self, links: tuple[LinkState, ...], log: LogSummary | None, far_ends: tuple[DialogueState, ...] = ()
    ) -> Summary:
        """Return the figures of the run so far."""
        tally = self.tally()
        return Summary(
            estimates_sent=tally.estimates_sent,
            rate_hz=tally.rate_hz,
            latency_ms=self._latency.percentiles(),
            stages_ms={name: histogram.percentiles() for name, histogram in self._stages.items()},
            worst_gap_ms=None if self._worst_gap_ns is None else self._worst_gap_ns / 1e6,
            frames=tally.frames,
            rejected=tally.rejected,
            lost=tally.lost,
            resets=tally.resets,
            clocks=self._clocks(self._newest),
            links=links,
            far_ends=far_ends,
            log=log,
        )


def _rate_hz(count: int, lasted_ns: int) -> float:
    """Return the mean rate of `count` instants whose first and last are so far apart."""
    return (count - 1) * 1e9 / lasted_ns if count > 1 and lasted_ns > 0 else 0.0

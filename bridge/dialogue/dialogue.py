"""The talk with the autopilot at the end of one link.

what comes in -> is it the autopilot? -> time, origin
each turn     -> heartbeat, questions, and which estimates may go
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bridge.dialogue.heading import ATTITUDE, HeadingWatch
from bridge.dialogue.news import Facts, News, Saturation
from bridge.dialogue.origin import Origin, OriginKeeper, Tellings
from bridge.dialogue.peer import Autopilot, Peer, PeerWatch
from bridge.dialogue.profile import AUTO, Profile, kept_apart, profile_for
from bridge.dialogue.streams import NOTHING, StreamKeeper, Wanted
from bridge.dialogue.timesync import CONVERGED_SAMPLES, TIMESYNC, SyncState, TimeSync
from bridge.pack import heartbeat
from bridge.wire import Message, Received
from tracker.types import Estimate, TrackState

HEARTBEAT_PERIOD_NS = 1_000_000_000
STALE_NS = 3_000_000_000  # without a word of the autopilot for this long, it is away


@dataclass(frozen=True, slots=True)
class Terms:
    """What the config says of the talk.

    profile: a profile's name, or auto.  messages: names that replace the profile's; None for the profile's own.
    vehicle_id: the vehicle's system id, None for the first autopilot heard.  origin: to be told, None for none.
    max_age_ns: an estimate older than this is not sent [ns].  streams: what the autopilot is to tell of itself.
    """

    profile: str = AUTO
    messages: tuple[str, ...] | None = None
    vehicle_id: int | None = None
    origin: Origin | None = None
    max_age_ns: int = 100_000_000
    streams: Wanted = NOTHING


@dataclass(frozen=True, slots=True)
class DialogueState:
    """What is known of the far end, for people and the log.

    peer: the autopilot, None while none was heard.  away: whether it has fallen silent.  profile: what it is sent.
    sync: its clock, None while unknown.  origin: how far the matter of its origin has come, "" where it needs none.
    holding: why no poses are sent at present, "" when they are.
    too_old, too_close: estimates not sent for their age, or because they followed the last one too closely.
    yaw: what is wrong with our yaw against the vehicle's motion, "" for nothing.
    strangers: messages of others than the autopilot.  unsigned: messages refused for want of a right signature.
    full: whether the link takes less than it is given.  streams: what the autopilot was asked to tell, "" for nothing.
    by_arrival: whether it counts a pose as of its arrival yet, as PX4 does until its TIMESYNC has had 500 answers.
    """

    peer: Peer | None
    away: bool
    profile: str
    sync: SyncState | None
    origin: str
    holding: str
    too_old: int
    too_close: int
    strangers: int
    unsigned: int = 0
    yaw: str = ""
    full: bool = False
    streams: str = ""
    by_arrival: bool = False

    @property
    def brief(self) -> str:
        """The far end in a word or two: the autopilot, whether it is silent, why it gets no poses."""
        who = "" if self.peer is None else str(self.peer.autopilot) + (" SILENT" if self.away else "")
        holding = f"NO POSES, {self.holding}" if self.holding else ""
        full = "LINK FULL" if self.full else ""
        return ", ".join(word for word in (who, holding, full, "YAW WRONG" if self.yaw else "") if word)

    def __str__(self) -> str:
        """The far end in a line."""
        return ", ".join(self._words())

    def _words(self) -> Iterator[str]:
        if self.peer is None:
            yield "no autopilot heard"
        else:
            yield f"{self.peer.autopilot}, system {self.peer.system_id}" + (", SILENT" if self.away else "")
            yield f"profile {self.profile}"
        if self.origin:
            yield f"origin {self.origin}"
        if self.yaw:
            yield f"YAW WRONG: {self.yaw}"
        if self.sync is not None:
            settled = "" if self.sync.converged else ", settling"
            yield f"clock {self.sync.offset_ns / 1e6:+.1f} +- {self.sync.spread_ms:.1f} ms{settled}"
            yield f"round trip {self.sync.rtt_ms:.1f} ms"
        if self.by_arrival:
            yield "it counts poses as of their arrival until its own time sync stands"
        if self.full:
            yield "LINK FULL: only the newest poses go, at the rate that fits"
        if self.streams:
            yield f"its streams: {self.streams}"
        counts = (
            (self.too_old, "too old"),
            (self.too_close, "too close"),
            (self.strangers, "messages of others"),
            (self.unsigned, "messages REFUSED, not signed with our key"),
        )
        yield from (f"{count} {what}" for count, what in counts if count)


class Dialogue:
    """One link's talk. It sends nothing itself: it says what is due.

    tellings: of origins, shared by the talks of one bridge; None for a talk alone.
    """

    def __init__(self, terms: Terms, tellings: Tellings | None = None) -> None:
        self._terms = terms
        self._watch = PeerWatch(terms.vehicle_id)
        self._sync = TimeSync()
        self._origin = OriginKeeper(terms.origin, Tellings() if tellings is None else tellings)
        self._heading = HeadingWatch()
        self._streams = StreamKeeper(terms.streams)
        self._news = News()
        self._saturation = Saturation()
        self._late = False
        self._heard_ns: int | None = None
        self._beat_due_ns: int | None = None
        self._last_pose_ns: int | None = None
        self._too_old = self._too_close = self._answered = 0

    @property
    def peer(self) -> Peer | None:
        """The autopilot, once it was heard."""
        return self._watch.peer

    @property
    def profile(self) -> Profile:
        """What the autopilot is sent at present."""
        return profile_for(self._terms.profile, None if self.peer is None else self.peer.autopilot)

    @property
    def messages(self) -> tuple[str, ...]:
        """The messages an estimate goes out as."""
        chosen, peer = self._terms.messages, self.peer
        if chosen is None:
            chosen = self.profile.messages
        return chosen if peer is None else kept_apart(chosen, peer.autopilot)

    def take(self, heard: Sequence[Received]) -> None:
        """Take what came in, in its order."""
        for message in heard:
            if not self._watch.takes(message):
                continue
            self._heard_ns = message.arrived_ns
            self._origin.take(message)
            self._streams.take(message)
            if message.message == ATTITUDE:
                self._heading.take(message)
            if message.message == TIMESYNC:
                self._take_time(message)

    def due(self, track: TrackState, now_ns: int, superseded: int = 0, calibration: str = "") -> list[Message]:
        """Return the messages besides poses that are due at stream time now_ns [ns].

        superseded: how many messages of this link a newer one has replaced so far.
        calibration: what is wrong with the cameras' stand in a few words, "" for nothing.
        """
        messages = []
        self._saturation.take(superseded, now_ns)
        if self._beat_due_ns is None or now_ns >= self._beat_due_ns:
            messages.append(heartbeat(now_ns))
            self._beat_due_ns = _next_beat(self._beat_due_ns, now_ns)
        peer = self.peer
        if peer is None:
            return messages
        request = self._sync.request(now_ns)
        if request is not None:
            messages.append(request)
        if self.profile.needs_origin or self._terms.origin is not None:
            messages += self._origin.due(peer, now_ns)
        asked = self._streams.due(peer, now_ns)
        if asked is None and self._streams.settled:
            asked = self._heading.due(peer, now_ns, self._streams.rate_hz(ATTITUDE))
        if asked is not None:
            messages.append(asked)
        return messages + self._news.due(self._facts(track, now_ns, calibration), now_ns)

    def admits(self, estimate: Estimate, now_ns: int) -> bool:
        """Say whether an estimate may go out now, and count it if not."""
        self._late = now_ns - estimate.t_ns > self._terms.max_age_ns
        if self._late:
            self._too_old += 1
            return False
        if self._holding():
            return False
        if self._last_pose_ns is not None and 0 <= estimate.t_ns - self._last_pose_ns < self.profile.spacing_ns:
            self._too_close += 1
            return False
        self._last_pose_ns = estimate.t_ns
        return True

    def watch(self, t_ns: int, v_N: Sequence[float], yaw: float) -> None:
        """Take our velocity [m/s] and yaw [rad] in north-east-down, to be held against the autopilot's tilt."""
        self._heading.take_pose(t_ns, v_N, yaw, self._watch.armed)

    def state(self, now_ns: int) -> DialogueState:
        """Return what is known of the far end."""
        origin = str(self._origin.state) if self.profile.needs_origin else ""
        return DialogueState(
            self.peer, self._is_away(now_ns), self.profile.name, self._sync.state(), origin, self._holding(),
            self._too_old, self._too_close, self._watch.strangers, yaw=self._heading.reading.alarm,
            full=self._saturation.now, streams=str(self._streams), by_arrival=self._by_arrival(),
        )  # fmt: skip

    def _take_time(self, message: Received) -> None:
        """Take a request of the autopilot, which the ear has answered, or a reply to ours."""
        if message.whole("tc1") == 0:
            self._answered += 1
            return
        self._sync.take(message)
        if self._sync.rebooted:
            self._answered = 0
            self._origin.start_anew()
            self._streams.start_anew()

    def _holding(self) -> str:
        """Say why poses are held back; an autopilot that can be told its origin is told before the first of them."""
        waits = self._terms.origin is not None and self.profile.needs_origin and not self._origin.settled
        return f"origin: {self._origin.state}" if waits else ""

    def _facts(self, track: TrackState, now_ns: int, calibration: str) -> Facts:
        """Return what the pilot may have to hear of."""
        sync = self._sync.state()
        restarts = 0 if sync is None else sync.restarts
        return Facts(
            track, self._late, self._is_away(now_ns), self._saturation.now, restarts, self._watch.other_autopilot,
            self._origin.state, self._heading.reading.brief, calibration,
        )  # fmt: skip

    def _by_arrival(self) -> bool:
        return self.peer is not None and self.peer.autopilot is Autopilot.PX4 and self._answered < CONVERGED_SAMPLES

    def _is_away(self, now_ns: int) -> bool:
        return self._heard_ns is not None and now_ns - self._heard_ns > STALE_NS


def _next_beat(due_ns: int | None, now_ns: int) -> int:
    """Return the next heartbeat's time: on the grid of the earlier ones, unless that is past already."""
    on_grid_ns = (now_ns if due_ns is None else due_ns) + HEARTBEAT_PERIOD_NS
    return on_grid_ns if on_grid_ns > now_ns else now_ns + HEARTBEAT_PERIOD_NS

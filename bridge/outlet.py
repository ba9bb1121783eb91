"""The outlet: every link, the talk with the autopilot at its end, and what each one is sent."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from bridge.clock import Nanoseconds
from bridge.dialect import Encoder, Identity
from bridge.dialogue import Dialogue, DialogueState, Ear, Tellings, Terms
from bridge.links import Deliver, Link, MemoryLink, open_link
from bridge.pack import MESSAGES, Packer
from bridge.signing import Seal, Signing
from bridge.wire import LinkState, Message, Received, Sent
from tracker.errors import OperatorError
from tracker.types import Estimate, Step

_KEPT_MESSAGES = 8192
DEFAULT_SYSTEM_ID = 1  # until an autopilot was heard, where the config names none


@dataclass(slots=True, eq=False)
class Spout:
    """One link and the talk over it.

    terms: of the talk.  encoder: the link's, which takes on the vehicle's system id if the terms name none.
    signing: of both directions, None for none.  tellings: of origins, shared by all links.
    """

    link: Link
    terms: Terms
    encoder: Encoder | None = None
    signing: Signing | None = None
    tellings: Tellings = field(default_factory=Tellings)
    dialogue: Dialogue = field(init=False)
    ear: Ear | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        """Begin the talk."""
        self.dialogue = Dialogue(self.terms, self.tellings)

    def hear(self) -> list[Received]:
        """Take in what has come since the last call, and return it."""
        heard = [] if self.ear is None else self.ear.take()
        if heard:
            self.dialogue.take(heard)
            peer = self.dialogue.peer
            if peer is not None and self.encoder is not None and self.terms.vehicle_id is None:
                self.encoder.speak_for(peer.system_id)
        return heard

    def state(self, now_ns: int) -> DialogueState:
        """Return what is known of the far end at stream time now_ns [ns]."""
        state = self.dialogue.state(now_ns)
        return state if self.signing is None else replace(state, unsigned=self.signing.refused)


class Outlet:
    """Send each estimate once to every link that may have it, and carry on the talk with each autopilot.

    spouts: open links, each with the terms of its talk.  packer: makes messages of estimates.
    seal: what the links sign with, let go of when they close; None for unsigned ones.
    """

    def __init__(self, spouts: Sequence[Spout], packer: Packer, seal: Seal | None = None) -> None:
        self._seal = seal
        self._spouts = tuple(spouts)
        self._packer = packer
        self._received: deque[tuple[str, Received]] = deque(maxlen=_KEPT_MESSAGES)
        self._now_ns = 0
        self._calibration = ""

    def listen(self, now: Nanoseconds) -> None:
        """Hear from now on what comes in. now: reads stream time [ns], from any thread."""
        for spout in self._spouts:
            if spout.ear is None:
                spout.ear = Ear(spout.link, now, spout.signing)

    def send(self, step: Step, now_ns: int) -> tuple[Sent, ...]:
        """Send what is due, and return what has left since the last call.

        An estimate goes out in the call that brings it, or never: a stale pose looks like a standing vehicle.

        Args:
            step: the tracker's newest step.
            now_ns: stream time now [ns].
        Returns:
            Records in the order of the links; links with a thread report a message in a later call.
        """
        self._now_ns = now_ns
        self._calibration = self._calibration if step.health is None else step.health.brief
        for spout in self._spouts:
            heard = spout.hear()
            if heard:
                self._received.extend([(spout.link.name, message) for message in heard])
            for message in spout.dialogue.due(step.state, now_ns, spout.link.replaced(), self._calibration):
                spout.link.send(message)
        for estimate in step.estimates:
            going = [spout for spout in self._spouts if spout.dialogue.admits(estimate, now_ns)]
            said = [(spout.link, spout.dialogue.messages) for spout in going]
            packed = self._packer.messages(estimate, {name for _, names in said for name in names})
            for link, names in said:
                for name in names:
                    link.send(packed[name])
            self._watch(estimate)
        return self._sent()

    def inlets(self) -> dict[str, Deliver]:
        """Return what lets bytes come in on each link that ends in this process, by its URI."""
        return {spout.link.name: spout.link.deliver for spout in self._spouts if isinstance(spout.link, MemoryLink)}

    def say(self, messages: Iterable[Message]) -> None:
        """Send messages that are no poses, over every link."""
        for message in messages:
            for spout in self._spouts:
                spout.link.send(message)

    def received(self) -> tuple[tuple[str, Received], ...]:
        """Return the messages that came in up to the last `send` and were not yet returned, with their link's URI."""
        return tuple([self._received.popleft() for _ in range(len(self._received))]) if self._received else ()

    def far_ends(self) -> tuple[DialogueState, ...]:
        """Return what was known of each link's far end at the last `send`, in the links' order."""
        return tuple(spout.state(self._now_ns) for spout in self._spouts)

    def link_states(self) -> tuple[LinkState, ...]:
        """Return how each link fares, in the order they were given."""
        return tuple(spout.link.state() for spout in self._spouts)

    def close(self) -> tuple[Sent, ...]:
        """Close every link, giving what waits a short time to leave; return what has left since the last `send`."""
        for spout in self._spouts:
            spout.link.close()
        if self._seal is not None:
            self._seal.close()
        return self._sent()

    def _watch(self, estimate: Estimate) -> None:
        """Hold an estimate that has gone against the motion of each vehicle that flies."""
        v_N, yaw = self._packer.motion(estimate)
        for spout in self._spouts:
            spout.dialogue.watch(estimate.t_ns, v_N, yaw)

    def _sent(self) -> tuple[Sent, ...]:
        return tuple([record for spout in self._spouts for record in spout.link.sent()])


def open_outlet(
    links: Sequence[tuple[str, Terms]],
    *,
    component_id: int,
    room_yaw_deg: float,
    stopwatch: Nanoseconds,
    seal: Seal | None = None,
) -> Outlet:
    """Open every link and make the outlet of them.

    Args:
        links: URIs (forms: `bridge.links.FORMS`), each with the terms of its talk.
        component_id: who speaks, see `bridge.dialect.Identity`; the system id is the vehicle's.
        room_yaw_deg: heading of the room's x axis, clockwise from north [deg].
        stopwatch: reads a running time [ns].
        seal: signs what goes out and is asked of what comes in; the outlet then owns it.  None for neither.
    Raises:
        OperatorError: a URI given twice, a message name not known, an id out of range, or a link that does not open.
    """
    _check(links)
    packer, tellings = Packer(room_yaw_deg), Tellings()
    spouts: list[Spout] = []
    try:
        for number, (uri, terms) in enumerate(links):
            known = DEFAULT_SYSTEM_ID if terms.vehicle_id is None else terms.vehicle_id
            signing = None if seal is None else seal.for_link(number)
            encoder = Encoder(Identity(known, component_id), signing)
            spouts.append(Spout(open_link(uri, encoder, stopwatch), terms, encoder, signing, tellings))
    except OperatorError:
        for spout in spouts:
            spout.link.close()
        if seal is not None:
            seal.close()
        raise
    return Outlet(spouts, packer, seal)


def _check(links: Sequence[tuple[str, Terms]]) -> None:
    uris = [uri for uri, _ in links]
    for uri, terms in links:
        messages = terms.messages or ()
        if uris.count(uri) > 1:
            raise OperatorError(f"link {uri}: given {uris.count(uri)} times; remove all but one")
        for name in messages:
            if name not in MESSAGES:
                raise OperatorError(f"link {uri}: message {name} is not known; known are {', '.join(MESSAGES)}")
        if len(set(messages)) != len(messages):
            raise OperatorError(f"link {uri}: messages {', '.join(messages)} must differ; remove the repeated one")

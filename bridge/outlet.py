"""The outlet: every link, what each one is sent, and the heartbeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bridge.clock import Nanoseconds
from bridge.links import Link, open_link
from bridge.pack import MESSAGES, Encoder, Identity, Packer, Reader, heartbeat
from bridge.wire import LinkState, Received, Sent
from tracker.errors import OperatorError
from tracker.types import Step

HEARTBEAT_PERIOD_NS = 1_000_000_000


@dataclass(slots=True, eq=False)
class _Spout:
    """One link with its message names, its reader, and when its next heartbeat is due (None: at once) [ns]."""

    link: Link
    messages: tuple[str, ...]
    reader: Reader
    heartbeat_due_ns: int | None = None


class Outlet:
    """Send each estimate once to every link, and a heartbeat a second of stream time.

    links: open links with the names (of `bridge.pack.MESSAGES`) each one is sent.
    packer: makes messages of estimates.
    """

    def __init__(self, links: Sequence[tuple[Link, tuple[str, ...]]], packer: Packer) -> None:
        self._spouts = [_Spout(link, messages, Reader()) for link, messages in links]
        self._packer = packer
        self._wanted = tuple(dict.fromkeys(name for _, messages in links for name in messages))

    def send(self, step: Step, now_ns: int) -> tuple[Sent, ...]:
        """Send what is due, and return what has left since the last call.

        An estimate goes out in the call that brings it, or never: a stale pose looks like a standing vehicle.

        Args:
            step: the tracker's newest step.
            now_ns: stream time now [ns].
        Returns:
            Records in the order of the links; links with a thread report a message in a later call.
        """
        for spout in self._spouts:
            if spout.heartbeat_due_ns is None or now_ns >= spout.heartbeat_due_ns:
                spout.link.send(heartbeat(now_ns))
                spout.heartbeat_due_ns = _next_beat(spout.heartbeat_due_ns, now_ns)
        for estimate in step.estimates:
            packed = self._packer.messages(estimate, self._wanted)
            for spout in self._spouts:
                for name in spout.messages:
                    spout.link.send(packed[name])
        return self._sent()

    def received(self) -> tuple[tuple[str, Received], ...]:
        """Return the messages that came in since the last call, each with its link's URI."""
        return tuple(
            (spout.link.name, message) for spout in self._spouts for message in spout.reader.feed(spout.link.receive())
        )

    def link_states(self) -> tuple[LinkState, ...]:
        """Return how each link fares, in the order they were given."""
        return tuple(spout.link.state() for spout in self._spouts)

    def close(self) -> tuple[Sent, ...]:
        """Close every link, giving what waits a short time to leave; return what has left since the last `send`."""
        for spout in self._spouts:
            spout.link.close()
        return self._sent()

    def _sent(self) -> tuple[Sent, ...]:
        return tuple(record for spout in self._spouts for record in spout.link.sent())


def _next_beat(due_ns: int | None, now_ns: int) -> int:
    """Return the next heartbeat's time: on the grid of the earlier ones, unless that is past already."""
    on_grid_ns = (now_ns if due_ns is None else due_ns) + HEARTBEAT_PERIOD_NS
    return on_grid_ns if on_grid_ns > now_ns else now_ns + HEARTBEAT_PERIOD_NS


def open_outlet(
    links: Sequence[tuple[str, tuple[str, ...]]],
    *,
    system_id: int,
    component_id: int,
    room_yaw_deg: float,
    stopwatch: Nanoseconds,
) -> Outlet:
    """Open every link and make the outlet of them.

    Args:
        links: URIs (forms: `bridge.links.FORMS`), each with the names of the messages it is sent.
        system_id, component_id: who speaks, see `bridge.pack.Identity`.
        room_yaw_deg: heading of the room's x axis, clockwise from north [deg].
        stopwatch: reads a running time [ns].
    Raises:
        OperatorError: a URI given twice, a message name not known, an id out of range, or a link that does not open.
    """
    _check(links)
    identity = Identity(system_id, component_id)
    packer = Packer(room_yaw_deg)
    opened: list[tuple[Link, tuple[str, ...]]] = []
    try:
        for uri, messages in links:
            opened.append((open_link(uri, Encoder(identity), stopwatch), messages))
    except OperatorError:
        for link, _ in opened:
            link.close()
        raise
    return Outlet(opened, packer)


def _check(links: Sequence[tuple[str, tuple[str, ...]]]) -> None:
    uris = [uri for uri, _ in links]
    for uri, messages in links:
        if uris.count(uri) > 1:
            raise OperatorError(f"link {uri}: given {uris.count(uri)} times; remove all but one")
        for name in messages:
            if name not in MESSAGES:
                raise OperatorError(f"link {uri}: message {name} is not known; known are {', '.join(MESSAGES)}")
        if len(set(messages)) != len(messages):
            raise OperatorError(f"link {uri}: messages {', '.join(messages)} must differ; remove the repeated one")

"""What every transport promises, asked of each on real sockets and pseudo-terminals."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter_ns

import pytest

from bridge.dialect import Encoder, Identity
from bridge.links import Encode, Link, open_link
from bridge.wire import Sent
from tests.bridge.estimates import beat
from tests.contracts.far_ends import NOTICED, UNNOTICED, FarEnd, UdpFar, eventually

Ends = tuple[Link, FarEnd]


def encoder() -> Encode:
    return Encoder(Identity(1))


@pytest.fixture(params=NOTICED + UNNOTICED, ids=lambda kind: kind.__name__)
def ends(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Ends]:
    far: FarEnd = request.param(tmp_path)
    link = open_link(far.uri, encoder(), perf_counter_ns)
    far.meet(link)
    yield link, far
    link.close()
    far.vanish()


def test_frames_arrive_whole_in_order_and_numbered_without_holes(ends: Ends) -> None:
    link, far = ends
    for k in range(300):
        link.send(beat(k))
        (frame,) = far.frames(1)
        assert (frame.sequence, frame.fields["custom_mode"]) == (k % 256, k)
    eventually(lambda: link.state().sent == 300)  # a link's thread writes first and keeps the books after
    assert link.state().dropped == 0


def test_a_record_is_made_of_each_frame_that_left(ends: Ends) -> None:
    link, far = ends
    raw = []
    for k in (10, 11):
        link.send(beat(k))
        raw += [frame.raw for frame in far.frames(1)]
    records: list[Sent] = []
    eventually(lambda: len(gather(records, link)) == 2)
    assert [record.raw for record in records] == raw
    assert [record.t_ns for record in records] == [10, 11]
    first, second = (record.sent_ns for record in records)
    assert 0 < first < second
    assert {record.link for record in records} == {link.name} == {far.uri}
    assert link.sent() == []


def test_receive_does_not_wait_and_returns_what_came(ends: Ends) -> None:
    link, far = ends
    assert link.receive() == b""
    link.send(beat(1))
    far.frames(1)
    far.write(b"from afar")
    came = bytearray()

    def all_came() -> bool:
        came.extend(link.receive())
        return len(came) >= len(b"from afar")

    eventually(all_came)
    assert came == b"from afar"


@pytest.mark.parametrize("ends", NOTICED, indirect=True)
def test_a_far_end_that_is_gone_is_reported_and_its_messages_are_counted(ends: Ends) -> None:
    link, far = ends
    link.send(beat(1))
    far.frames(1)
    far.vanish()
    eventually(lambda: send_and_look(link, lambda: not link.state().up and link.state().dropped > 0))
    assert link.state().reason
    assert link.receive() == b""
    far.come_back()


@pytest.mark.parametrize("ends", NOTICED, indirect=True)
def test_a_far_end_that_comes_back_gets_the_new_and_none_of_the_old(ends: Ends) -> None:
    link, far = ends
    far.vanish()
    eventually(lambda: send_and_look(link, lambda: not link.state().up))
    link.send(beat(1))
    far.come_back()
    eventually(lambda: send_and_look(link, lambda: link.state().up, beat_of=2))
    if not isinstance(far, UdpFar):
        far.meet(link)
    link.send(beat(3))
    assert far.frames(1)[0].fields["custom_mode"] in (2, 3)


@pytest.mark.parametrize("ends", UNNOTICED, indirect=True)
def test_a_far_end_whose_going_shows_nowhere_does_not_upset_the_link(ends: Ends) -> None:
    link, far = ends
    link.send(beat(1))
    far.vanish()
    link.send(beat(2))
    assert link.receive() == b""
    assert link.state().up
    far.come_back()


def test_a_closed_link_drops_what_it_is_given(ends: Ends) -> None:
    link, _ = ends
    link.close()
    link.close()
    link.send(beat(1))
    assert link.receive() == b""
    assert link.sent() == []
    state = link.state()
    assert (state.up, state.sent, state.dropped) == (False, 0, 1)
    assert link.name not in {thread.name for thread in threading.enumerate()}


def test_what_waits_leaves_before_the_link_closes(ends: Ends) -> None:
    link, far = ends
    link.send(beat(5))
    link.close()
    (frame,) = far.frames(1)
    assert frame.fields["custom_mode"] == 5
    assert [record.raw for record in link.sent()] == [frame.raw]


def test_each_link_counts_for_itself(ends: Ends) -> None:
    link, far = ends
    other = open_link("memory:other", encoder(), perf_counter_ns)
    for k in range(3):
        other.send(beat(k))
    link.send(beat(9))
    assert [frame.sequence for frame in far.frames(1)] == [0]


def gather(records: list[Sent], link: Link) -> list[Sent]:
    records += link.sent()
    return records


def send_and_look(link: Link, condition: Callable[[], bool], beat_of: int = 0) -> bool:
    link.send(beat(beat_of))
    return condition()

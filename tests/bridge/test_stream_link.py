"""A slow or stuck port behind a stream link: the newest leaves, the loop never waits."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter_ns

import pytest

from bridge.dialect import Encoder, Identity
from bridge.links import open_link
from bridge.links.ledger import Ledger
from bridge.links.stream import StreamLink
from bridge.pack import Packer, heartbeat
from tests.bridge.estimates import beat, estimate
from tests.bridge.mavlink_by_hand import parse
from tests.contracts.far_ends import SerialFar, eventually


class SluicePort:
    """A port whose line the test opens and shuts: `held` bytes lie in the kernel for as long as it says so."""

    low_water_bytes = 16
    poll_s = 0.001

    def __init__(self) -> None:
        self.held = 0
        self.written: list[bytes] = []
        self.is_open = True
        self._readable, self._silent = os.pipe()

    def fileno(self) -> int:
        return self._readable

    def write(self, data: bytes) -> None:
        self.written.append(data)

    def read(self) -> bytes:
        raise OSError("nothing is ever written here")

    def pending(self) -> int:
        return self.held

    def close(self) -> None:
        self.is_open = False
        os.close(self._readable)
        os.close(self._silent)

    def discard(self) -> None:
        self.close()


@pytest.fixture
def port() -> SluicePort:
    return SluicePort()


@pytest.fixture
def link(port: SluicePort) -> Iterator[StreamLink]:
    ledger = Ledger("serial:sluice:57600", Encoder(Identity(1)), itertools.count().__next__)
    link = StreamLink(port, SluicePort, ledger, retry_s=0.01)
    yield link
    link.close()


def test_a_slow_line_carries_the_newest_of_each_message_only(link: StreamLink, port: SluicePort) -> None:
    packer = Packer(0.0)
    port.held = 17
    link.send(heartbeat(0))
    for k in range(1, 11):
        for message in packer.messages(estimate(t_ns=k * 1000), ("VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP")).values():
            link.send(message)
    assert port.written == []
    port.held = 16
    eventually(lambda: link.state().sent == 3)
    frames = [parse(raw)[0] for raw in port.written]
    assert [frame.name for frame in frames] == ["HEARTBEAT", "VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP"]
    assert [frame.sequence for frame in frames] == [0, 1, 2]
    assert frames[1].fields["usec"] == frames[2].fields["time_usec"] == 10
    assert link.state().superseded == 18
    assert link.state().dropped == 0


def test_a_line_that_does_not_drain_goes_down_and_its_messages_are_thrown_away(
    link: StreamLink, port: SluicePort
) -> None:
    port.held = 100
    link.send(beat(1))
    eventually(lambda: not port.is_open)
    assert link.state().dropped == 1
    eventually(lambda: link.state().up)
    assert port.written == []


def test_closing_does_not_wait_for_a_line_that_does_not_drain(link: StreamLink, port: SluicePort) -> None:
    port.held = 100
    link.send(beat(1))
    link.close()
    assert not port.is_open
    assert (link.state().sent, link.state().dropped) == (0, 1)


def test_a_reader_that_stops_reading_brings_the_link_down_and_never_stops_the_loop(tmp_path: Path) -> None:
    far = SerialFar(tmp_path)
    link = open_link(far.uri, Encoder(Identity(1)), perf_counter_ns)

    def down_after_another() -> bool:
        link.send(beat(1))
        return not link.state().up

    eventually(down_after_another)
    assert "timeout" in link.state().reason.lower()
    assert link.state().dropped > 0
    link.close()
    far.vanish()

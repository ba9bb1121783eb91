"""A million messages that nobody should send: the loop goes on, nothing grows, nobody is believed who should not be."""

from __future__ import annotations

import os
from pathlib import Path
from time import perf_counter_ns

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.dialogue import Origin, Terms
from bridge.dialogue.streams import Wanted
from bridge.links import MemoryLink, open_link
from bridge.log.reader import LogReader
from bridge.outlet import Outlet, Spout
from bridge.pack import Packer
from bridge.signing import Signing
from bridge.signing.stamps import Stamps
from tests.bridge.tlogs import frames_in
from tests.system.staying_up.flight import Flight, Plan
from tests.system.staying_up.hostile import chunks

MILLION, CHUNK = 1_000_000, 1000
WARM = 200_000
GROWTH_BYTES = 8_000_000  # of the 800,000 after: ten bytes a message
TERMS = Terms("generic", ("VISION_POSITION_ESTIMATE",), None, Origin(32.1, 34.8, 30.0), 10**12, Wanted(50.0))
BEAT = Encoder(Identity(1, 1))(make_message("HEARTBEAT", 0, type=4, autopilot=3, base_mode=128), 0)
SECRET = bytes(range(32))


def spout(signing: Signing | None = None) -> tuple[Spout, MemoryLink]:
    encoder = Encoder(Identity(1), signing)
    link = open_link("memory:", encoder, perf_counter_ns)
    assert isinstance(link, MemoryLink)
    return Spout(link, TERMS, encoder, signing), link


def resident_bytes() -> int:
    """Return how much memory this process holds (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def poses_in(link: MemoryLink) -> int:
    return sum(message.message == "VISION_POSITION_ESTIMATE" for message in Reader().feed(b"".join(link.frames)))


def test_after_a_million_fuzzed_messages_the_loop_still_sends_every_pose_and_memory_has_not_grown() -> None:
    mouth, link = spout()
    held: list[int] = []

    def plan(flight: Flight) -> Plan:
        yield
        link.deliver(BEAT)
        for k, chunk in enumerate(chunks(MILLION, CHUNK, seed=4)):
            link.deliver(chunk)
            yield
            if (k + 1) * CHUNK in (WARM, MILLION):
                held.append(resident_bytes())
        far = flight.far()
        assert far.peer is not None
        assert far.peer.system_id == 1
        assert far.strangers > 100_000

    flight = Flight(rate_hz=1e9)
    flight.fly(plan, Outlet([mouth], Packer(0.0)))
    assert len(flight.frames_us) == MILLION // CHUNK + 1
    assert poses_in(link) == len(flight.frames_us)
    warm, end = held
    assert end - warm < GROWTH_BYTES


def test_fuzzed_messages_in_the_log_break_neither_it_nor_its_readers(tmp_path: Path) -> None:
    mouth, link = spout()

    def plan(_flight: Flight) -> Plan:
        for chunk in chunks(40_000, CHUNK, seed=5):
            link.deliver(BEAT + chunk)
            yield

    log = tmp_path / "a.mcap"
    flight = Flight(log=log, rate_hz=1e9)
    flight.fly(plan, Outlet([mouth], Packer(0.0)))
    state = flight.outlets.recorder and flight.outlets.recorder.state()
    assert state
    assert (state.error, state.dropped) == (None, 0)
    reader = LogReader(log)
    received = sum(record.topic.startswith("/mavlink/received/") for record in reader.records())
    assert received > 10_000
    assert reader.lost == ()
    tlog = log.with_suffix(".tlog").read_bytes()
    frames = frames_in(tlog)
    assert len(frames) == received + len(link.frames)
    assert sum(8 + len(frame) for frame in frames) == len(tlog)


def test_with_signing_nothing_fuzzed_is_heard_and_the_refused_are_counted(tmp_path: Path) -> None:
    stamps = Stamps(tmp_path / "stamp", 10**13, perf_counter_ns)
    mouth, link = spout(Signing(SECRET, 0, stamps))
    forger = Encoder(Identity(1, 1), Signing(bytes(32), 0, Stamps(tmp_path / "other", 10**13, perf_counter_ns)))
    forged = forger(make_message("HEARTBEAT", 0, type=4, autopilot=3), 0)

    def plan(flight: Flight) -> Plan:
        for chunk in chunks(60_000, CHUNK, seed=6):
            link.deliver(forged + chunk)
            yield
        far = flight.far()
        assert far.peer is None
        assert far.unsigned > 10_000

    flight = Flight(rate_hz=1e9)
    flight.fly(plan, Outlet([mouth], Packer(0.0)))
    assert link.state().sent >= len(flight.frames_us)

"""Telemetry: what is shown is what happened, and nobody who watches can hold the loop up."""

from __future__ import annotations

import socket

import pytest

from bridge.telemetry.parse import from_bytes
from bridge.telemetry.post import DATAGRAMS_PER_CHECK, HELLO, HOST, LISTENERS, Caller, Post, open_post
from bridge.telemetry.snapshot import MAX_BYTES, to_bytes
from tests.bridge.telemetry.turns import Run, quiet
from tracker.errors import OperatorError


@pytest.fixture
def post() -> Post:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HOST, 0))
    return Post(sock)


def test_a_snapshot_shows_what_happened() -> None:
    shown = Run().fly(100).telemetry.snapshot(quiet)
    assert shown.rate.poses == 100
    assert shown.rate.now_hz == pytest.approx(20.0)
    assert shown.rate.gap_recent_ms == pytest.approx(50.0)
    assert shown.latency.recent_p99_ms == pytest.approx(4.0)
    assert [stage.name for stage in shown.latency.stages] == ["send"]
    assert sum(shown.latency.total.counts) == 100
    assert sum(shown.history.poses) == 100


def test_a_snapshot_comes_back_from_its_bytes_as_it_was() -> None:
    shown = Run().fly(100).telemetry.snapshot(quiet)
    assert from_bytes(to_bytes(shown)) == shown


@pytest.mark.parametrize("data", [b"", b"\xff", b"[]", b"{}", b'{"version": 1}', b"hello"])
def test_what_is_no_snapshot_is_passed_over(data: bytes) -> None:
    assert from_bytes(data) is None


def test_a_snapshot_of_another_version_names_both() -> None:
    with pytest.raises(OperatorError, match="version 7, this monitor 1"):
        from_bytes(b'{"version": 7}')


def test_whoever_says_hello_is_told_and_whoever_falls_silent_is_forgotten(post: Post) -> None:
    run = Run(post)
    caller = Caller((post.port,), lambda: run.now_ns)
    assert caller.listen(0.0) == []
    run.fly(10)
    ((port, data),) = caller.listen(1.0)
    assert port == post.port
    shown = from_bytes(data)
    assert shown is not None
    assert 0 < shown.rate.poses <= 10
    assert post.anybody(run.now_ns)
    assert not post.anybody(run.now_ns + 3_000_000_001)
    caller.close()
    post.close()


def test_a_listener_that_never_reads_holds_nobody_up_and_costs_no_memory(post: Post) -> None:
    """Its socket's buffer fills; what does not fit is lost to it alone, and the loop's socket never blocks."""
    stalled = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    stalled.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    stalled.bind((HOST, 0))
    run = Run(post)
    for _ in range(40):
        stalled.sendto(HELLO, (HOST, post.port))
        run.fly(20)
    assert post.anybody(run.now_ns)
    assert run.telemetry.snapshot(quiet).rate.poses == 800
    stalled.close()
    post.close()


def test_a_flood_is_read_a_few_datagrams_a_look_and_its_senders_are_few(post: Post) -> None:
    callers = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(3 * LISTENERS)]
    for caller in callers:
        caller.sendto(HELLO, (HOST, post.port))
    for _ in range(5 * DATAGRAMS_PER_CHECK):
        callers[0].sendto(b"\x00" * 60_000, (HOST, post.port))
    run = Run(post)
    run.fly(2)
    left = 3 * LISTENERS + 5 * DATAGRAMS_PER_CHECK
    while post.anybody(run.now_ns) and left > 0:
        left -= DATAGRAMS_PER_CHECK
    told = 0
    run.fly(20)
    for caller in callers:
        caller.setblocking(False)
        told += _has_mail(caller)
        caller.close()
    assert told == LISTENERS
    post.close()


def _has_mail(sock: socket.socket) -> bool:
    try:
        return bool(sock.recv(MAX_BYTES))
    except BlockingIOError:
        return False


def test_two_bridges_on_one_computer_take_two_ports() -> None:
    first = open_post(0)
    assert first is not None
    second = open_post(first.port)
    assert second is not None
    assert second.port > first.port
    first.close()
    second.close()


def test_a_run_that_ends_says_so(post: Post) -> None:
    run = Run(post)
    caller = Caller((post.port,), lambda: run.now_ns)
    caller.listen(0.0)
    run.fly(10)
    run.telemetry.close(quiet)
    run.telemetry.close(quiet)
    shown = from_bytes(caller.listen(1.0)[-1][1])
    assert shown is not None
    assert shown.ended
    caller.close()

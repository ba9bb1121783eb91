"""The loopback between bridge and monitor: whoever calls is told, and nobody who calls can hold the bridge up."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import suppress

import pytest

from bridge.telemetry.post import DATAGRAMS_PER_CHECK, FORGET_NS, HELLO, HOST, LISTENERS, PORTS, Caller, Post, open_post
from tests.bridge.recordings import turns
from tests.bridge.telemetry.watched import Watched

FREE = 20_000


@pytest.fixture
def post() -> Iterator[Post]:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HOST, 0))
    made = Post(sock)
    yield made
    made.close()


def stranger() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HOST, 0))
    return sock


def test_a_caller_is_told_and_forgotten_once_it_falls_silent(post: Post) -> None:
    caller = Caller([post.port], lambda: 0)
    caller.listen(0.0)
    assert post.anybody(0)
    post.send(b"state")
    assert caller.listen(5.0) == [(post.port, b"state")]
    assert post.anybody(FORGET_NS)
    assert not post.anybody(FORGET_NS + 1)
    caller.close()


def test_what_is_no_hello_makes_nobody_a_listener(post: Post) -> None:
    with stranger() as sock:
        for data in (b"", b"hello", HELLO + b"x", b"\0" * 60_000):
            sock.sendto(data, (HOST, post.port))
    assert not post.anybody(0)


def test_no_more_listeners_than_a_few_are_kept(post: Post) -> None:
    socks = [stranger() for _ in range(LISTENERS + 3)]
    for sock in socks:
        sock.sendto(HELLO, (HOST, post.port))
        post.anybody(0)
    post.send(b"x")
    told = 0
    for sock in socks:
        sock.setblocking(False)
        with suppress(BlockingIOError):
            told += sock.recv(10) == b"x"
        sock.close()
    assert told == LISTENERS


def test_a_flood_costs_a_check_no_more_than_its_few_datagrams(post: Post) -> None:
    """What one check leaves waiting is there for the next: the loop is never held for the whole flood."""
    with stranger() as sock:
        for _ in range(2 * DATAGRAMS_PER_CHECK):
            sock.sendto(b"rubbish", (HOST, post.port))
        sock.sendto(HELLO, (HOST, post.port))
        assert [post.anybody(0) for _ in range(3)] == [False, False, True]


def test_a_listener_that_never_reads_loses_datagrams_and_the_bridge_goes_on(post: Post) -> None:
    with stranger() as sock:
        sock.sendto(HELLO, (HOST, post.port))
        assert post.anybody(0)
        for _ in range(2000):
            post.send(b"x" * 50_000)  # far more than any socket buffer takes: a blocking send would never come back


def test_a_watched_bridge_gives_a_snapshot_five_times_a_second_of_the_stopwatch(post: Post) -> None:
    caller = Caller([post.port], lambda: 0)
    caller.listen(0.0)
    watched = Watched(post=post)
    sequences: list[tuple[int, bytes]] = []
    for k, turn in enumerate(turns(60)):
        watched.now_ns = k * 20_000_000
        watched.fly(turn)
        sequences += caller.listen(5.0 if k % 10 == 5 else 0.0)
    caller.close()
    assert len(sequences) == 6


def test_the_last_word_is_said_at_the_end_and_twice_is_once(post: Post) -> None:
    caller = Caller([post.port], lambda: 0)
    caller.listen(0.0)
    watched = Watched(post=post)
    watched.fly(*turns(5))
    watched.telemetry.close(lambda: watched.around)
    watched.telemetry.close(lambda: watched.around)
    (_, data) = caller.listen(5.0)[-1]
    assert b'"ended":true' in data
    caller.close()


def test_eight_bridges_find_a_port_each_and_the_ninth_flies_unwatched() -> None:
    with stranger() as probe:
        first = probe.getsockname()[1]
    first = first if first + PORTS < 65_536 else FREE
    posts = [open_post(first) for _ in range(PORTS)]
    found = [each.port for each in posts if each is not None]
    assert len(set(found)) == len(found)
    assert set(found) <= set(range(first, first + PORTS))
    assert open_post(first) is None
    for each in posts:
        if each is not None:
            each.close()

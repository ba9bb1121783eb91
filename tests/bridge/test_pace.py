"""Recorded frames come when they were taken, none earlier, none lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bridge.clock import HostClock, StreamClock
from bridge.pace import Paced, first_time_ns
from tracker.types import Event, Frame, Reason, Rejected, Silence

IMAGE = np.zeros((2, 2, 3), dtype=np.uint8)
PERIOD_NS = 66_666_667


@dataclass
class Time:
    """Time that goes on only by waiting or by being told to; it is also the stopwatch."""

    now_ns: int = 1_000
    waits_s: list[float] = field(default_factory=list)

    def read(self) -> int:
        return self.now_ns

    def wait(self, seconds: float) -> None:
        self.waits_s.append(seconds)
        self.now_ns += max(1, round(seconds * 1e9))


def frames(*times_ns: int) -> list[Event]:
    return [Frame(index % 2, t_ns, IMAGE) for index, t_ns in enumerate(times_ns)]


def paced(events: list[Event], time: Time, wait: Callable[[float], bool | None] | None = None) -> Paced:
    origin_ns, stream = first_time_ns(events)
    return Paced(stream, HostClock(time.read, origin_ns), wait or time.wait, time.read)


def test_frames_come_as_far_apart_as_they_were_taken() -> None:
    time = Time()
    handed_over = [time.now_ns for _ in paced(frames(7, 7, 7 + PERIOD_NS, 7 + 3 * PERIOD_NS), time)]
    assert [t - handed_over[0] for t in handed_over] == [0, 0, PERIOD_NS, 3 * PERIOD_NS]


@given(
    gaps_ns=st.lists(st.integers(0, 10**9), min_size=1, max_size=20),
    work_ns=st.lists(st.integers(0, 10**9), min_size=20, max_size=20),
)
def test_no_frame_comes_early_and_none_is_lost_however_slow_the_reader(gaps_ns: list[int], work_ns: list[int]) -> None:
    time = Time()
    times_ns = [sum(gaps_ns[: n + 1]) for n in range(len(gaps_ns))]
    clock = HostClock(time.read, times_ns[0])
    got: list[int] = []
    for event, work in zip(Paced(frames(*times_ns), clock, time.wait, time.read), work_ns, strict=False):
        assert isinstance(event, Frame)
        assert clock.now_ns() >= event.t_ns
        got.append(event.t_ns)
        time.now_ns += work
    assert got == times_ns


def test_a_reader_that_falls_behind_gets_the_next_frame_at_once_and_the_lag_is_counted() -> None:
    time = Time()
    source = paced(frames(0, 10, 20, 1_000_000), time)
    stream = iter(source)
    next(stream)
    time.now_ns += 500
    next(stream)
    next(stream)
    assert time.waits_s == []
    assert (source.late, source.worst_lag_ns) == (2, 490)
    next(stream)
    assert len(time.waits_s) == 1


def test_the_wait_is_no_latency() -> None:
    time = Time()
    for event in paced(frames(0, PERIOD_NS), time):
        assert isinstance(event, Frame)
        assert event.available_ns == time.now_ns


def test_a_wait_that_ends_early_is_taken_up_again() -> None:
    time = Time()

    def impatient(seconds: float) -> None:
        time.wait(seconds / 2)

    clock = HostClock(time.read, 0)
    for event in Paced(frames(0, PERIOD_NS), clock, impatient, time.read):
        assert isinstance(event, Frame)
        assert clock.now_ns() >= event.t_ns
    assert len(time.waits_s) > 1


def test_the_stream_ends_when_the_wait_says_the_program_is_to_end() -> None:
    assert len(list(paced(frames(0, PERIOD_NS, 2 * PERIOD_NS), Time(), wait=lambda _: True))) == 1


def test_silences_are_paced_and_rejections_keep_their_place() -> None:
    rejected = Rejected(Reason.UNDECODABLE, "file")
    events: list[Event] = [rejected, Silence(50), rejected, *frames(100)]
    time = Time()
    got = list(paced(events, time))
    assert [type(event) for event in got] == [Rejected, Silence, Rejected, Frame]
    assert time.now_ns == 1_050


def test_looking_at_the_start_of_a_stream_loses_nothing() -> None:
    events: list[Event] = [Rejected(Reason.LATE, ""), *frames(5, 6)]
    start_ns, stream = first_time_ns(iter(events))
    assert start_ns == 5
    assert list(stream) == events
    nothing, empty = first_time_ns(events[:1])
    assert nothing is None
    assert list(empty) == events[:1]


def test_a_frame_that_takes_its_time_to_memory_comes_that_much_later() -> None:
    time, delay_ns = Time(), 30_000_000
    clock = HostClock(time.read, 7)
    came = [clock.now_ns() for _ in Paced(frames(7, 7 + PERIOD_NS), clock, time.wait, time.read, delay_ns)]
    assert came == [7 + delay_ns, 7 + PERIOD_NS + delay_ns]


def test_stream_time_is_when_the_newest_frame_is_in_memory() -> None:
    clock = StreamClock(delay_ns=30_000_000)
    for frame in (Frame(0, PERIOD_NS, IMAGE), Frame(1, 7, IMAGE)):
        clock.follow(frame)
    assert clock.now_ns() == PERIOD_NS + 30_000_000

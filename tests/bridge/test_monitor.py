"""The figures of a run, counted as it goes."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from bridge.monitor import Monitor
from bridge.summary import ClockOffset, LogSummary
from bridge.wire import LinkState, Sent
from tests.bridge.estimates import estimate, step
from tracker.types import Frame, Reason, Rejected, Step, TrackState, frozen_array

IMAGE = np.zeros((2, 2, 3), np.uint8)
PERIOD_NS = 66_666_667
MS = 1_000_000
UP = LinkState("udpout:127.0.0.1:1", True, "", 3, 0, 0)
DOWN = LinkState("serial:/dev/x:1", False, "gone", 1, 2, 0)


def monitor() -> Monitor:
    return Monitor(("left", "right"))


def sent(t_ns: int, sent_ns: int, available_ns: int, message: str = "ATT_POS_MOCAP") -> Sent:
    return Sent("memory:a", message, t_ns, sent_ns, available_ns, b"", {})


def flown(count: int, gap_after: int | None = None) -> Monitor:
    """Return a monitor of a flight at 15 Hz with one second's gap after the given estimate."""
    one, t_ns = monitor(), 0
    for k in range(count):
        t_ns += 1_000_000_000 if gap_after is not None and k == gap_after + 1 else PERIOD_NS
        one.take(Frame(k % 2, t_ns, IMAGE), step(estimate(t_ns=t_ns)), ())
    return one


def test_a_run_of_nothing_has_no_figures() -> None:
    summary = monitor().summary((), None)
    assert (summary.estimates_sent, summary.rate_hz, summary.worst_gap_ms) == (0, 0.0, None)
    assert summary.latency_ms.count == 0
    assert summary.frames == {"left": 0, "right": 0}
    assert summary.rejected == {}


def test_rate_and_worst_gap_are_of_stream_time() -> None:
    summary = flown(31).summary((), None)
    assert summary.estimates_sent == 31
    assert summary.rate_hz == pytest.approx(15.0, rel=1e-6)
    assert summary.worst_gap_ms == pytest.approx(66.666667)
    assert flown(31, gap_after=10).summary((), None).worst_gap_ms == 1000.0


def test_the_rate_shown_is_that_of_the_last_two_seconds() -> None:
    """After a gap of a second in 200 frames the status line is back at 15 Hz, the summary remembers."""
    one = flown(200, gap_after=100)
    assert one.reading((), "off").rate_hz == pytest.approx(15.0, rel=0.01)
    assert one.summary((), None).rate_hz == pytest.approx(199 / (198 / 15.0 + 1.0), rel=1e-6)


def test_frames_are_counted_by_camera_and_rejections_by_reason() -> None:
    one = monitor()
    late, gate = Rejected(Reason.LATE, "a"), Rejected(Reason.GATE, "b")
    for camera in (0, 1, 1):
        one.take(Frame(camera, 0, IMAGE), Step(TrackState.TRACKING, rejections=(late, gate, gate)), ())
    one.take(late, Step(TrackState.TRACKING, rejections=(late,)), ())
    one.take(None, Step(TrackState.TRACKING), ())
    summary = one.summary((), None)
    assert summary.frames == {"left": 1, "right": 2}
    assert summary.rejected == {"gate": 6, "late": 4}


def test_a_track_is_lost_once_however_long_it_stays_lost() -> None:
    one = monitor()
    S, T, L = TrackState.SEARCHING, TrackState.TRACKING, TrackState.LOST
    for state in (S, T, L, L, L, T, L, T):
        one.take(None, Step(state), ())
    assert one.summary((), None).lost == 2


def test_resets_are_changes_of_the_counter_and_it_may_wrap() -> None:
    one = monitor()
    for k, counter in enumerate((254, 254, 255, 0, 0, 1)):
        one.take(None, step(estimate(t_ns=k, reset_counter=counter)), ())
    assert one.summary((), None).resets == 3


def test_latency_runs_from_the_frame_in_memory_to_the_kernel_and_heartbeats_have_none() -> None:
    one = monitor()
    for k in range(1, 11):
        fix = estimate(t_ns=k, available_ns=1_000 * MS)
        one.take(None, step(fix), (sent(k, (1_000 + k) * MS, 1_000 * MS), sent(k, 9_999 * MS, 0, "HEARTBEAT")))
    latency = one.summary((), None).latency_ms
    assert latency.count == 10
    assert latency.max == 10.0
    assert latency.p50 == pytest.approx(5.0, rel=0.01)


def test_stages_add_up_to_the_latency() -> None:
    one = monitor()
    stages = MappingProxyType({"wait": 1 * MS, "track": 4 * MS})
    fix = replace(estimate(t_ns=5, available_ns=100 * MS), stages_ns=stages)
    one.take(None, step(fix), (sent(5, 107 * MS, 100 * MS),))
    summary = one.summary((), None)
    assert list(summary.stages_ms) == ["wait", "track", "send"]
    assert [spread.max for spread in summary.stages_ms.values()] == [1.0, 4.0, 2.0]
    assert summary.latency_ms.max == 7.0


def test_a_message_that_left_late_is_not_timed_against_another_estimate() -> None:
    one = monitor()
    first, second = (estimate(t_ns=k, available_ns=k * 100 * MS) for k in (1, 2))
    one.take(None, step(first), ())
    one.take(None, step(second), (sent(1, 210 * MS, 100 * MS),))
    summary = one.summary((), None)
    assert summary.latency_ms.max == 110.0
    assert "send" not in summary.stages_ms


def test_the_reading_shows_where_the_vehicle_is_only_while_it_is_tracked() -> None:
    one = monitor()
    fix = replace(estimate(t_ns=5, p_BinW=(1.0, 2.0, 3.0)), nis=6.0, nis_dof=12)
    one.take(None, step(fix), ())
    reading = one.reading((UP, DOWN), "3 MB")
    assert (reading.state, reading.position_m, reading.nis) == ("tracking", (1.0, 2.0, 3.0), 0.5)
    assert (reading.links_up, reading.links, reading.log) == (1, 2, "3 MB")
    one.take(None, Step(TrackState.LOST), ())
    reading = one.reading((), "off")
    assert (reading.state, reading.position_m, reading.rate_hz, reading.nis) == ("lost", None, 0.0, None)


def test_the_summary_passes_links_and_log_on() -> None:
    log = LogSummary("a.mcap", 5, 0)
    summary = monitor().summary((UP, DOWN), log)
    assert (summary.links, summary.log) == ((UP, DOWN), log)


def test_an_hour_takes_no_more_memory_than_a_minute() -> None:
    one = flown(2000)
    assert len(one._recent) <= 32


def test_clocks_are_told_by_camera_and_on_the_status_line_only_when_certain() -> None:
    watch = Monitor(("cam0", "cam1", "cam2"))
    offsets, sigmas = frozen_array((0.0, 0.5, 0.125)), frozen_array((0.0, 0.125, 0.25))
    watch.take(None, step(replace(estimate(), clock_offsets_s=offsets, clock_sigmas_s=sigmas)), ())
    assert watch.summary((), None).clocks == {"cam1": ClockOffset(500.0, 125.0), "cam2": ClockOffset(125.0, 250.0)}
    assert watch.reading((), "off").clocks == {"cam1": ClockOffset(500.0, 125.0)}


def test_clocks_that_are_not_estimated_are_not_told() -> None:
    watch = monitor()
    watch.take(None, step(estimate()), ())
    assert watch.summary((), None).clocks == {}
    assert watch.reading((), "off").clocks == {}

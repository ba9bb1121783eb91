"""The autopilot's clock: found through delays that vary, followed as it drifts, found anew when it starts anew."""

from __future__ import annotations

import numpy as np
import pytest

from bridge.dialogue.timesync import CONVERGED_SAMPLES, SyncState, TimeSync, answer
from tests.bridge.dialogue.far_autopilot import BASE_NS, from_autopilot, reply

PERIOD_NS = 66_000_000


def exchange(
    sync: TimeSync, count: int, *, start_ns: int = BASE_NS, offset_ns: float, skew_ppm: float = 0.0, seed: int = 1,
    slow_every: int = 0,
) -> int:  # fmt: skip
    """Ask and be answered over a line of 1 to 3 ms each way; return the last arrival [ns].

    offset_ns: our clock less the far one at start_ns.  skew_ppm: by which ours runs faster.
    """
    generator = np.random.default_rng(seed)
    arrived_ns = now_ns = start_ns
    for k in range(count):
        now_ns = start_ns + k * PERIOD_NS
        request = sync.request(now_ns)
        if request is None:
            continue
        there_ns, back_ns = (int(ms * 1e6) for ms in generator.uniform(1.0, 3.0, 2))
        if slow_every and k % slow_every == 0:
            back_ns += 30_000_000
        at_ns = now_ns + there_ns
        far_ns = at_ns - offset_ns - (at_ns - start_ns) * skew_ppm * 1e-6
        arrived_ns = at_ns + back_ns
        sync.take(reply(request, arrived_ns, int(far_ns)))
    return arrived_ns


def known(sync: TimeSync) -> SyncState:
    state = sync.state()
    assert state is not None
    return state


@pytest.mark.parametrize("offset_ns", [3_700_000_000.0, -2_000_000_000.0])
def test_offset_and_skew_are_found_within_the_lines_own_asymmetry(offset_ns: float) -> None:
    sync = TimeSync()
    end_ns = exchange(sync, 3000, offset_ns=offset_ns, skew_ppm=40.0)
    state = sync.state()
    assert state is not None
    true_ns = offset_ns + (end_ns - BASE_NS) * 40e-6
    assert abs(state.offset_ns - true_ns) < 100_000  # a thirtieth of the delay's spread
    assert state.skew_ppm == pytest.approx(40.0, abs=2.0)
    assert state.converged
    assert 2.0 < state.rtt_ms < 6.0
    # The offsets' own spread: half the difference of two uniform delays, 2 ms wide each.
    assert state.spread_ms == pytest.approx(2.0 / np.sqrt(24.0), rel=0.25)
    assert sync.ours_ns(end_ns - round(true_ns)) == pytest.approx(end_ns, abs=100_000)


def test_slow_replies_are_not_used() -> None:
    sync, clean = TimeSync(), TimeSync()
    exchange(sync, 600, offset_ns=1e9, slow_every=3)
    exchange(clean, 600, offset_ns=1e9)
    state, best = sync.state(), clean.state()
    assert state is not None
    assert best is not None
    assert state.refused == 200
    assert abs(state.offset_ns - 1_000_000_000) < 300_000


def test_replies_never_asked_for_are_not_used() -> None:
    sync = TimeSync()
    sync.take(from_autopilot("TIMESYNC", BASE_NS, tc1=5, ts1=BASE_NS - 1_000_000))
    assert sync.state() is None
    request = sync.request(BASE_NS)
    assert request is not None
    sync.take(reply(request, BASE_NS + 2_000_000, 7_000))
    sync.take(reply(request, BASE_NS + 3_000_000, 9_000_000_000))  # the same once more
    state = sync.state()
    assert state is not None
    assert (state.samples, state.refused) == (1, 2)


def test_a_far_clock_that_starts_anew_is_found_anew_at_once() -> None:
    sync = TimeSync()
    end_ns = exchange(sync, 600, offset_ns=1e9)
    request = sync.request(end_ns + 10**9)
    assert request is not None
    sync.take(reply(request, end_ns + 10**9 + 4_000_000, 1_200_000_000))  # it shows 1.2 s since its boot
    state = sync.state()
    assert sync.rebooted
    assert state is not None
    assert (state.samples, state.restarts) == (1, 1)
    assert state.offset_ns == end_ns + 10**9 + 2_000_000 - 1_200_000_000


def test_one_wild_reply_changes_nothing_and_six_in_a_row_are_believed() -> None:
    sync = TimeSync()
    end_ns = exchange(sync, 600, offset_ns=1e9)
    before = known(sync)
    for k in range(6):
        now_ns = end_ns + (k + 1) * 10**9
        request = sync.request(now_ns)
        assert request is not None
        sync.take(reply(request, now_ns + 2_000_000, now_ns + 1_000_000))
        if k < 5:
            assert known(sync).offset_ns == before.offset_ns
    assert known(sync).offset_ns == 0
    assert known(sync).restarts == 1


def asked(sync: TimeSync, start_ns: int, rtt_ns: int | None) -> int:
    """Let a second pass; return how many requests came. rtt_ns: round trip of their answers, None for no answers."""
    count = 0
    for t_ns in range(start_ns, start_ns + 1_000_000_000, 1_000_000):
        request = sync.request(t_ns)
        count += request is not None
        if request is not None and rtt_ns is not None:
            sync.take(reply(request, t_ns + rtt_ns, t_ns))
    return count


def test_requests_come_quickly_until_converged_and_then_five_a_second() -> None:
    assert asked(TimeSync(), BASE_NS, 2_000_000) == 50
    sync = TimeSync()
    exchange(sync, CONVERGED_SAMPLES + 1, start_ns=2 * BASE_NS, offset_ns=1e9)
    assert asked(sync, 20 * BASE_NS, None) == 5


@pytest.mark.parametrize("rtt_ns", [None, 12_000_000], ids=["silence", "57600 baud"])
def test_a_line_whose_answers_are_of_no_use_is_soon_asked_five_times_a_second_only(rtt_ns: int | None) -> None:
    sync = TimeSync()
    asked(sync, BASE_NS, rtt_ns)
    assert asked(sync, 2 * BASE_NS, rtt_ns) == 5
    assert asked(sync, 3 * BASE_NS, 2_000_000) > 40


def test_another_ones_request_is_answered_with_its_arrival_in_our_clock() -> None:
    message = answer(from_autopilot("TIMESYNC", 123_456_789, tc1=0, ts1=42))
    assert message is not None
    assert (message.fields["tc1"], message.fields["ts1"]) == (123_456_789, 42)
    assert answer(from_autopilot("TIMESYNC", 1, tc1=7, ts1=42)) is None
    assert answer(from_autopilot("HEARTBEAT", 1)) is None

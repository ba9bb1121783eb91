"""Telemetry: what a watcher is shown is what the loop did, in bounded size, live or from the log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import orjson
import pytest
from scipy.stats import chi2

from bridge.telemetry.bins import KEPT, Bins
from bridge.telemetry.compose import EDGES_MS, nis_band
from bridge.telemetry.gauges import Gauges, Names
from bridge.telemetry.logged import LoggedRun
from bridge.telemetry.parse import from_bytes
from bridge.telemetry.snapshot import MAX_BYTES, VERSION, to_bytes
from bridge.telemetry.states import LogState, Surroundings
from bridge.wire import LinkState, Sent
from tests.bridge.recordings import PERIOD_NS, START_NS, Turn, record, turns
from tests.bridge.telemetry.watched import UP, Watched
from tracker.errors import OperatorError
from tracker.types import Silence, Step, TrackState

SECOND_NS = 1_000_000_000
MS = 1_000_000


def test_a_snapshot_comes_off_the_wire_as_it_went_on() -> None:
    watched = Watched()
    watched.fly(*turns(90))
    snapshot = watched.snapshot()
    assert from_bytes(to_bytes(snapshot)) == snapshot


def test_rate_gaps_and_counts_are_those_of_the_turns() -> None:
    watched = Watched()
    flight = turns(120)
    watched.fly(*flight[:90])
    watched.fly(*((event, step, sent, now_ns + SECOND_NS) for event, step, sent, now_ns in flight[90:]))
    rate = watched.snapshot().rate
    assert rate.poses == 120
    assert rate.gap_ever_ms == pytest.approx(1000.0 + PERIOD_NS / 1e6)
    assert rate.now_hz == pytest.approx(15.0, rel=1e-3)  # the gap lies within the two seconds, and counts


def test_poses_of_the_history_add_up_to_all_of_the_last_two_minutes() -> None:
    watched = Watched()
    watched.fly(*turns(1500))
    assert sum(watched.snapshot().history.poses) == 1500


def test_the_histogram_holds_every_datagram() -> None:
    watched = Watched()
    watched.fly(*turns(700))
    total = watched.snapshot().latency.total
    assert sum(total.counts) == total.spread_ms.count == 700
    place = total.counts.index(700)  # all took exactly 5 ms
    assert EDGES_MS[place - 1] <= 5.0 <= EDGES_MS[place]


def test_a_log_tells_the_same_as_the_bridge_that_wrote_it(tmp_path: Path) -> None:
    watched, flight = Watched(), turns(300)
    watched.fly(*flight)
    record(tmp_path / "a.mcap", flight)
    live = watched.snapshot()
    (logged,) = LoggedRun(tmp_path / "a.mcap").snapshots()
    assert logged.rate == live.rate
    assert logged.track == live.track
    assert logged.latency.total == live.latency.total
    assert logged.nis.mean_ratio == pytest.approx(live.nis.mean_ratio)
    assert logged.pose is not None
    assert live.pose is not None
    assert logged.pose.position_m == pytest.approx(live.pose.position_m)
    assert [camera.clock_offset_ms for camera in logged.cameras] == [0.0, 250.0]


def test_a_file_without_the_calibration_is_no_log_of_ours(tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="no such file"):
        LoggedRun(tmp_path / "none.mcap")


def test_a_lost_track_is_said_while_nothing_comes() -> None:
    watched = Watched()
    watched.fly(*turns(90))
    end_ns = START_NS + 90 * PERIOD_NS
    for k in range(10):
        watched.wait(end_ns + k * SECOND_NS // 5, TrackState.LOST)
    assert "track_lost" in watched.names_of_alarms()
    assert watched.snapshot().rate.now_hz == 0.0


def slow(turn: Turn) -> Turn:
    """Return a turn whose datagrams took 90 ms more."""
    event, step, sent, now_ns = turn
    return event, step, tuple(each._replace(sent_ns=each.sent_ns + 90 * MS) for each in sent), now_ns


def test_a_slow_first_pose_is_no_alarm_and_slow_ones_all_along_are() -> None:
    flight = turns(600)
    for first, alarmed in ((1, False), (600, True)):
        watched = Watched()
        raised: set[str] = set()
        for each in (*map(slow, flight[:first]), *flight[first:]):
            watched.fly(each)
            raised |= watched.names_of_alarms()
        assert ("latency" in raised) is alarmed


def test_hostile_names_and_texts_never_outgrow_a_datagram() -> None:
    long = "\u2603" * 5000
    names = Names((long,) * 8, (long,) * 8, (0.0,) * 8)
    links = tuple(replace(UP, name=f"{k}{long}", up=False, reason=long) for k in range(50))
    watched = Watched(names, Surroundings(links, LogState(long, 1, 1, 1, long)))
    for k, (event, step, sent, now_ns) in enumerate(turns(4000)):
        late = tuple(each._replace(sent_ns=SECOND_NS * (1 + k % 7)) for each in sent)
        watched.fly((event, step, late, now_ns))
    assert len(to_bytes(watched.snapshot())) <= MAX_BYTES


def test_another_versions_snapshot_is_refused_in_a_line_and_rubbish_is_none() -> None:
    watched = Watched()
    watched.fly(*turns(3))
    value = orjson.loads(to_bytes(watched.snapshot()))
    with pytest.raises(OperatorError, match=f"version {VERSION + 1}"):
        from_bytes(orjson.dumps({**value, "version": VERSION + 1}))
    for rubbish in (
        b"",
        b"\xff\xfe",
        b"[]",
        b"{}",
        orjson.dumps({**value, "track": 3}),
        orjson.dumps({"version": "1"}),
    ):
        assert from_bytes(rubbish) is None


@pytest.mark.parametrize("dof", [6, 100, 1800])
def test_the_nis_band_is_chi_squares(dof: int) -> None:
    expected = chi2.ppf([0.025, 0.975], dof) / dof
    np.testing.assert_allclose(nis_band(dof), expected, rtol=1e-9)


def test_recent_latencies_are_those_that_their_shares_do_not_exceed() -> None:
    gauges = Gauges(Names(("cam0",), ("red",), (0.0,)))
    assert gauges.recent_ms(0.5, 0.99) == [None, None]
    slowest_first = tuple(Sent("memory:", "POSE", 1, k * MS, 1, b"", {}) for k in range(100, 0, -1))
    gauges.take(
        Silence(1),
        Step(TrackState.SEARCHING),
        tuple(sent._replace(sent_ns=sent.sent_ns + 1) for sent in slowest_first),
        1,
    )
    assert gauges.recent_ms(0.5, 0.99) == [50.0, 99.0]


def test_seconds_without_anything_are_empty_bins_and_old_ones_go() -> None:
    bins = Bins(1, 1)
    bins.at(0).poses = 7
    bins.at(5 * SECOND_NS).poses = 3
    assert [each.poses for each in bins.last(KEPT)] == [7, 0, 0, 0, 0, 3]
    bins.at(10**6 * SECOND_NS)
    assert [each.second for each in bins.last(KEPT)] == list(range(10**6 - KEPT + 1, 10**6 + 1))


def test_a_link_that_goes_down_is_said_after_its_time_and_taken_back() -> None:
    watched = Watched()
    down = LinkState("memory:a", False, "no such device", 1, 0, 0)
    flight = turns(200)
    watched.fly(*flight[:60])
    watched.around = Surroundings((down,))
    watched.fly(*flight[60:120])
    assert watched.names_of_alarms() == {"link_down", "camera_silent"}  # these turns are all of one camera
    watched.around = Surroundings((UP,))
    watched.fly(*flight[120:])
    assert watched.names_of_alarms() == {"camera_silent"}


def test_alarms_asked_for_late_are_those_of_who_asks_in_every_turn() -> None:
    """Readings wait to be judged together: they come out by their own time, in their order, and none is left."""
    down = LinkState("memory:a", False, "no such device", 1, 0, 0)
    asked, unasked = Watched(), Watched()
    for number, turn in enumerate(turns(200)):
        for watched in (asked, unasked):
            watched.around = Surroundings((down if 60 <= number < 160 else UP,))
            watched.fly(turn)
        asked.alarms()
        if number in (66, 97, 150, 163, 199):
            assert unasked.alarms() == asked.alarms()
            assert ("link_down" in asked.names_of_alarms()) is (97 <= number < 199)

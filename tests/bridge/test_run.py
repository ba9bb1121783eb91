"""The loop: every event to the tracker, every step to every outlet, once and in order."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bridge.clock import StreamClock
from bridge.dialogue import Terms
from bridge.log.reader import LogReader
from bridge.monitor import Monitor
from bridge.outlet import Outlet, open_outlet
from bridge.run import Outlets, close, run
from tests.bridge.estimates import estimate, step
from tests.bridge.recordings import recorder
from tracker.errors import OperatorError
from tracker.types import Event, Frame, Reason, Rejected, Silence, Step, TrackState

IMAGE = np.zeros((2, 2, 3), np.uint8)
SECOND_NS = 1_000_000_000
POSE = "VISION_POSITION_ESTIMATE"


class EveryFrame:
    """Estimate at each frame, one frame late: the last one comes at the end."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self._held: Frame | None = None

    def step(self, event: Event) -> Step:
        self.events.append(event)
        if isinstance(event, Rejected):
            return Step(TrackState.TRACKING, rejections=(event,))
        held, self._held = self._held, event if isinstance(event, Frame) else self._held
        return self._of(held if isinstance(event, Frame) else None)

    def finish(self) -> Step:
        return self._of(self._held)

    def _of(self, frame: Frame | None) -> Step:
        made = () if frame is None else (estimate(t_ns=frame.t_ns, available_ns=frame.available_ns),)
        return Step(TrackState.TRACKING, estimates=made)


def outlet() -> Outlet:
    return open_outlet(
        [("memory:a", Terms(messages=(POSE,), max_age_ns=10**12))],
        component_id=197,
        room_yaw_deg=0.0,
        stopwatch=lambda: 99,
    )


def events() -> list[Event]:
    made: list[Event] = [Frame(k % 2, (10 + k) * SECOND_NS, IMAGE, available_ns=k + 1) for k in range(4)]
    return [*made[:2], Rejected(Reason.UNDECODABLE, "x", 60 * SECOND_NS), Silence(12 * SECOND_NS - 1), *made[2:]]


def test_every_event_goes_through_tracker_links_monitor_and_log(tmp_path: Path) -> None:
    tracker, monitor = EveryFrame(), Monitor(("cam0", "cam1"))
    with recorder(tmp_path / "a.mcap") as log:
        outlets = Outlets(outlet(), monitor, log)
        run(events(), tracker, StreamClock(), outlets)
    assert [type(event) for event in tracker.events] == [Frame, Frame, Rejected, Silence, Frame, Frame]
    summary = outlets.summary("a.mcap")
    assert summary.estimates_sent == 4
    assert summary.frames == {"cam0": 2, "cam1": 2}
    assert summary.rejected == {"undecodable": 1}
    assert summary.latency_ms.count == 4
    assert summary.log is not None
    assert (summary.log.path, summary.log.dropped, summary.log.error) == ("a.mcap", 0, "")
    logged = list(LogReader(tmp_path / "a.mcap").records({"/estimate", f"/mavlink/sent/{POSE}"}))
    assert [record.value["t_ns"] for record in logged if record.topic == "/estimate"] == [
        k * SECOND_NS for k in range(10, 14)
    ]
    assert len(logged) == 8


def test_what_the_tracker_still_holds_at_the_end_is_sent() -> None:
    outlets = Outlets(outlet(), Monitor(("cam0",)))
    run([Frame(0, 5, IMAGE)], EveryFrame(), StreamClock(), outlets)
    assert outlets.summary(None).estimates_sent == 1


def test_closing_ends_links_and_log_in_order_and_twice_is_once(tmp_path: Path) -> None:
    clock = StreamClock()
    outlets = Outlets(outlet(), Monitor(("cam0", "cam1")), recorder(tmp_path / "a.mcap"))
    run(events(), EveryFrame(), clock, outlets)
    close(clock, outlets)
    close(clock, outlets)
    outlets.links.send(step(estimate(t_ns=99 * SECOND_NS)), 99 * SECOND_NS)
    assert outlets.links.link_states()[0].dropped > 0
    reader = LogReader(tmp_path / "a.mcap")
    assert len(list(reader.records({"/estimate"}))) == 4
    assert reader.lost == ()


def test_heartbeats_follow_stream_time_and_a_rejection_does_not_move_it() -> None:
    """Frames a second apart from 10 to 13 s: one each; the rejection in between says 60 s."""
    outlets = Outlets(outlet(), Monitor(("cam0", "cam1")))
    run(events(), EveryFrame(), StreamClock(), outlets)
    assert outlets.links.link_states()[0].sent == 4 + 4


def test_the_logs_state_is_told_in_a_word(tmp_path: Path, full_disk: Path) -> None:
    assert Outlets(outlet(), Monitor(())).log_state() == "off"
    with recorder(tmp_path / "a.mcap") as log:
        assert Outlets(outlet(), Monitor(()), log).log_state().endswith(" MB")
    with recorder(full_disk) as log:
        assert Outlets(outlet(), Monitor(()), log).log_state().startswith("STOPPED: log /dev/full: No space left")


def cut_off_by(end: BaseException) -> Iterator[Event]:
    """Yield frames and a rejection; amid the wait for more of them this happens."""
    yield from events()
    raise end


@pytest.mark.parametrize("end", [KeyboardInterrupt(), OperatorError("camera 1: unplugged")], ids=["Ctrl-C", "source"])
def test_what_the_tracker_still_holds_when_no_more_comes_is_sent_counted_and_logged(
    end: BaseException, tmp_path: Path
) -> None:
    outlets = Outlets(outlet(), Monitor(("cam0", "cam1")), recorder(tmp_path / "a.mcap"))
    with pytest.raises(type(end)):
        run(cut_off_by(end), EveryFrame(), StreamClock(), outlets)
    close(StreamClock(), outlets)
    assert outlets.summary(None).estimates_sent == 4
    assert len(list(LogReader(tmp_path / "a.mcap").records({"/estimate"}))) == 4


def test_a_tracker_that_was_cut_off_amid_an_event_is_asked_for_nothing_more() -> None:
    class CutOff(EveryFrame):
        def step(self, event: Event) -> Step:
            if len(self.events) == 3:
                raise KeyboardInterrupt
            return super().step(event)

        def finish(self) -> Step:
            raise AssertionError("half of an event is in it")

    outlets = Outlets(outlet(), Monitor(("cam0", "cam1")))
    with pytest.raises(KeyboardInterrupt):
        run(events(), CutOff(), StreamClock(), outlets)
    assert outlets.summary(None).estimates_sent == 1

"""What the log holds of the far end: every message, its clock and its state as they change, and their way back."""

from __future__ import annotations

import base64
import itertools
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log
from mcap.reader import make_reader

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.dialogue import Terms
from bridge.dialogue.peer import Autopilot, Peer
from bridge.dialogue.streams import Wanted
from bridge.heard import COUNTS_NS, LOOK_NS, MOST, Heard, Hearer
from bridge.links import MemoryLink, open_link
from bridge.log import received
from bridge.log.reader import LogReader
from bridge.outlet import Outlet, Spout
from bridge.pack import Packer
from bridge.telemetry.logged import LoggedRun
from bridge.wire import FieldValue, LinkState, Message
from tests.bridge.estimates import estimate, step
from tests.bridge.recordings import recorder
from tracker.types import Frame

FORMAT_PAGE = Path(__file__).parents[2] / "docs" / "log-format.md"
MS = 1_000_000
PERIOD_NS = 20 * MS
START_NS = 5_000_000_000
BOOTED_NS = 2_000_000_000
LINK = "memory:far"
IMAGE = np.zeros((2, 2, 3), np.uint8)


class Talk:
    """An outlet with one link, an autopilot at its end, and the hearer between outlet and log, 50 turns a second."""

    def __init__(self) -> None:
        encoder = Encoder(Identity(1))
        link = open_link(LINK, encoder, lambda: 7)
        assert isinstance(link, MemoryLink)
        self.link, self.now_ns = link, START_NS
        self.outlet = Outlet([Spout(link, Terms(streams=Wanted(50.0), max_age_ns=10**9), encoder)], Packer(0.0))
        self.outlet.listen(lambda: self.now_ns)
        self.hearer = Hearer()
        self._encode = Encoder(Identity(1, 1))

    def say(self, name: str, **fields: FieldValue) -> None:
        self.link.deliver(self._encode(make_message(name, 0, **fields), 3))

    def turns(self, count: int) -> Iterator[tuple[Any, ...]]:
        """Let turns pass; the autopilot beats and answers time requests. Yield what the recorder takes."""
        for _ in range(count):
            self.now_ns += PERIOD_NS
            now = step(estimate(self.now_ns))
            sent = self.outlet.send(now, self.now_ns)
            heard = self.hearer.take(self.outlet, self.now_ns)
            yield Frame(0, self.now_ns, IMAGE, 1), now, sent, self.now_ns, heard
            for request in Reader().feed(b"".join(each.raw for each in sent)):
                if request.message == "TIMESYNC":
                    self.now_ns += MS
                    self.say("TIMESYNC", tc1=self.now_ns - BOOTED_NS, ts1=request.whole("ts1"))
            if self.now_ns // PERIOD_NS % 25 == 0:
                self.say("HEARTBEAT", type=4, autopilot=3)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record four seconds, then silence of five."""
    path = tmp_path_factory.mktemp("heard") / "a.mcap"
    talk = Talk()
    with recorder(path) as log:
        for k, turn in enumerate(talk.turns(200)):
            log.take(*turn)
            talk.say("SERVO_OUTPUT_RAW", time_usec=k * 20_000, servo1_raw=1500 + k)
            talk.say("ATTITUDE", time_boot_ms=k * 20, roll=0.5)
        talk.say("STATUSTEXT", severity=2, text="PreArm: VisOdom: not healthy")
        for _ in range(250):
            talk.now_ns += PERIOD_NS
            sent = talk.outlet.send(step(), talk.now_ns)
            log.take(
                Frame(0, talk.now_ns, IMAGE, 1), step(), sent, talk.now_ns, talk.hearer.take(talk.outlet, talk.now_ns)
            )
    return path


def values(log: Path, topic: str) -> list[Any]:
    return [record.value for record in LogReader(log).records({topic})]


def test_every_message_that_came_is_there_decoded_and_whole_with_both_clocks(log: Path) -> None:
    servos = list(LogReader(log).records({"/mavlink/received/SERVO_OUTPUT_RAW"}))
    assert [record.value["fields"]["servo1_raw"] for record in servos] == list(range(1500, 1700))
    first = servos[0]
    assert (first.value["link"], first.value["system_id"], first.value["component_id"]) == (LINK, 1, 1)
    assert (first.value["autopilot_ns"], servos[1].value["autopilot_ns"]) == (0, 20_000_000)
    assert first.publish_ns == first.value["arrived_ns"] <= first.log_ns
    (message,) = Reader().feed(base64.b64decode(first.value["raw"]))
    assert dict(message.fields) == first.value["fields"]


def test_viewers_find_a_schema_for_what_came(log: Path) -> None:
    with log.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    schemas = {schema.name: schema.data for schema in summary.schemas.values()}
    assert b'"roll"' in schemas["posebridge.received.ATTITUDE"]
    assert {"posebridge.TimeSync", "posebridge.Autopilot", "posebridge.Link"} <= schemas.keys()


def test_the_time_sync_is_logged_at_each_exchange_and_aligns_the_clocks(log: Path) -> None:
    clocks = values(log, "/timesync")
    samples = [clock["samples"] for clock in clocks]
    assert samples == list(range(1, len(clocks) + 1))
    assert len(clocks) > 100
    assert clocks[-1]["offset_ns"] == pytest.approx(BOOTED_NS, abs=2 * MS)


def test_the_autopilots_state_is_logged_when_it_changes_and_not_otherwise(log: Path) -> None:
    states = values(log, "/autopilot")
    assert [state["autopilot"] for state in states[:2]] == ["", "ArduPilot"]
    assert [state["away"] for state in states][-1] is True
    assert all(a != b for a, b in itertools.pairwise(states))
    assert len(states) < 20


def test_monitor_of_a_log_tells_the_autopilots_state(log: Path) -> None:
    *_, last = LoggedRun(log).snapshots()
    (far,) = last.far_ends
    assert far.peer == Peer(1, 1, Autopilot.ARDUPILOT)
    assert (far.away, far.profile) == (True, "ardupilot")
    assert far.sync is not None
    assert far.sync.offset_ns == pytest.approx(BOOTED_NS, abs=2 * MS)
    assert "autopilot_silent" in {alarm.name for alarm in last.alarms}


def test_what_pilot_and_autopilot_were_told_stands_in_the_log_panel_in_words(log: Path) -> None:
    lines = [(value.level, value.name, value.message) for value in values(log, "/log")]
    assert (Log.ERROR, "system 1", "PreArm: VisOdom: not healthy") in lines
    assert (Log.INFO, f"to {LINK}", "posebridge: track tracking") in lines
    assert (Log.WARNING, f"to {LINK}", "posebridge: autopilot silent") in lines


def test_a_link_that_goes_down_and_up_is_told_in_the_log_panel_once_each() -> None:
    told: list[tuple[object, ...]] = []
    writer = received.HeardWriter(lambda *_: None, lambda *line: told.append(line[2:]))
    up = LinkState(LINK, True, "", 5, 0, 0)
    for state in (up, up, replace(up, up=False, reason="no device"), replace(up, up=False, reason="no device"), up):
        writer.write(Heard(links=(state,)), START_NS)
    assert told == [(Log.WARNING, LINK, "link down: no device"), (Log.INFO, LINK, "link up again")]


def test_the_manual_names_every_topic_and_field_of_the_far_end() -> None:
    manual = FORMAT_PAGE.read_text(encoding="utf-8")
    (message,) = Reader().feed(Encoder(Identity(1, 1))(make_message("ATTITUDE", 0), 0))
    for topic in (received.TIMESYNC, received.AUTOPILOT, received.LINK, received.received_topic(message)):
        assert f"`{topic.name.replace('ATTITUDE', 'NAME')}`" in manual
        assert [name for name in json.loads(topic.schema)["properties"] if f"`{name}`" not in manual] == []


@pytest.mark.parametrize(
    ("fields", "boot_ns"),
    [
        ({"time_boot_ms": 1500}, 1_500_000_000),
        ({"time_usec": 1500}, 1_500_000),
        ({"time_usec": 1_700_000_000_000_000}, -1),
        ({"time_boot_ms": 7, "time_unix_usec": 1_700_000_000_000_000}, 7_000_000),
        ({"lat": 7}, -1),
    ],
)
def test_the_autopilots_own_time_is_that_since_its_boot(fields: dict[str, FieldValue], boot_ns: int) -> None:
    assert received.autopilot_ns(fields) == boot_ns


def test_states_read_back_as_they_were() -> None:
    talk = Talk()
    talk.say("HEARTBEAT", type=4, autopilot=12)
    for _ in talk.turns(50):
        pass
    (state,), (link,) = talk.outlet.far_ends(), talk.outlet.link_states()
    assert received.autopilot_of(received.autopilot_value(LINK, state)) == replace(state, sync=None)
    assert state.sync is not None
    assert received.clock_of(received.clock_value(LINK, state.sync, 5)) == state.sync
    assert received.link_of(received.link_value(link)) == link


def test_a_flood_costs_the_log_its_oldest_and_that_is_told() -> None:
    talk, told = Talk(), list[tuple[object, ...]]()
    for k in range(MOST + 40):
        talk.say("SERVO_OUTPUT_RAW", servo1_raw=k)
    ((_, _, _, _, heard),) = talk.turns(1)
    kept = [message.fields.get("servo1_raw") for _, message in heard.received]
    assert (kept, heard.left_out) == (list(range(40, MOST + 40)), 40)
    received.HeardWriter(lambda *_: None, lambda *line: told.append(line[2:])).write(heard, START_NS)
    assert any("40 messages that came in are not in the log" in str(line) for line in told)


def test_counts_alone_are_told_once_a_second_and_everything_at_the_end() -> None:
    talk = Talk()
    told = [turn[-1].links for turn in talk.turns(150)]
    assert 3 <= sum(bool(links) for links in told) <= 1 + 150 * (PERIOD_NS + MS) // COUNTS_NS
    talk.now_ns += LOOK_NS // 2
    talk.outlet.say([Message("HEARTBEAT", 0, 0, make_message("HEARTBEAT", 0).fields)])
    ends = [talk.hearer.take(talk.outlet, talk.now_ns, last=True) for _ in range(2)]
    assert all(end.links and end.far_ends for end in ends), "viewers draw a state up to its last record"

"""The .tlog beside a log, read by pymavlink's own tools."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pymavlink
import pytest
from pymavlink import mavutil

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.heard import Heard
from bridge.pack import Packer
from bridge.wire import Received, Sent
from tests.bridge.estimates import estimate, step
from tests.bridge.recordings import LINK, START_NS, WALL_NS, recorder, turn
from tests.bridge.test_recorder import recording_process
from tracker.errors import OperatorError

SECOND_NS = 1_000_000_000
AUTOPILOT, BRIDGE = Encoder(Identity(1, 1)), Encoder(Identity(1))
POSE = "VISION_POSITION_ESTIMATE"


def came(k: int, t_ns: int) -> Received:
    raw = AUTOPILOT(make_message("ATTITUDE", 0, time_boot_ms=k, roll=0.25), k % 256)
    (message,) = Reader().feed(raw, t_ns)
    return message


def went(t_ns: int) -> Sent:
    message = Packer(0.0).messages(estimate(t_ns, (1.0, 2.0, 3.0)), (POSE,))[POSE]
    return Sent(LINK, POSE, t_ns, 5, 4, BRIDGE(message, 0), message.fields)


@pytest.fixture(scope="module")
def tlog(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fly 3 s at 15 Hz: a message comes 3 ms before each turn, a pose goes in it."""
    path = tmp_path_factory.mktemp("tlog") / "flight.tlog"
    now_ns = START_NS
    with recorder(path.with_suffix(".mcap"), tlog=path, wall_clock=lambda: WALL_NS + now_ns - START_NS) as log:
        for k in range(45):
            now_ns = START_NS + k * SECOND_NS // 15
            heard = Heard(received=((LINK, came(k, now_ns - 3_000_000)),))
            log.take(None, step(estimate(now_ns)), (went(now_ns),), now_ns, heard)
    return path


def test_pymavlink_reads_every_message_both_ways_in_the_order_of_their_times(tlog: Path) -> None:
    log = mavutil.mavlink_connection(str(tlog))
    read = []
    while (message := log.recv_match()) is not None:
        read.append(message)
    log.close()
    assert [message.get_type() for message in read] == ["ATTITUDE", POSE] * 45
    assert [message.get_srcComponent() for message in read[:2]] == [1, 197]
    assert [message.time_boot_ms for message in read[::2]] == list(range(45))
    assert read[1].x == 1.0
    times = [message._timestamp for message in read]
    assert times == sorted(times)


def test_its_times_are_the_wall_clocks_in_microseconds_big_end_first(tlog: Path) -> None:
    data = tlog.read_bytes()
    assert int.from_bytes(data[:8], "big") == (WALL_NS - 3_000_000) // 1000 // 4 * 4  # the last two bits: link 0
    assert data[8] == 0xFD


def test_mavlogdump_prints_the_link_that_it_is_asked_for(tlog: Path) -> None:
    tool = Path(pymavlink.__file__).parent / "tools" / "mavlogdump.py"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", str(tool), "--link", "0", "--types", POSE, str(tlog)],
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    assert len(lines) == 45
    assert f"{POSE} {{usec : {START_NS // 1000}, x : 1.0, y : -2.0, z : -3.0" in lines[0]


def test_a_killed_recorder_leaves_whole_records_up_to_its_last_second(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    with recording_process(path, 0) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if int(line) > START_NS + 3 * SECOND_NS:
                break
        process.kill()
        last_ns = max(map(int, process.stdout.read().split()[:-1]), default=int(line))
    data = path.with_suffix(".tlog").read_bytes()
    record_bytes = 8 + len(turn(0, np.random.default_rng(1))[2][0].raw)
    assert len(data) % record_bytes == 0
    last_us = int.from_bytes(data[-record_bytes : 8 - record_bytes], "big")
    assert last_ns - last_us * 1000 < SECOND_NS


def test_several_links_have_a_file_each_and_none_finds_losses_in_its_own(tmp_path: Path) -> None:
    """Each end counts its frames a link; in one file pymavlink would miss one before nearly every frame."""
    path, other = tmp_path / "a.tlog", "udpout:127.0.0.1:14551"
    with recorder(path.with_suffix(".mcap"), tlog=path, links=(LINK, other)) as log:
        for k in range(30):
            now_ns = START_NS + k * SECOND_NS // 15
            heard = Heard(received=((LINK, came(k, now_ns)), (other, came(k + 7, now_ns))))
            log.take(None, step(estimate(now_ns)), (), now_ns, heard)
    assert not path.exists()
    for number, first in ((0, 0), (1, 7)):
        read = mavutil.mavlogfile(str(path.with_suffix(f".{number}.tlog")))
        messages = [read.recv_match() for _ in range(30)]
        assert [message.time_boot_ms for message in messages] == list(range(first, first + 30))
        assert {message._link for message in messages} == {number}
        assert read.packet_loss() == 0.0
        read.close()


def test_where_one_links_file_exists_none_is_begun(tmp_path: Path) -> None:
    (tmp_path / "a.1.tlog").write_bytes(b"an earlier flight")
    with pytest.raises(OperatorError, match=r"a\.1\.tlog: the file exists"):
        recorder(tmp_path / "a.mcap", tlog=tmp_path / "a.tlog", links=(LINK, "udpout:127.0.0.1:14551"))
    assert [each.name for each in tmp_path.iterdir()] == ["a.1.tlog"]


def test_a_full_disk_ends_it_and_neither_log_nor_flight(full_disk: Path, tmp_path: Path) -> None:
    log = recorder(tmp_path / "a.mcap", tlog=full_disk)
    for k in range(30):
        now_ns = START_NS + k * SECOND_NS // 15
        log.take(None, step(), (went(now_ns),), now_ns)
    log.close()
    state = log.state()
    assert (state.written, state.dropped) == (30, 0)
    assert state.error is not None
    assert state.error.startswith(f"log {full_disk}: No space left on device")


def test_one_that_exists_is_kept_and_the_log_is_not_begun(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(b"an earlier flight")
    with pytest.raises(OperatorError, match=r"a\.tlog: the file exists"):
        recorder(tmp_path / "a.mcap", tlog=path)
    assert path.read_bytes() == b"an earlier flight"
    assert not (tmp_path / "a.mcap").exists()

"""The recorder: everything written once, nothing delayed, whatever the disk does."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from bridge.log.reader import LogReader
from tests.bridge.recordings import START_NS, Turn, record, recorder, turns
from tracker.errors import OperatorError
from tracker.types import Reason, Rejected, Silence, Step, TrackState

ROOT = Path(__file__).parents[2]
SECOND_NS = 1_000_000_000


def recording_process(path: Path, limit_bytes: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.bridge.recording_process", str(path), str(limit_bytes)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)


def estimate_times(path: Path) -> list[int]:
    return [record.value["t_ns"] for record in LogReader(path).records({"/estimate"})]


def taken_times(flight: list[Turn]) -> list[int]:
    return [step.estimates[0].t_ns for _, step, _, _ in flight]


def test_every_step_is_written_once_and_in_order(tmp_path: Path) -> None:
    flight = turns(500)
    log = recorder(tmp_path / "a.mcap", capacity=1)
    for one in flight:
        log.take(*one)
    log.close()
    assert estimate_times(tmp_path / "a.mcap") == taken_times(flight)
    assert (log.state().written, log.state().dropped, log.state().error) == (500, 0, None)
    assert log.state().size_bytes == (tmp_path / "a.mcap").stat().st_size


def test_a_killed_recorder_loses_less_than_a_second(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    with recording_process(path, 0) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if int(line) > START_NS + 5 * SECOND_NS:
                break
        process.kill()
        last_ns = max(map(int, process.stdout.read().split()[:-1]), default=int(line))
    reader = LogReader(path)
    arrivals = [record.log_ns for record in reader.records({"/estimate"})]
    assert last_ns - arrivals[-1] < SECOND_NS
    assert len(arrivals) == len(set(arrivals))
    assert reader.lost, "a log without an end must say so"


def test_a_disk_that_fills_up_ends_the_recording_but_not_the_flight(tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    with recording_process(path, 60_000) as process:
        assert process.stdout is not None
        taken, written, dropped, *error = process.stdout.read().splitlines()[-1].split()
        assert process.wait() == 0
    assert int(written) + int(dropped) == int(taken)
    assert int(dropped) >= 50
    assert "File too large; recording stopped after" in " ".join(error)
    assert len(estimate_times(path)) >= int(written) > 0


def test_a_disk_full_from_the_start_is_told_at_once_and_steps_are_taken_all_the_same(full_disk: Path) -> None:
    log = recorder(full_disk)
    assert "No space left on device" in str(log.state().error)
    for one in turns(20):
        log.take(*one)
    log.close()
    assert (log.state().written, log.state().dropped) == (0, 20)


def test_a_stalled_disk_costs_steps_and_not_time(tmp_path: Path) -> None:
    pipe, received, flight = tmp_path / "pipe", tmp_path / "received.mcap", turns(1500)
    os.mkfifo(pipe)
    reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    fcntl.fcntl(reading, fcntl.F_SETPIPE_SZ, 8192)  # room for the front of the log and little more
    log = recorder(pipe, block_when_full=False, capacity=8)
    for one in flight:
        log.take(*one)
    assert log.state().dropped > 1400
    os.set_blocking(reading, True)
    with os.fdopen(reading, "rb") as source:
        drain = threading.Thread(target=lambda: received.write_bytes(source.read()))
        drain.start()
        log.close()
        drain.join()
    state = log.state()
    assert state.written + state.dropped == 1500
    assert len(estimate_times(received)) == state.written
    reader = LogReader(received)
    warnings = [line.value.message for line in reader.records({"/log"}) if line.value.name == "recorder"]
    assert warnings
    assert all("steps dropped: the disk is too slow" in warning for warning in warnings)
    assert reader.metadata()["recorder"] == {"steps_written": str(state.written), "steps_dropped": str(state.dropped)}
    assert reader.lost == ()


def test_closing_twice_is_safe_and_what_comes_later_counts_as_dropped(tmp_path: Path) -> None:
    flight = turns(2)
    log = recorder(tmp_path / "a.mcap")
    log.take(*flight[0])
    log.close()
    log.close()
    log.take(*flight[1])
    assert (log.state().written, log.state().dropped) == (1, 1)


def test_a_log_that_is_being_written_is_not_replaced(tmp_path: Path) -> None:
    flight = turns(2)
    with recorder(tmp_path / "a.mcap") as log:
        log.take(*flight[0])
        with pytest.raises(OperatorError, match="another posebridge writes it just now; name another"):
            recorder(tmp_path / "a.mcap", overwrite=True)
        log.take(*flight[1])
    assert estimate_times(tmp_path / "a.mcap") == taken_times(flight)
    record(tmp_path / "a.mcap", flight[:1], overwrite=True)
    assert estimate_times(tmp_path / "a.mcap") == taken_times(flight[:1])


def test_a_log_of_nothing_is_whole(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", [])
    reader = LogReader(tmp_path / "a.mcap")
    assert list(reader.records()) == []
    assert reader.lost == ()


def test_a_file_that_exists_is_kept_unless_overwriting_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"a flight")
    with pytest.raises(OperatorError, match=r"exists \(8 bytes\) and is kept; name another or add --overwrite"):
        recorder(path)
    assert path.read_bytes() == b"a flight"
    record(path, turns(3), overwrite=True)
    assert len(estimate_times(path)) == 3


def test_a_path_that_cannot_be_a_log_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path, complaint in (
        (tmp_path, "is a directory"),
        (tmp_path / "missing" / "a.mcap", "does not exist; create it"),
        (tmp_path / "file" / "a.mcap", "cannot be written"),
        (tmp_path / ("x" * 300), "cannot be written"),
    ):
        for overwrite in (False, True):
            with pytest.raises(OperatorError, match=complaint) as caught:
                recorder(path, overwrite=overwrite)
            assert "\n" not in str(caught.value)


def test_frames_that_were_rejected_and_silence_are_recorded_too(tmp_path: Path) -> None:
    searching = Step(TrackState.SEARCHING)
    with recorder(tmp_path / "a.mcap") as log:
        log.take(Silence(5), searching, (), 5)
        log.take(Rejected(Reason.UNDECODABLE, "000001.png", 6, 1), searching, (), 7)
        passed_on = Rejected(Reason.WRONG_SIZE, "640 x 480 px", 8)
        log.take(passed_on, Step(TrackState.LOST, rejections=(passed_on,)), (), 9)
    records = list(LogReader(tmp_path / "a.mcap").records())
    rejections = [each for record in records if record.topic == "/rejections" for each in record.value["rejections"]]
    assert rejections == [
        {"reason": "undecodable", "detail": "000001.png", "t_ns": 6, "camera": 1},
        {"reason": "wrong_size", "detail": "640 x 480 px", "t_ns": 8, "camera": -1},
    ]
    assert [record.value.message for record in records if record.topic == "/log"] == ["searching", "searching -> lost"]

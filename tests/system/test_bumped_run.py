"""The pilot reads of a bumped camera: the real command flies a log of pictures, and what it sends is heard."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common

from bridge.heard import NOTHING
from tests.system.bumps import BUMP_S, CLOCKS, SETTINGS, Bump
from tests.system.flights import by_seconds
from tools.bench.trial import footage
from tools.calibrate.grade import Grade
from tools.calibrate.room.file import Record, read_config, write_room
from tools.calibrate.room.worth import Worth
from tools.cli import run_command_line
from tools.session import recorder_of
from tracker.scene import Knock
from tracker.types import Frame, Step, TrackState

LENGTH_S, FIRST_S = BUMP_S + 5.0, 9.0
MISSED_PX = 0.05  # what the calibration of the room held out, as simulated footage gives it


def pictures(bump: Bump, seconds: float, path: Path) -> Path:
    """Write a log of the first pictures of a flight."""
    settings = SETTINGS.with_frames("png", None)
    recorder = recorder_of(path, settings, bump.rig(), {"source": "sim:test"}, CLOCKS, block_when_full=True)
    start_ns: int | None = None
    for event in footage(bump.trial(), bump.rig(), by_seconds(bump.trouble)):
        assert isinstance(event, Frame)
        start_ns = event.t_ns if start_ns is None else start_ns
        if event.t_ns - start_ns > seconds * 1e9:
            break
        recorder.take(event, Step(TrackState.SEARCHING), (), event.t_ns, NOTHING)
    recorder.close()
    return path


def room_file(bump: Bump, path: Path) -> Path:
    """Write the room file of the rig as it stood when the room was calibrated."""
    worth = Worth(Grade.GOOD, (), 1.0, 2.0, 0.1, 0.4, MISSED_PX, MISSED_PX, ())
    record = Record("2026-01-01", "Ada", "camera:0,1,2", "spots")
    write_room(path, read_config("lab"), bump.rig().cameras, worth, record)
    return path


@pytest.fixture
def autopilot() -> Iterator[tuple[int, list[str]]]:
    """Answer on a port as an autopilot that beats with the bridge; what it is told in words goes into the list."""
    words: list[str] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 0))
        thread = threading.Thread(target=hear, args=(port, words))
        thread.start()
        yield port.getsockname()[1], words
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
            end.sendto(b"", port.getsockname())
        thread.join()


def hear(port: socket.socket, words: list[str]) -> None:
    """Listen until an empty datagram comes."""
    mavlink = common.MAVLink(None, srcSystem=1, srcComponent=1)
    beat = mavlink.heartbeat_encode(common.MAV_TYPE_HELICOPTER, common.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 0)
    while True:
        data, sender = port.recvfrom(2048)
        if not data:
            return
        for message in mavlink.parse_buffer(data) or ():
            if message.get_type() == "HEARTBEAT":
                port.sendto(beat.pack(mavlink), sender)
            elif message.get_type() == "STATUSTEXT":
                words.append(message.text)


def test_the_pilot_is_told_in_words_which_camera_was_bumped(
    tmp_path: Path, autopilot: tuple[int, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    port, words = autopilot
    seen = pictures(Bump(Knock(1, turn_deg=(0.2, 0.0, 0.0))), LENGTH_S, tmp_path / "pictures.mcap")
    link = f"udpout:127.0.0.1:{port}"
    assert run_command_line(["run", "--source", f"log:{seen}", "--link", link, "--pace", "fast", "--quiet"]) == 0
    assert words.count("posebridge: cam1 moved, poses poor: land") == 1
    capsys.readouterr()


@pytest.mark.parametrize(
    "knock",
    [None, Knock(1, turn_deg=(0.0, 0.2, 0.0)), Knock(2, shift_mm=(5.0, 0.0, 0.0))],
    ids=["fine", "turned", "aside"],
)
def test_before_take_off_the_pilot_is_told_which_camera_was_bumped_since_the_room_was_calibrated(
    knock: Knock | None, tmp_path: Path, autopilot: tuple[int, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    port, words = autopilot
    bump = Bump(knock, cameras=3, from_s=0.0)
    seen, room = pictures(bump, FIRST_S, tmp_path / "pictures.mcap"), room_file(bump, tmp_path / "room.toml")
    options = ["--config", str(room), "--source", f"log:{seen}", "--link", f"udpout:127.0.0.1:{port}"]
    assert run_command_line(["run", *options, "--pace", "fast", "--quiet"]) == 0
    told = [text for text in words if "calibrated" in text or "moved" in text]
    assert told[-1:] == ([] if knock is None else [f"posebridge: cam{knock.camera} not as calibrated: do not fly"])
    assert set(told[:-1]) <= {"posebridge: a camera not as calibrated: do not fly"}  # before it is clear which
    capsys.readouterr()

"""The real command on live cameras: JPEG over HTTP in, MAVLink over UDP out, ended by Ctrl-C."""

from __future__ import annotations

import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from bridge.log.reader import LogReader
from bridge.settings import shipped_configs
from tests.bridge.mavlink_by_hand import ByHand, parse
from tests.system.recordings import ROOT, command, summary_of
from tests.tracker.sources.mjpeg_server import MjpegCamera, jpegs_of
from tracker.sources.groundtruth import GroundTruth, read_ground_truth
from tracker.types import Array

IMAGES = 36
PATIENCE_S = 60.0  # for a machine under load
QUIET_S = 1 / 15  # a link so long without a datagram has said all about a pair
LEAST_POSES = 20
LIMIT_M = 0.020
POSE = "VISION_POSITION_ESTIMATE"
MOCAP = "ATT_POS_MOCAP"


@pytest.fixture
def cameras(lab_flight: Path) -> Iterator[tuple[MjpegCamera, MjpegCamera]]:
    """Serve the beginning of the flight on loopback, a pair at a time."""
    with MjpegCamera(jpegs_of(lab_flight, 0, IMAGES)) as left, MjpegCamera(jpegs_of(lab_flight, 1, IMAGES)) as right:
        yield left, right


@pytest.fixture
def config(lab_flight: Path, tmp_path: Path) -> Path:
    """Write a config whose calibration is the recording's."""
    text = shipped_configs()["lab"].read_text(encoding="utf-8")
    assert 'calibration = ""' in text
    path = tmp_path / "room.toml"
    path.write_text(text.replace('calibration = ""', f'calibration = "{lab_flight}"'), encoding="utf-8")
    return path


@contextmanager
def autopilot() -> Iterator[socket.socket]:
    """Listen where the run sends."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        yield listener


def burst(listener: socket.socket) -> list[ByHand]:
    """Wait for a datagram (heartbeats alone bring one a second) and return all until the link is quiet."""
    listener.settimeout(PATIENCE_S)
    messages = parse(listener.recv(2048))
    listener.settimeout(QUIET_S)
    while True:
        try:
            messages += parse(listener.recv(2048))
        except TimeoutError:
            return messages


def flown(cameras: tuple[MjpegCamera, MjpegCamera], listener: socket.socket) -> list[ByHand]:
    """Show the run one pair after another, each once it has answered the last, and return all it sent."""
    messages = burst(listener)  # it runs: the heartbeat, and what the first pair gives
    for _ in range(IMAGES - 1):
        for camera in cameras:
            camera.release()
        messages += burst(listener)
    return messages


def positions_inW(messages: list[ByHand], name: str) -> Array:
    """Return the positions (n, 3) that messages of one name tell, back from north-east-down at room_yaw 0 [m]."""
    ned = [[float(str(m.fields[axis])) for axis in "xyz"] for m in messages if m.name == name]
    return np.array(ned).reshape(-1, 3) * (1.0, -1.0, -1.0)


def off_path_m(p_BinW: Array, truth: GroundTruth) -> Array:
    """Return how far each position (n, 3) is from the nearest true one [m]."""
    path = truth.p_BinW[:IMAGES]
    distances: Array = np.linalg.norm(p_BinW[:, None] - path[None], axis=2).min(axis=1)
    return distances


def test_live_cameras_give_poses_on_the_true_path_until_ctrl_c(
    cameras: tuple[MjpegCamera, MjpegCamera], config: Path, lab_flight: Path, tmp_path: Path
) -> None:
    """Positions only: the cameras stamp by arrival, so at what time the vehicle was where is the test's doing."""
    log, summary = tmp_path / "live.mcap", tmp_path / "live.json"
    with autopilot() as listener:
        arguments = command(
            "--config", config, "--source", f"camera:{cameras[0].address};{cameras[1].address}",
            "--link", f"udpout:127.0.0.1:{listener.getsockname()[1]}", "--log", log, "--summary", summary,
        )  # fmt: skip
        with subprocess.Popen(
            arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            try:
                messages = flown(cameras, listener)
                process.send_signal(signal.SIGINT)
                _, errors = process.communicate(timeout=PATIENCE_S)
            finally:
                process.kill()
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    truth = read_ground_truth(lab_flight)
    for name in (POSE, MOCAP):
        p_BinW = positions_inW(messages, name)
        assert len(p_BinW) >= LEAST_POSES
        assert off_path_m(p_BinW, truth).max() < LIMIT_M
    times_us = [int(str(m.fields["usec"])) for m in messages if m.name == POSE]
    assert times_us == sorted(set(times_us))
    figures = summary_of(summary)
    assert figures["estimates_sent"] >= len(times_us)
    assert figures["log"]["error"] == ""
    reader = LogReader(log)
    logged = len(list(reader.records({"/estimate"})))
    assert figures["estimates_sent"] - logged in (0, 1), "only the turn that the signal cut short may be missing"
    assert reader.lost == ()

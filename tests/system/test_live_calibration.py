"""The real `calibrate intrinsics` on a live camera: JPEG over HTTP in, coverage told meanwhile, ended by Ctrl-C."""

from __future__ import annotations

import json
import queue
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import IO

import cv2
import pytest

from tests.system.recordings import ROOT
from tests.tools.calibrate.boards import K, picture_of, poses
from tests.tracker.sources.mjpeg_server import MjpegCamera
from tools.calibrate.board import BoardKind, make_board

VIEWS = 24
QUIET_S = 0.5  # a command so long without a line has said all about a picture
PATIENCE_S = 120.0  # for a machine under load
BOARD = make_board(BoardKind.CHARUCO, "9x6", 25.0)
TOLD = re.compile(r"cam0 (\d+) views, (\d+) % of 8 x 6, next: [a-z ]+")


@pytest.fixture
def camera() -> Iterator[MjpegCamera]:
    """Serve the board from many places."""
    pictures = [picture_of(BOARD, pose, k) for k, pose in enumerate(poses(BOARD, VIEWS, 3))]
    with MjpegCamera([cv2.imencode(".jpg", picture)[1].tobytes() for picture in pictures]) as served:
        yield served


def lines_of(stream: IO[str]) -> queue.Queue[str]:
    """Return the lines of a stream as they come."""
    lines: queue.Queue[str] = queue.Queue()

    def read() -> None:
        for line in stream:
            lines.put(line)

    threading.Thread(target=read, daemon=True).start()
    return lines


def shown(camera: MjpegCamera, lines: queue.Queue[str]) -> list[str]:
    """Show one picture after another, each once the command has said all about the last; return what it said."""
    said = [lines.get(timeout=PATIENCE_S)]
    for _ in range(VIEWS):
        try:
            while True:
                said.append(lines.get(timeout=QUIET_S))
        except queue.Empty:
            camera.release()
    return said


def test_a_live_camera_is_calibrated_and_its_coverage_told_meanwhile(camera: MjpegCamera) -> None:
    arguments = ["--source", f"camera:{camera.address}", "--corners", "9x6", "--square_mm", "25", "--json"]
    with subprocess.Popen(
        [sys.executable, "-m", "tools", "calibrate", "intrinsics", *arguments],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        try:
            assert process.stdout is not None
            assert process.stderr is not None
            said = shown(camera, lines_of(process.stderr))
            process.send_signal(signal.SIGINT)
            figures = json.loads(process.stdout.read())
            process.wait(timeout=PATIENCE_S)
        finally:
            process.kill()
    told = [match for line in said if (match := TOLD.search(line)) is not None]
    views, covered = ([int(match[k]) for match in told] for k in (1, 2))
    assert views == list(range(1, len(views) + 1))
    assert len(views) >= 0.7 * VIEWS
    assert covered == sorted(covered)
    assert covered[-1] >= 50
    assert process.returncode == 0
    (found,) = figures["cameras"]
    for value, sigma, true in zip(
        found["intrinsics_px"], found["sigmas_px"], K[[0, 1, 0, 1], [0, 1, 2, 2]], strict=True
    ):
        assert abs(value - true) < 4.0 * sigma

"""A run that is killed keeps its log but for the last second."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

from bridge.log.reader import LogReader
from tests.bridge.mavlink_by_hand import parse
from tests.system.recordings import ROOT, command

SECOND_US = 1_000_000


def test_a_killed_run_can_be_exported_up_to_its_last_second(lab_flight: Path, tmp_path: Path) -> None:
    """The autopilot's end knows what was sent; the log must hold all of it but for the last second."""
    log = tmp_path / "a.mcap"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.settimeout(30.0)
        link = f"udpout:127.0.0.1:{autopilot.getsockname()[1]}"
        arguments = command("--source", f"recording:{lab_flight}", "--link", link, "--log", log, "--quiet")
        with subprocess.Popen(arguments, cwd=ROOT) as process:
            sent_us: list[int] = []
            while not sent_us or sent_us[-1] - sent_us[0] < 3 * SECOND_US:
                sent_us += poses_us(autopilot.recv(2048))
            process.kill()
        autopilot.setblocking(False)
        while datagram := received(autopilot):
            sent_us += poses_us(datagram)
    table = tmp_path / "a.tum"
    done = subprocess.run(
        [sys.executable, "-m", "tools", "export", str(log), "--format", "tum", "--out", str(table)],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    seconds = [line.split()[0] for line in table.read_text(encoding="ascii").splitlines() if not line.startswith("#")]
    kept_us = [int(whole) * SECOND_US + int(part) // 1000 for whole, part in (s.split(".") for s in seconds)]
    expected_us = sorted(set(sent_us))
    assert kept_us == sorted(set(kept_us))
    assert expected_us[-1] - kept_us[-1] <= SECOND_US
    assert [t for t in expected_us if t <= kept_us[-1]] == kept_us
    assert len(kept_us) >= 30
    reader = LogReader(log)
    list(reader.records())
    assert reader.lost, "a log without an end must say so"


def poses_us(datagram: bytes) -> list[int]:
    """Return the times of the poses in a datagram [us]."""
    frames = [frame for frame in parse(datagram) if "usec" in frame.fields]
    return [int(str(frame.fields["usec"])) for frame in frames]


def received(autopilot: socket.socket) -> bytes:
    try:
        return autopilot.recv(2048)
    except BlockingIOError:
        return b""

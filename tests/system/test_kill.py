"""A run that is killed keeps its log but for the last second."""

from __future__ import annotations

import base64
import socket
import subprocess
import sys
from pathlib import Path

from bridge.log.reader import LogReader
from tests.bridge.mavlink_by_hand import parse
from tests.bridge.tlogs import frames_in
from tests.system.recordings import ROOT, command

SECOND_US = 1_000_000


def test_a_killed_run_can_be_exported_up_to_its_last_second(lab_flight: Path, tmp_path: Path) -> None:
    """The autopilot's end knows what was sent; the log must hold all of it but for the last second.

    It holds more: an estimate that came too late to be sent, as on a computer that is busy, is logged all the same.
    """
    log = tmp_path / "a.mcap"
    patient = tmp_path / "patient.toml"  # a busy computer may be late here; what is tested is the log
    patient.write_text((ROOT / "config" / "lab.toml").read_text().replace("max_age_ms = 100.0", "max_age_ms = 60000.0"))
    sent = killed_after(3 * SECOND_US, lab_flight, log, patient)
    kept_us = exported_us(log, tmp_path / "a.tum")
    expected_us = poses_us(b"".join(sent))
    assert kept_us == sorted(set(kept_us))
    assert expected_us[-1] - kept_us[-1] <= SECOND_US
    assert {t for t in expected_us if t <= kept_us[-1]} <= set(kept_us)
    reader = LogReader(log)
    logged = [base64.b64decode(record.value["raw"]) for record in reader.records() if "/sent/" in record.topic]
    assert len(logged) >= 60
    assert b"".join(sent).startswith(b"".join(logged))
    tlog = b"".join(frames_in(log.with_suffix(".tlog").read_bytes()))
    assert b"".join(sent).startswith(tlog)
    assert expected_us[-1] - poses_us(tlog)[-1] <= SECOND_US
    assert reader.lost, "a log without an end must say so"


def killed_after(span_us: int, recording: Path, log: Path, config: Path) -> list[bytes]:
    """Kill a run once it has sent poses over a span [us]; return the datagrams that its autopilot got."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.settimeout(30.0)
        link = f"udpout:127.0.0.1:{autopilot.getsockname()[1]}"
        arguments = command(
            "--config", config, "--source", f"recording:{recording}", "--link", link, "--log", log, "--quiet"
        )
        with subprocess.Popen(arguments, cwd=ROOT) as process:
            datagrams: list[bytes] = []
            sent_us: list[int] = []
            while not sent_us or sent_us[-1] - sent_us[0] < span_us:
                datagrams.append(autopilot.recv(2048))
                sent_us += poses_us(datagrams[-1])
            process.kill()
        autopilot.setblocking(False)
        while datagram := received(autopilot):
            datagrams.append(datagram)
    return datagrams


def exported_us(log: Path, table: Path) -> list[int]:
    """Export a log as TUM and return the times of its rows [us]."""
    done = subprocess.run(
        [sys.executable, "-m", "tools", "export", str(log), "--format", "tum", "--out", str(table)],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    seconds = [line.split()[0] for line in table.read_text(encoding="ascii").splitlines() if not line.startswith("#")]
    return [int(whole) * SECOND_US + int(part) // 1000 for whole, part in (s.split(".") for s in seconds)]


def poses_us(datagram: bytes) -> list[int]:
    """Return the times of the poses in a datagram [us]."""
    frames = [frame for frame in parse(datagram) if "usec" in frame.fields]
    return [int(str(frame.fields["usec"])) for frame in frames]


def received(autopilot: socket.socket) -> bytes:
    try:
        return autopilot.recv(2048)
    except BlockingIOError:
        return b""

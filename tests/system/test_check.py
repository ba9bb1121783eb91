"""`posebridge check` from the command line, over real UDP, against a simulated autopilot that runs by the clock."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from tests.tools.test_cli import posebridge
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.parameters import FOR_VISION
from tools.simulate.autopilot.vessel import Autopilot
from tools.simulate.dynamics import GRAVITY

ROUND_S = 0.02
STANDING = Increment(ROUND_S, np.zeros(3), np.array([0.0, 0.0, -ROUND_S * GRAVITY]))


@pytest.fixture
def autopilot() -> Iterator[Autopilot]:
    """Switch one on that stands on the ground with its GPS left on, long booted."""
    pilot = Autopilot(None, {**FOR_VISION, "GPS1_TYPE": 1}, booted_ns=time.monotonic_ns() - 60_000_000_000)
    over = threading.Event()

    def live() -> None:
        while not over.wait(ROUND_S):
            pilot.tick(time.monotonic_ns(), STANDING)

    thread = threading.Thread(target=live)
    thread.start()
    yield pilot
    over.set()
    thread.join()
    pilot.close()


def test_the_page_names_what_is_wrong_and_apply_writes_it(autopilot: Autopilot) -> None:
    link = f"udpout:127.0.0.1:{autopilot.port}"
    done = posebridge("check", "--source", "none", "--link", link, "--apply", "--yes")
    assert done.returncode == 1, done.stderr
    assert "FAIL  GPS1_TYPE" in done.stdout
    assert "-> set GPS1_TYPE 0 and reboot the autopilot (--apply does)" in done.stdout
    assert "DO NOT FLY" in done.stdout
    assert "Not looked at in this run: poses, fusion and delay" in done.stdout
    assert "apply: GPS1_TYPE 0: read back" in done.stderr
    assert autopilot.parameters["GPS1_TYPE"] == 0


def test_the_page_as_json_says_the_same(autopilot: Autopilot) -> None:
    done = posebridge("check", "--source", "none", "--link", f"udpout:127.0.0.1:{autopilot.port}", "--json")
    assert done.returncode == 1
    page = json.loads(done.stdout)
    lines = {line["what"]: line for section in page["sections"] for line in section["lines"]}
    assert not page["good"]
    assert lines["GPS1_TYPE"]["mark"] == "fail"
    assert lines["GPS1_TYPE"]["write"] == {"name": "GPS1_TYPE", "value": 0, "reboot": True}
    assert lines["VISO_TYPE"]["mark"] == "pass"


def test_without_a_terminal_apply_asks_for_yes(autopilot: Autopilot) -> None:
    done = posebridge("check", "--source", "none", "--link", f"udpout:127.0.0.1:{autopilot.port}", "--apply")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        "posebridge: error: --apply: no terminal to ask on; add --yes to write without asking"
    )
    assert autopilot.parameters["GPS1_TYPE"] == 1


def test_no_autopilot_is_one_line_and_exit_2() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as nobody:
        nobody.bind(("127.0.0.1", 0))
        done = posebridge("check", "--source", "none", "--link", f"udpout:127.0.0.1:{nobody.getsockname()[1]}")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "no autopilot heard within 6 s" in line
    assert "SERIALn_PROTOCOL 2" in line


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--link", "udpout:nowhere"], "not a link; known forms are"),
        (["--link", "serial:/dev/not-there:57600"], "/dev/not-there"),
        (["--link", "udpout:127.0.0.1:9", "--duration_s", "1"], "must be 3 to 600 s"),
        (["--link", "udpout:127.0.0.1:9", "--frame"], "--frame and --wiggle need poses"),
    ],
)
def test_a_bad_order_is_one_line_and_exit_2(arguments: list[str], complaint: str) -> None:
    done = posebridge("check", "--source", "none", *arguments)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert complaint in line

"""What ArduPilot's own program makes of the bridge's link: the check's page, and signed frames.

Each test starts the program that ARDUPILOT_SITL names; see docs/sitl.md.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.preflight.verdict import Mark
from bridge.signing import Seal, make_key, open_seal
from bridge.wire import Received
from tests.tools.check.real import Program, RealRehearsal
from tests.tools.check.rehearsal import Mistake
from tools.simulate.helicopter import standing
from tools.sitl.airframe import VEHICLE

pytestmark = pytest.mark.sitl


def binary() -> Path:
    return Path(os.environ["ARDUPILOT_SITL"])


def test_a_vehicle_that_is_set_up_well_passes_every_line_of_the_check(tmp_path: Path) -> None:
    rehearsal = RealRehearsal(binary(), tmp_path, Mistake())
    assert rehearsal.check(frame=True, wiggle=True)
    assert rehearsal.lines(Mark.FAIL, Mark.WARN, Mark.UNKNOWN) == {}


@pytest.mark.parametrize(
    ("mistake", "line", "fix"),
    [
        (Mistake(parameters={"VISO_TYPE": 0}), "VISO_TYPE", "set VISO_TYPE 1 and reboot"),
        (Mistake(parameters={"EK3_SRC1_YAW": 1}), "EK3_SRC1_YAW", "set EK3_SRC1_YAW 6"),
        (Mistake(parameters={"VISO_DELAY_MS": 135}), "VISO_DELAY_MS", "set VISO_DELAY_MS 3"),
        (Mistake(origin=False), "origin", "add [origin] to the config"),
    ],
)
def test_the_check_refuses_a_mistake_and_names_its_fix(mistake: Mistake, line: str, fix: str, tmp_path: Path) -> None:
    rehearsal = RealRehearsal(binary(), tmp_path, mistake)
    assert not rehearsal.check()
    assert fix in rehearsal.lines(Mark.FAIL)[line].fix


def test_the_frame_check_refuses_a_marker_turned_by_90_deg(tmp_path: Path) -> None:
    rehearsal = RealRehearsal(binary(), tmp_path, Mistake(marker_deg=90.0))
    assert not rehearsal.check(frame=True)
    assert "turn position_mm of all balls by -90 deg" in rehearsal.lines(Mark.FAIL)["yaw against motion"].fix


class Talk:
    """A program that stands, and one who speaks to it at the bridge's port, signed or not."""

    def __init__(self, folder: Path) -> None:
        self._program = Program(binary(), folder, Mistake(), 0.0)
        self._state = standing(VEHICLE, -0.75)
        make_key(folder / "key")
        self.seal: Seal = open_seal(folder / "key", time.time_ns, time.monotonic_ns)
        self.secret = list(bytes.fromhex((folder / "key").read_text()))
        signing = self.seal.for_link(7)
        self.encode = {True: Encoder(Identity(1), signing), False: Encoder(Identity(1))}
        self._reader = {True: Reader(signing), False: Reader()}

    def wait(self, seconds: float) -> None:
        """Let time go on, and hear nothing."""
        for _ in range(round(seconds * 500)):
            self._program.live(self._state, self._state)
        self._program.bridge.receive()

    def ask(self, *, sent_signed: bool, heard_signed: bool) -> list[Received]:
        """Ask for a parameter, and return the answers that are believed."""
        question = make_message(
            "PARAM_REQUEST_READ", 0, target_system=1, target_component=1, param_id="VISO_TYPE", param_index=-1
        )
        self._program.bridge.send(self.encode[sent_signed](question, 0))
        pieces: list[bytes] = []
        for _ in range(500):
            self._program.live(self._state, self._state)
            pieces += self._program.bridge.receive()
        heard = [each for piece in pieces for each in self._reader[heard_signed].feed(piece)]
        return [each for each in heard if each.message == "PARAM_VALUE"]

    def set_key(self) -> None:
        """Give the autopilot the key, as a ground station does."""
        stamp = int((time.time() - 1_420_070_400) * 100_000)
        setup = make_message(
            "SETUP_SIGNING", 0, target_system=1, target_component=1, secret_key=self.secret, initial_timestamp=stamp
        )
        self._program.bridge.send(self.encode[False](setup, 0))
        self.wait(2.0)

    def close(self) -> None:
        """End the program, let go of the key."""
        self._program.close()
        self.seal.close()


@pytest.fixture
def talk(tmp_path: Path) -> Iterator[Talk]:
    """Switch a program on and let it boot."""
    talk = Talk(tmp_path)
    talk.wait(8.0)
    yield talk
    talk.close()


def test_once_it_has_the_key_it_believes_our_signature_and_we_its_and_nothing_unsigned(talk: Talk) -> None:
    assert talk.ask(sent_signed=False, heard_signed=False)
    talk.set_key()
    assert talk.ask(sent_signed=True, heard_signed=True)
    assert not talk.ask(sent_signed=False, heard_signed=False)

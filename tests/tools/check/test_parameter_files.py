"""The parameter files in config/: loadable by other people's tools, a reason a line, and what check asks for."""

from __future__ import annotations

import itertools
import re
from importlib import resources
from pathlib import Path

import pytest
from pymavlink.mavparm import MAVParmDict

from bridge.preflight import ardupilot, px4
from bridge.preflight.parameters import Parameter
from bridge.preflight.rules import judge
from bridge.preflight.verdict import Mark
from tests.tools.check.rehearsal import Mistake, Rehearsal
from tools.simulate.autopilot.parameters import Parameters

CONFIG = Path(str(resources.files("config")))
HELI, PX4 = CONFIG / "ardupilot-heli.parm", CONFIG / "px4.params"


def heli() -> dict[str, float]:
    """Read the file as MAVProxy does."""
    values = MAVParmDict()
    assert values.load(str(HELI))
    return dict(values)


def px4_rows() -> list[list[str]]:
    """Read the file as QGroundControl does: five columns parted by tabs."""
    return [row.split("\t") for row in PX4.read_text().splitlines() if row and not row.startswith("#")]


def test_mavproxy_reads_every_line_of_ardupilots_file() -> None:
    lines = [line for line in HELI.read_text().splitlines() if line and not line.startswith("#")]
    assert len(heli()) == len(lines) > 20


def test_each_of_ardupilots_lines_has_its_reason() -> None:
    for line in HELI.read_text().splitlines():
        assert not line or line.startswith("#") or re.fullmatch(r"[A-Z0-9_]+ [-0-9.]+ +# \S.+", line), line


def test_each_of_px4s_lines_has_five_columns_and_its_reason_above() -> None:
    lines = PX4.read_text().splitlines()
    assert len(px4_rows()) > 10
    for above, line in itertools.pairwise(lines):
        if not line.startswith("#"):
            assert above.startswith("# ")
            assert re.fullmatch(r"1\t1\t[A-Z0-9_]+\t[-0-9.]+\t[69]", line), line


def test_ardupilots_file_holds_what_every_rule_asks_for() -> None:
    values = heli()
    known = {name: Parameter(name, value, 9) for name, value in values.items()}
    lines = judge(ardupilot.rules(velocity=True), known)
    assert {line.mark for line in lines} == {Mark.PASS}
    assert all(values[rule.names[0]] == rule.value for rule in ardupilot.rules(velocity=True))


def test_px4s_file_holds_what_every_rule_asks_for() -> None:
    values = {name: float(value) for _, _, name, value, _ in px4_rows()}
    lines = judge(px4.rules(velocity=True), {name: Parameter(name, value, 9) for name, value in values.items()})
    assert {line.mark for line in lines} == {Mark.PASS}
    assert all(values[rule.names[0]] == rule.value for rule in px4.rules(velocity=True))


@pytest.mark.parametrize("name", [name for rule in px4.rules(True) + ardupilot.rules(True) for name in rule.names])
def test_no_name_is_longer_than_a_parameters_may_be(name: str) -> None:
    assert len(name) <= 16


def test_an_autopilot_so_configured_passes_the_check() -> None:
    """The file as it is, but for the delay: no file can know it."""
    held = {parameter.name for parameter in Parameters({})}
    given = {name: value for name, value in heli().items() if name in held}
    rehearsal = Rehearsal(Mistake(parameters={**given, "VISO_DELAY_MS": 35}))
    assert rehearsal.check(frame=True)
    assert rehearsal.lines(Mark.FAIL, Mark.UNKNOWN, Mark.WARN) == {}

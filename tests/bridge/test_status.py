"""The status line: often enough to follow, never a flood."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from bridge.status import Reading, StatusLine
from bridge.summary import ClockOffset

FRAME_NS = 66_666_667
FLYING = Reading("tracking", 15.0, 3.14, 8.0, (0.1, -0.2, 1.0), 1.24, 1, 2, "ok")
BLIND = Reading("searching", 0.0, None, None, None, None, 0, 1, "off")


class Screen:
    """A console with its text, and a stopwatch set by hand."""

    def __init__(self, terminal: bool, width: int = 200) -> None:
        self.now_ns = 0
        self.reads = 0
        self._out = io.StringIO()
        self.line = StatusLine(
            Console(file=self._out, width=width, force_terminal=terminal, color_system=None), lambda: self.now_ns
        )

    @property
    def text(self) -> str:
        return self._out.getvalue()

    def read(self) -> Reading:
        self.reads += 1
        return FLYING


def test_without_a_terminal_a_plain_line_comes_every_five_seconds_of_stream_time() -> None:
    screen = Screen(terminal=False)
    start_ns = 1_700_000_000_000_000_000
    with screen.line as line:
        for frame in range(15 * 16):
            line.show(start_ns + frame * FRAME_NS, screen.read)
    lines = screen.text.splitlines()
    assert len(lines) == 3
    assert set(lines) == {
        "tracking   15.0 Hz | latency p50 3.1 p99 8.0 ms | x y z +0.100 -0.200 +1.000 m | NIS 1.2 | links 1/2 | log ok"
    }


def test_on_a_terminal_the_line_is_redrawn_five_times_a_second_however_fast_the_frames_come() -> None:
    screen = Screen(terminal=True)
    with screen.line as line:
        for millisecond in range(1000):
            screen.now_ns = millisecond * 1_000_000
            line.show(millisecond * FRAME_NS, screen.read)
    assert screen.reads == 4
    assert "tracking" in screen.text


def test_on_a_narrow_terminal_the_line_is_broken_and_nothing_is_cut() -> None:
    screen = Screen(terminal=True, width=60)
    alarmed = replace(FLYING, alarm="a gap of 439 ms between poses; ArduPilot gives vision up after 300 ms", alarms=2)
    with screen.line as line:
        for screen.now_ns in (0, 1_000_000_000):
            line.show(0, lambda: alarmed)
    shown = screen.text.replace("\n", " ")
    for part in ("after 300 ms (and 1 more)", "tracking   15.0 Hz", "NIS 1.2", "links 1/2", "log ok"):
        assert part in shown


@pytest.mark.parametrize("terminal", [False, True])
def test_readings_are_taken_only_when_they_are_shown(terminal: bool) -> None:
    screen = Screen(terminal)
    with screen.line as line:
        for _ in range(100):
            line.show(0, screen.read)
    assert screen.reads == 0


def test_a_clock_that_is_certainly_off_is_told() -> None:
    screen = Screen(terminal=False)
    off = replace(FLYING, clocks={"cam1": ClockOffset(12.34, 0.4)})
    for t_ns in (0, 5_000_000_000):
        screen.line.show(t_ns, lambda: off)
    assert "| NIS 1.2 | clock cam1 +12.34 +- 0.40 ms | links 1/2 |" in screen.text


def test_what_is_not_known_yet_is_a_dash() -> None:
    screen = Screen(terminal=False)
    for t_ns in (0, 5_000_000_000):
        screen.line.show(t_ns, lambda: BLIND)
    assert screen.text == ("searching   0.0 Hz | latency p50 - p99 - ms | x y z - m | NIS - | links 0/1 | log off\n")

"""The page as text: columns, fixes, and the last word."""

from __future__ import annotations

from bridge.preflight.verdict import Line, Mark, Section, Write
from tools.check.page import WIDTH, plain, to_text, verdict

GOOD = Line(Mark.PASS, "EK3_ENABLE", "1", "1: EKF3 runs")
BAD = Line(Mark.FAIL, "VISO_TYPE", "0", "1: poses come by MAVLink", "set VISO_TYPE 1", Write("VISO_TYPE", 1.0, True))
LONG = Line(Mark.WARN, "a thing with a name too long for its column", "found " * 20, "needed " * 20, "fix " * 60)
SAID = Line(Mark.FAIL, '"PreArm: VisOdom: not healthy"', "it gets no poses", "", "cause: none come")


def page(*lines: Line, unchecked: tuple[str, ...] = ()) -> str:
    return plain(to_text((Section("Parameters", lines, ("a note",)),), unchecked))


def test_a_line_stands_in_columns_with_its_fix_below() -> None:
    assert page(GOOD, BAD).splitlines()[:5] == [
        "Parameters",
        "   pass  EK3_ENABLE            1                                           1: EKF3 runs",
        "   FAIL  VISO_TYPE             0                                           1: poses come by MAVLink",
        "           -> set VISO_TYPE 1",
        "         a note",
    ]


def test_nothing_is_wider_than_the_page_or_cut_off() -> None:
    text = page(LONG, SAID)
    assert max(map(len, text.splitlines())) <= WIDTH
    words = text.split()
    assert (words.count("found"), words.count("needed"), words.count("fix")) == (20, 20, 60)


def test_what_it_said_has_a_row_of_its_own_and_its_meaning_below() -> None:
    assert page(SAID).splitlines()[1:4] == [
        '   FAIL  "PreArm: VisOdom: not healthy"',
        "           it gets no poses",
        "           -> cause: none come",
    ]


def test_the_last_word_counts_and_says_what_was_not_looked_at() -> None:
    assert verdict((Section("a", (GOOD, GOOD)),)).plain == "Nothing speaks against flying: 2 lines passed."
    assert "2 lines passed" not in verdict((Section("a", (GOOD, LONG)),)).plain
    unknown = Line(Mark.UNKNOWN, "firmware", "not told", "known")
    assert verdict((Section("a", (GOOD, BAD, unknown)),)).plain.startswith("DO NOT FLY: 1 failed, 1 unknown")
    assert page(GOOD, unchecked=("axes", "delay")).endswith("Not looked at in this run: axes; delay.\n")

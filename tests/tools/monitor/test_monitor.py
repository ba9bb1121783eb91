"""`posebridge monitor`: what a person sees of a bridge or of a log, and what is said when there is nothing to see."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from bridge.alarms import Alarm, Level
from bridge.telemetry.post import HOST, Post
from bridge.telemetry.snapshot import to_bytes
from bridge.telemetry.states import Surroundings
from bridge.wire import LinkState
from tests.bridge.recordings import PERIOD_NS, START_NS, record, turns
from tests.bridge.telemetry.watched import Watched
from tools.cli import run_command_line
from tools.monitor.attach import attach
from tools.monitor.bars import BLOCKS, PLAIN, bars
from tools.monitor.page import page
from tools.monitor.review import Episode, review, table
from tracker.types import TrackState

SECOND_NS = 1_000_000_000


@contextmanager
def flying(post: Post) -> Iterator[None]:
    """Fly a watched bridge in a thread until the block ends; then it says its last word."""
    over = threading.Event()

    def fly() -> None:
        watched = Watched(post=post)
        for turn in turns(3000):
            watched.now_ns += 50_000_000
            watched.fly(turn)
            if over.wait(0.005):
                break
        watched.telemetry.close(lambda: watched.around)

    thread = threading.Thread(target=fly)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@pytest.fixture
def post() -> Post:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HOST, 0))
    return Post(sock)


def drawn(watched: Watched, width: int = 80, glyphs: str = BLOCKS) -> str:
    console = Console(width=width, record=True, color_system=None, file=None, force_terminal=False)
    with console.capture() as capture:
        console.print(page(watched.snapshot(), "127.0.0.1:14730", glyphs=glyphs))
    return capture.get()


def test_once_shows_the_page_of_a_bridge_that_runs(post: Post, capsys: pytest.CaptureFixture[str]) -> None:
    with flying(post):
        assert run_command_line(["monitor", "--port", str(post.port), "--once"]) == 0
    shown = capsys.readouterr().out
    for word in ("sim:test", "tracking", "Hz", "frame to datagram", "NIS", "cam0", "memory:a"):
        assert word in shown


def test_json_gives_the_figures_in_a_line(post: Post, capsys: pytest.CaptureFixture[str]) -> None:
    with flying(post):
        assert run_command_line(["monitor", "--port", str(post.port), "--once", "--json"]) == 0
    value = json.loads(capsys.readouterr().out)
    assert value["track"]["state"] == "tracking"
    assert value["rate"]["now_hz"] > 0.0


def test_it_follows_a_bridge_to_its_end(post: Post) -> None:
    with flying(post):
        heard = attach(post.port, time.perf_counter_ns)
        sequences = [next(heard).snapshot.sequence for _ in range(3)]
    assert sequences == sorted(set(sequences))
    assert [*heard][-1].snapshot.ended


def test_a_bridge_that_hangs_is_told_from_one_that_talks(post: Post) -> None:
    later_ns = 0
    calls = attach(post.port, lambda: time.perf_counter_ns() + later_ns)
    watched = Watched()
    watched.fly(*turns(3))
    answer = threading.Thread(target=_answer_once, args=(post, to_bytes(watched.snapshot())))
    answer.start()
    assert not next(calls).quiet_s
    later_ns = 2 * SECOND_NS  # in which it said nothing
    assert next(calls).quiet_s >= 2.0
    answer.join()
    calls.close()
    post.close()


def _answer_once(post: Post, data: bytes) -> None:
    while not post.anybody(0):
        time.sleep(0.001)  # polls for a datagram that comes; the test has no other limit
    post.send(data)


def test_nobody_there_is_one_line_and_exit_code_2(post: Post, capsys: pytest.CaptureFixture[str]) -> None:
    post.close()
    assert run_command_line(["monitor", "--port", str(post.port)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"127.0.0.1:{post.port}" in error


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["none.mcap"], "no such file"),
        (["none.mcap", "--port", "14730"], "either"),
        (["--port", "0"], "1 to 65535"),
        (["--port", "70000"], "1 to 65535"),
    ],
)
def test_what_cannot_be_shown_is_one_line_and_exit_code_2(
    arguments: list[str], what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["monitor", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert what in error


def test_a_log_is_shown_with_every_alarm_on_the_way(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flight = turns(300)
    late = [(event, step, sent, now_ns + SECOND_NS) for event, step, sent, now_ns in flight[150:]]
    record(tmp_path / "a.mcap", [*flight[:150], *late])
    assert run_command_line(["monitor", str(tmp_path / "a.mcap")]) == 0
    assert "a gap of 1033 ms between poses" in " ".join(capsys.readouterr().out.split())
    (gap,) = (episode for episode in review(tmp_path / "a.mcap").episodes if episode.alarm.name == "gap_severe")
    assert gap.from_s == pytest.approx(150 / 30 + 0.3, abs=0.4)


def test_one_alarm_is_counted_as_one() -> None:
    one = Episode(Alarm("gap", "", Level.ALARM, "a gap", "mend it", 1.0), 2.0, 3.0)
    for episodes, words in (((one,), "1 alarm on the way"), ((one, one), "2 alarms on the way")):
        console = Console(width=80)
        with console.capture() as shown:
            console.print(table(episodes))
        assert words in shown.get()


def test_what_an_alarm_says_goes_on_below_itself() -> None:
    console = Console(width=60)
    with console.capture() as shown:
        console.print(table((Episode(Alarm("gap", "", Level.ALARM, "word " * 20, "mend it", 1.0), 2.0, 3.0),)))
    below = shown.get().splitlines()[2]
    assert below.startswith(" " * 20)
    assert below.split()[0] == "word"


def test_the_page_fits_eighty_columns_whatever_the_names() -> None:
    watched = Watched(around=Surroundings((LinkState("serial:/dev/" + "x" * 90, False, "gone " * 30, 1, 2, 3),)))
    watched.fly(*turns(200))
    assert max(len(line) for line in drawn(watched).splitlines()) <= 80


def test_a_narrow_window_breaks_what_links_say_and_cuts_none_of_it() -> None:
    watched = Watched(around=Surroundings((LinkState("serial:/dev/ttyACM0:921600", False, "gone " * 9, 1, 2, 3),)))
    watched.fly(*turns(200))
    assert ", 1 sent, 2 dropped, 3 superseded" in " ".join(drawn(watched, 60).split())


@pytest.mark.parametrize("width", [50, 60, 80, 120])
def test_no_window_is_too_narrow_for_a_figure(width: int) -> None:
    watched = Watched()
    watched.fly(*turns(200))
    lines = [line for line in drawn(watched, 200).splitlines() if line.startswith(("frame to datagram", "rate"))]
    figures = [word for line in lines for word in line.split() if any(letter.isdigit() for letter in word)]
    assert len(figures) > 8
    _, *below = drawn(watched, width).splitlines()
    assert "…" not in "".join(below)
    assert max(map(len, below)) <= width
    assert set(figures) <= set(" ".join(below).split())


def test_without_unicode_the_page_is_plain_ascii() -> None:
    watched = Watched()
    watched.fly(*turns(200))
    assert drawn(watched, 120, PLAIN).replace("…", "").isascii()


def test_alarms_stand_above_everything_but_the_title() -> None:
    watched = Watched(around=Surroundings((LinkState("memory:a", False, "no such device", 1, 0, 0),)))
    watched.fly(*turns(200))
    lines = drawn(watched).splitlines()
    assert lines[1].startswith("ALARM")
    assert any(line.strip().startswith("->") for line in lines[2:5])


def test_a_pose_of_a_track_that_is_lost_is_called_old() -> None:
    watched = Watched()
    watched.fly(*turns(90))
    assert "WHEN LAST SEEN" not in drawn(watched, 120)
    watched.wait(START_NS + 100 * PERIOD_NS, TrackState.LOST)
    assert drawn(watched, 120).count("WHEN LAST SEEN") == 2


def test_an_empty_run_has_a_page_too() -> None:
    assert "searching" in drawn(Watched())


@given(st.lists(st.one_of(st.none(), st.floats(0.0, 1e6)), min_size=1, max_size=200), st.integers(1, 60))
def test_bars_fit_their_width_and_the_largest_value_is_a_full_one(values: list[float | None], width: int) -> None:
    drawn = bars(values, width)
    assert 1 <= len(drawn) <= width
    largest = max((value for value in values if value is not None), default=0.0)
    assert (BLOCKS[-1] in drawn) == (largest > 0.0)
    assert (drawn.strip() == "") == (largest == 0.0)


def test_the_newest_bar_is_that_of_the_newest_values() -> None:
    assert bars([0.0] * 119 + [1.0], 30)[-1] == BLOCKS[-1]
    assert bars([1.0] + [0.0] * 119, 30)[0] == BLOCKS[-1]
    assert bars([None, 2.0, 1.0], 3) == " " + BLOCKS[8] + BLOCKS[4]


def test_a_note_stands_under_the_title() -> None:
    watched = Watched()
    watched.fly(*turns(3))
    snapshot = replace(watched.snapshot(), ended=True)
    console = Console(width=80)
    with console.capture() as capture:
        console.print(page(snapshot, "here", "The bridge has said nothing for 4 s."))
    first, second, *_ = capture.get().splitlines()
    assert "ended" in first
    assert second.startswith("The bridge has said nothing")

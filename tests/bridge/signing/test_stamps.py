"""Timestamps of signatures never repeat and never go back, whatever clocks and crashes do."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.signing.stamps import AHEAD, EPOCH_S, MOST, TICK_NS, Stamps, open_stamps
from tracker.errors import OperatorError

NOW_NS = 1_800_000_000 * 1_000_000_000
NOW = (NOW_NS - EPOCH_S * 1_000_000_000) // TICK_NS
MINUTE_NS = 60 * 1_000_000_000


class Clock:
    """A stopwatch that a test sets."""

    def __init__(self) -> None:
        self.now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


def opened(path: Path, wall_ns: int = NOW_NS, clock: Clock | None = None) -> Stamps:
    return open_stamps(path, lambda: wall_ns, clock or Clock())


def test_they_follow_time_in_ticks_of_ten_microseconds_since_2015(tmp_path: Path) -> None:
    clock = Clock()
    stamps = opened(tmp_path / "s", clock=clock)
    assert stamps.take() == NOW
    clock.now_ns = 3_000_000_000
    assert stamps.take() == NOW + 300_000


def test_two_in_the_same_tick_differ(tmp_path: Path) -> None:
    stamps = opened(tmp_path / "s")
    taken = [stamps.take() for _ in range(1000)]
    assert taken == sorted(set(taken))


@pytest.mark.parametrize("step_s", [-(10**8), -3600, 0, 3600])
def test_after_an_orderly_end_they_go_on_above_the_last_whatever_the_calendar_says(step_s: int, tmp_path: Path) -> None:
    first = opened(tmp_path / "s")
    last = [first.take() for _ in range(50)][-1]
    first.close()
    first.close()
    again = opened(tmp_path / "s", NOW_NS + step_s * 1_000_000_000).take()
    assert again > last
    assert step_s > 0 or again == last + 1  # no minute is lost by an orderly end


@given(st.lists(st.integers(0, 50 * MINUTE_NS), min_size=1, max_size=8), st.booleans())
def test_after_a_kill_at_any_time_they_go_on_above_all_that_were_given(
    tmp_path_factory: pytest.TempPathFactory, waits_ns: list[int], back: bool
) -> None:
    path, clock = tmp_path_factory.mktemp("stamps") / "s", Clock()
    killed = opened(path, clock=clock)
    last = 0
    for wait_ns in waits_ns:
        clock.now_ns += wait_ns
        last = killed.take()
    assert opened(path, 0 if back else NOW_NS).take() > last


def test_a_crash_costs_no_more_than_a_minute(tmp_path: Path) -> None:
    last = opened(tmp_path / "s").take()
    assert opened(tmp_path / "s").take() <= last + AHEAD + 1


def test_a_far_ends_later_timestamp_is_gone_above(tmp_path: Path) -> None:
    stamps = opened(tmp_path / "s")
    stamps.heard(NOW + 10**6)
    assert stamps.take() > NOW + 10**6
    stamps.heard(5)
    assert stamps.newest > NOW


def test_what_is_no_timestamp_is_refused_and_a_folder_of_others_too(tmp_path: Path) -> None:
    for text in ("", "x", "-1", str(MOST + 1)):
        (tmp_path / "s").write_text(text)
        with pytest.raises(OperatorError, match="remove the file"):
            opened(tmp_path / "s")
    with pytest.raises(OperatorError, match="cannot be written"):
        opened(tmp_path / "none" / "s")


def test_a_disk_that_fails_in_flight_ends_no_flight(tmp_path: Path) -> None:
    folder, clock = tmp_path / "key", Clock()
    folder.mkdir()
    stamps = opened(folder / "s", clock=clock)
    (folder / "s").unlink()
    folder.rmdir()
    clock.now_ns = 10 * MINUTE_NS
    assert stamps.take() > NOW
    stamps.close()

"""A log gone through as its flight went: the page at its end, and every alarm that stood on the way."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from bridge.alarms import Alarm, Level
from bridge.telemetry.logged import LoggedRun
from bridge.telemetry.snapshot import Snapshot
from tracker.errors import OperatorError

STEP_NS = 500_000_000
SHOWN = 20


@dataclass(frozen=True, slots=True)
class Episode:
    """An alarm from when it was raised until it was last seen standing, in the flight's time [s]."""

    alarm: Alarm
    from_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class Review:
    """A whole log: how it stood at its end, and the alarms on the way in their order."""

    last: Snapshot
    episodes: tuple[Episode, ...]


def review(path: Path) -> Review:
    """Go through a log.

    Raises:
        OperatorError: no log of posebridge.
    """
    episodes: dict[tuple[str, str, int], Episode] = {}
    last: Snapshot | None = None
    for last in LoggedRun(path).snapshots(STEP_NS):
        for alarm in last.alarms:
            from_s = max(0.0, last.running_s - alarm.since_s)
            key = (alarm.name, alarm.subject, round((last.t_ns / 1e9 - alarm.since_s) * 1e3))
            episodes[key] = Episode(alarm, from_s, last.running_s)
    if last is None:
        raise OperatorError(f"log {path}: holds nothing; name a log that `run --log` wrote")
    return Review(last, tuple(sorted(episodes.values(), key=lambda episode: episode.from_s)))


def table(episodes: tuple[Episode, ...]) -> RenderableType:
    """Lay the alarms of a flight out, a line each."""
    if not episodes:
        return Text("No alarm on the way.", "green")
    count = "1 alarm" if len(episodes) == 1 else f"{len(episodes)} alarms"
    rows = Table.grid(padding=(0, 1, 0, 0))
    rows.add_column(no_wrap=True)
    rows.add_column(no_wrap=True)
    rows.add_column(overflow="fold")
    for episode in episodes[:SHOWN]:
        alarm = episode.alarm
        style = "bold red" if alarm.level is Level.ALARM else "yellow"
        rows.add_row(
            f"{episode.from_s:8.1f} s to {episode.until_s:8.1f} s", Text(alarm.level, style), Text(alarm.cause)
        )
    more = len(episodes) - SHOWN
    return Group(
        Text(f"{count} on the way, by the time in the flight:", "bold"),
        rows,
        *([Text(f"and {more} more; --json has them all", "dim")] if more > 0 else ()),
    )

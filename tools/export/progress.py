"""How far an export has come, on a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from bridge.log.reader import OnOffset


@contextmanager
def progress(console: Console, size_bytes: int, walks: int) -> Iterator[OnOffset]:
    """Show a bar on a terminal, and nothing elsewhere.

    size_bytes: of the log.  walks: how often it is read from its beginning.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("reading the log", total=max(1, size_bytes * walks))
        done, last = 0, 0

        def on_offset(offset: int) -> None:
            nonlocal done, last
            done += size_bytes if offset < last else 0
            last = offset
            bar.update(task, completed=done + offset)

        yield on_offset

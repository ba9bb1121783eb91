"""`posebridge monitor`, put together."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import orjson
import typer
from rich.console import Console, RenderableType
from rich.live import Live

from bridge.clock import Nanoseconds
from bridge.telemetry.post import HOST
from tools.monitor.attach import Heard, attach
from tools.monitor.bars import BLOCKS, PLAIN
from tools.monitor.page import page
from tools.monitor.review import review, table
from tools.screen import screen
from tracker.errors import OperatorError


@dataclass(frozen=True, slots=True)
class MonitorRequest:
    """What to show. log: a file, None for a running bridge.  port: the bridge's, None to look for it.

    once: one page, then done.  json: values in place of a page, one line each.
    """

    log: Path | None
    port: int | None
    once: bool
    json: bool

    def __post_init__(self) -> None:
        """Raise OperatorError for what cannot be meant."""
        if self.log is not None and self.port is not None:
            raise OperatorError(f"--port {self.port}: a log has no port; give either a log or --port")
        if self.port is not None and not 1 <= self.port <= 65_535:
            raise OperatorError(f"--port {self.port}: must be 1 to 65535; give the config's [monitor] port")


def run_monitor(request: MonitorRequest, stopwatch: Nanoseconds) -> None:
    """Show a running bridge until it ends or Ctrl-C, or a log's end.

    Raises:
        OperatorError: nothing there to show.
    """
    console = screen()
    if request.log is not None:
        _show_log(request.log, console, json=request.json)
        return
    with closing(attach(request.port, stopwatch)) as heard:
        if request.json:
            _print_json(heard, once=request.once)
        elif request.once or not console.is_terminal:
            _print_once(heard, console)
        else:
            _show_live(heard, console)


def _show_log(path: Path, console: Console, *, json: bool) -> None:
    seen = review(path)
    if json:
        typer.echo(orjson.dumps(seen))
        return
    console.print(page(seen.last, str(path), glyphs=_glyphs(console)))
    console.print(table(seen.episodes), soft_wrap=True)


def _print_json(heard: Iterator[Heard], *, once: bool) -> None:
    for each in heard:
        if not each.quiet_s:
            typer.echo(orjson.dumps(each.snapshot))
        if once:
            return


def _print_once(heard: Iterator[Heard], console: Console) -> None:
    for each in heard:
        console.print(_page(each, console))
        return


def _show_live(heard: Iterator[Heard], console: Console) -> None:
    """Redraw the page in place; the last one stays on the screen."""
    last: Heard | None = None
    with Live(console=console, auto_refresh=False, screen=True) as live:
        try:
            for last in heard:
                live.update(_page(last, console), refresh=True)
        except KeyboardInterrupt:  # the operator has seen enough; that is no failure
            pass
    if last is not None:
        console.print(_page(last, console))


def _page(heard: Heard, console: Console) -> RenderableType:
    return page(heard.snapshot, f"{HOST}:{heard.port}", _note(heard), _glyphs(console))


def _note(heard: Heard) -> str:
    if heard.quiet_s:
        return f"The bridge has said nothing for {heard.quiet_s:.0f} s: it was killed, or hangs. What follows is old."
    if heard.others:
        ports = ", ".join(map(str, heard.others))
        return f"Another bridge runs here too; --port shows it: {ports}"
    return ""


def _glyphs(console: Console) -> str:
    return BLOCKS if console.encoding.lower().startswith("utf") else PLAIN

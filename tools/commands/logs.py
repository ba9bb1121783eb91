"""The commands that watch and that use logs."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import JsonOption, clocks_of, tell_of_compiling
from tools.request import ExportFormat, Pace, RunRequest

STDOUT = Path("-")


def monitor(
    context: typer.Context,
    log: Annotated[
        Path | None, typer.Argument(help="A log, in place of the bridge that runs.", metavar="[LOG]")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="The bridge's [monitor] port, where several run or it is not the usual one.")
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="Show one page and exit.")] = False,
    json: JsonOption = False,
) -> None:
    """Watch a bridge that runs on this computer, or look through a log: rates, gaps, latency, NIS, links, alarms."""
    from tools.monitor.command import MonitorRequest, run_monitor

    run_monitor(MonitorRequest(log, port, once, json), clocks_of(context).stopwatch)


def export(
    log: Annotated[Path, typer.Argument(help="A log that `run` or `demo` wrote.")],
    format_: Annotated[ExportFormat, typer.Option("--format", help="tum: time and pose. csv: every column.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write, - for stdout; else beside the log.", metavar="FILE")
    ] = None,
) -> None:
    """Write a log's estimates as a table."""
    from tools.export import export as write_table

    if out == STDOUT:
        with tempfile.TemporaryDirectory() as folder:
            table = Path(folder) / "table"
            report = write_table(log, format_, table)
            sys.stdout.write(table.read_text(encoding="utf-8"))
            sys.stdout.flush()  # here, so that a reader who left, as `head` does, is noticed in time
    else:
        out = out or log.with_suffix(f".{format_}")
        report = write_table(log, format_, out)
        typer.echo(f"{report.count} estimates written to {out}", err=True)
    for loss in report.lost:
        typer.echo(f"posebridge: warning: {log}: {loss}", err=True)


def replay(
    context: typer.Context,
    log: Annotated[Path, typer.Argument(help="A log that `run --log-frames` wrote.")],
    config: Annotated[
        str | None, typer.Option(help="Other settings, by name or path to a .toml; else the log's own.")
    ] = None,
    link: Annotated[
        list[str] | None,
        typer.Option(help="Send the poses here. Else they only go into the log of the replay.", metavar="URI"),
    ] = None,
    out: Annotated[Path | None, typer.Option("--log", help="Record the replay in this file.", metavar="FILE")] = None,
    pace: Annotated[Pace, typer.Option(help="fast: same log, same bytes. real: as it was flown.")] = Pace.FAST,
    summary: Annotated[Path | None, typer.Option(help="Write the replay's figures here.", metavar="FILE.json")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a log that exists.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show no status line and no summary.")] = False,
) -> None:
    """Run the frames of a log through the tracker again; with its own settings it sends the same bytes."""
    tell_of_compiling()
    from bridge.settings import load_settings
    from tools.replay import on_paper, settings_of
    from tools.session import run_session

    settings = (settings_of(log) if config is None else load_settings(config)).with_frames("off", None)
    settings = settings.with_links(tuple(link)) if link else on_paper(settings)
    run_session(RunRequest(settings, f"log:{log}", out, pace, summary, overwrite, quiet), clocks_of(context))

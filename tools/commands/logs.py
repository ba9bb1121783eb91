"""The commands that watch and that use logs."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import JsonOption, clocks_of
from tools.request import ExportFormat

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

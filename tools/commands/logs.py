"""The commands that watch and that use logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import EXIT_NO_POSE, JsonOption, clocks_of, flag, tell_of_compiling
from tools.request import ExportFormat, Pace, RunRequest


def monitor(
    context: typer.Context,
    log: Annotated[Path | None, typer.Argument(help="A log, in place of the bridge that runs.", metavar="LOG")] = None,
    port: Annotated[
        int | None, typer.Option(help="The bridge's port, where several run or it is not the usual one.")
    ] = None,
    once: Annotated[bool, flag("--once", "Show one page and exit.")] = False,
    json: JsonOption = False,
) -> None:
    """Watch a bridge that runs on this computer, or look through a log: rates, gaps, latency, NIS, links, alarms."""
    from tools.monitor.command import MonitorRequest, run_monitor

    run_monitor(MonitorRequest(log, port, once, json), clocks_of(context).stopwatch)


def export(
    log: Annotated[Path, typer.Argument(help="A log that `run` or `demo` wrote.")],
    format_: Annotated[
        ExportFormat,
        typer.Option("--format", help="tum: time and pose. csv, parquet, mat: every column. tlog: MAVLink as it went."),
    ],
    out: Annotated[
        Path | None, typer.Option(help="File to write, - for stdout; else beside the log.", metavar="FILE")
    ] = None,
    rate_hz: Annotated[
        float | None,
        typer.Option(
            "--rate_hz",
            "--rate-hz",
            metavar="R",
            help="Estimates and the autopilot's messages at a fixed rate on one clock, with an alignment report.",
        ),
    ] = None,
    gap_ms: Annotated[
        float | None,
        typer.Option(
            "--gap_ms",
            "--gap-ms",
            metavar="MS",
            help="Leave longer gaps empty; else those of three samples in a stream's own rhythm.",
        ),
    ] = None,
) -> None:
    """Write a log as a file that other programs read."""
    from tools.export.command import run_export
    from tools.export.export import ExportTerms

    run_export(log, ExportTerms(format_.value, rate_hz, gap_ms), out)


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
    overwrite: Annotated[bool, flag("--overwrite", "Replace a log that exists.")] = False,
    quiet: Annotated[bool, flag("--quiet", "Show no status line and no summary.")] = False,
) -> None:
    """Run the frames of a log through the tracker again; with its own settings it sends the same bytes.

    Exit code 0: done. 1: done, and no pose was found.
    """
    tell_of_compiling()
    from bridge.settings import config_path, load_settings
    from tools.replay import grounded, met_autopilot, settings_of
    from tools.session import run_session

    settings = (settings_of(log) if config is None else load_settings(config)).with_frames("off", None)
    if link:
        settings = settings.with_links(tuple(link))
    else:
        settings = grounded(settings, answered=pace is Pace.FAST and met_autopilot(log))
    own = None if config is None else config_path(config)
    request = RunRequest(settings, f"log:{log}", out, pace, summary, overwrite, quiet, own)
    if not run_session(request, clocks_of(context)):
        raise typer.Exit(EXIT_NO_POSE)


def compare(
    a: Annotated[Path, typer.Argument(help="The log of one run.", metavar="A")],
    b: Annotated[Path, typer.Argument(help="The log of another run of the same frames.", metavar="B")],
    truth: Annotated[Path | None, typer.Option(help="The recording, with its ground truth.", metavar="DIR")] = None,
    out: Annotated[Path | None, typer.Option(help="Draw the comparison here.", metavar="FILE.png")] = None,
    json: JsonOption = False,
) -> None:
    """Lay two runs beside each other: error, lag, NIS, latency, and whether they sent the same bytes."""
    from tools.compare.command import run_compare

    run_compare(a, b, truth, out, json)

"""The commands that fly: the main job, the demo, an autopilot's own software."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import EXIT_NO_POSE, ConfigOption, SourceOption, clocks_of, flag, tell_of_compiling
from tools.request import DemoRequest, FrameFormat, Pace, RunRequest
from tracker.errors import OperatorError

EXIT_PATH_NOT_HELD = 1
EXIT_FLIGHT_NOT_GOOD = 1


def run(
    context: typer.Context,
    config: ConfigOption = "lab",
    source: SourceOption = "camera:0,1",
    link: Annotated[
        list[str] | None,
        typer.Option(
            help="udpout:HOST:PORT, udpin:HOST:PORT, serial:DEVICE:BAUD or tcp:HOST:PORT, once for each link. "
            "Replaces the config's links.",
            metavar="URI",
        ),
    ] = None,
    log: Annotated[Path | None, typer.Option(help="Record everything in this MCAP file.", metavar="FILE")] = None,
    log_frames: Annotated[
        FrameFormat | None,
        typer.Option(help="Keep the frames in the log: png loses nothing, jpeg is small. Replaces the config's."),
    ] = None,
    log_frames_mb: Annotated[
        float | None, typer.Option(help="Room for them, in MB; then the flight goes on without.", min=1.0, metavar="MB")
    ] = None,
    pace: Annotated[
        Pace, typer.Option(help="real: as recorded. fast: as fast as it goes, same input, same bytes. Live is real.")
    ] = Pace.REAL,
    summary: Annotated[Path | None, typer.Option(help="Write the run's figures here.", metavar="FILE.json")] = None,
    overwrite: Annotated[bool, flag("--overwrite", "Replace a log that exists.")] = False,
    quiet: Annotated[bool, flag("--quiet", "Show no status line and no summary.")] = False,
) -> None:
    """Track the vehicle and send its pose to the autopilot; Ctrl-C ends it.

    Exit code 0: the source came to its end. 1: it did, and no pose was found in it. 130: interrupted.
    """
    tell_of_compiling()
    from bridge.settings import config_path, load_settings

    if log is None and (log_frames or log_frames_mb):
        raise OperatorError("--log-frames: there is no log to keep them in; add --log FILE.mcap")
    settings = load_settings(config).with_links(tuple(link or ())).with_frames(log_frames, log_frames_mb)
    if log_frames_mb and settings.log.frames == "off":
        raise OperatorError(f"--log-frames-mb {log_frames_mb:g}: no frames are kept; add --log-frames jpeg or png")
    request = RunRequest(settings, source, log, pace, summary, overwrite, quiet, config_path(config))

    from tools.session import run_session

    if not run_session(request, clocks_of(context)):
        raise typer.Exit(EXIT_NO_POSE)


def demo(
    context: typer.Context,
    duration_s: Annotated[
        float, typer.Option("--duration_s", "--duration-s", help="Length of the flight, in s.", metavar="S")
    ] = 60.0,
    seed: Annotated[int, typer.Option(help="Same seed, same flight, same noise.", metavar="N")] = 1,
    out: Annotated[Path, typer.Option(help="Folder for the log and the summary.", metavar="DIR")] = Path("logs/demo"),
    pace: Annotated[Pace, typer.Option(help="real: watch it fly. fast: as fast as it goes.")] = Pace.REAL,
    log_frames: Annotated[
        FrameFormat | None, typer.Option(help="Keep the frames in the log: png loses nothing, jpeg is small.")
    ] = None,
    excite: Annotated[
        Path | None, typer.Option(help="Fly this plan of `excite` in place of the mission.", metavar="PLAN.toml")
    ] = None,
) -> None:
    """Fly a simulated helicopter on simulated cameras, closed loop, with nothing attached.

    Exit code 0 only if it held its path; else 1.
    """
    request = DemoRequest(duration_s, seed, out, pace, log_frames)

    tell_of_compiling()
    if excite is not None:
        from tools.excite.fly import fly_plan
        from tools.excite.plan_file import read_plan

        if not fly_plan(request, read_plan(excite), clocks_of(context)).landed:
            raise typer.Exit(EXIT_PATH_NOT_HELD)
        return
    from tools.demo import run_demo

    if not run_demo(request, clocks_of(context)).verdict.passed:
        raise typer.Exit(EXIT_PATH_NOT_HELD)


def sitl(
    context: typer.Context,
    binary: Annotated[
        Path | None,
        typer.Option(help="ArduPilot's SITL program (docs/sitl.md); else the project's simulated autopilot."),
    ] = None,
    connect: Annotated[
        str | None,
        typer.Option(help="tcp:HOST:PORT of SERIAL0 of ArduPilot's SITL that runs already.", metavar="URI"),
    ] = None,
    frame: Annotated[str, typer.Option(help="The vehicle: heli.")] = "heli",
    config: ConfigOption = "lab",
    faults: Annotated[bool, flag("--faults", "Rehearse what may go wrong, in the air.")] = False,
    mistakes: Annotated[
        bool, flag("--mistakes", "Instead: true poses sent wrongly in every way known, a flight each.")
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder for log and report.", metavar="DIR")] = Path("logs/sitl"),
) -> None:
    """Fly an autopilot's own software on simulated cameras: origin, arming, hover, square, landing.

    Exit code 0 only if every figure keeps its limit; else 1. --mistakes judges nothing.
    """
    from tools.sitl.session import SitlRequest

    request = SitlRequest(binary, frame, config, out, faults, connect=connect, mistakes=mistakes)
    if mistakes:
        from tools.sitl.trials import run_trials

        run_trials(binary, config, out)
        return

    from tools.sitl.command import run_sitl

    if not run_sitl(request, clocks_of(context)).verdict.passed:
        raise typer.Exit(EXIT_FLIGHT_NOT_GOOD)

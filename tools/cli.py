"""The command line `posebridge`, and the only place that takes the real clock."""

from __future__ import annotations

import importlib.metadata
import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from tools.excite.command import register as register_excite
from tools.request import Clocks, DemoRequest, ExportFormat, Pace, RunRequest
from tools.sysid.command import register as register_sysid
from tracker.errors import OperatorError

EXIT_PATH_NOT_HELD = 1
EXIT_COLOURS_NOT_GOOD = 1
EXIT_FLIGHT_NOT_GOOD = 1
EXIT_CHECK_NOT_GOOD = 1
EXIT_OPERATOR = 2
EXIT_INTERRUPTED = 130
STDOUT = Path("-")
ONE_THREAD_EACH = ("OPENCV_FOR_THREADS_NUM", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
bench = typer.Typer(help="Measure accuracy, speed and memory: the figures in docs/benchmarks.md.")
app.add_typer(bench, name="bench")
register_sysid(app)
register_excite(app)
ConfigOption = Annotated[str, typer.Option(help="A shipped config by name, or a path to a .toml.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")]

# Commands import what they need when they run, so that `--help` and a mistyped option answer at once.


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 demo failed, 2 something the operator can mend, 130 interrupted."""
    sys.exit(run_command_line(sys.argv[1:] if arguments is None else arguments))


def run_command_line(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code; what the operator can mend is one line on stderr."""
    _keep_to_one_core()
    _interrupt_once()
    try:
        return int(app(list(arguments), prog_name="posebridge", standalone_mode=False) or 0)
    except typer.TyperException as error:
        return _refuse(f"{error.format_message().rstrip('.')}; see `posebridge --help`")
    except OperatorError as error:
        return _refuse(str(error))
    except KeyboardInterrupt:  # before the command began; within it, typer itself returns 130
        return EXIT_INTERRUPTED


def _keep_to_one_core() -> None:
    """Stop OpenCV and BLAS from starting a thread for each core: images here are small, the other cores others' work.

    It is told by the environment, before they are loaded; what the operator has set there stays.
    """
    for name in ONE_THREAD_EACH:
        os.environ.setdefault(name, "1")


def _refuse(message: str) -> int:
    sys.stderr.write(f"posebridge: error: {' '.join(message.split())}\n")
    return EXIT_OPERATOR


def _interrupt_once() -> None:
    """Let the first SIGINT or SIGTERM end the run in order, as a KeyboardInterrupt, and later ones pass.

    `timeout`, and Ctrl-C through `make`, may signal twice: the second must not spoil the closing of the log.
    """

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, interrupt)


def _clocks() -> Clocks:
    return Clocks(monotonic=time.monotonic_ns, stopwatch=time.perf_counter_ns, wall=time.time_ns, sleep_s=time.sleep)


def _tell_of_compiling() -> None:
    from tools.first_start import tell_of_compiling

    tell_of_compiling(lambda line: typer.echo(f"posebridge: {line}", err=True))


def _print_version(wanted: bool) -> None:
    if wanted:
        try:
            version = importlib.metadata.version("posebridge")
        except importlib.metadata.PackageNotFoundError:
            version = "(a checkout that is not installed)"
        typer.echo(f"posebridge {version}")
        raise typer.Exit


@app.callback()
def posebridge(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Cameras watch coloured balls on a vehicle; its autopilot gets its pose over MAVLink.

    Exit code 0: done. 2: something you can mend, told in one line. 130: interrupted, links and log closed in order.
    """


@app.command()
def run(
    config: ConfigOption = "lab",
    source: Annotated[
        str, typer.Option(help="recording:DIR, video:A.mp4,B.mp4, camera:0,1 or sim:NAME.", metavar="URI")
    ] = "camera:0,1",
    link: Annotated[
        list[str] | None,
        typer.Option(
            help="udpout:HOST:PORT, udpin:HOST:PORT, serial:DEVICE:BAUD or tcp:HOST:PORT, once for each link. "
            "Replaces the config's links.",
            metavar="URI",
        ),
    ] = None,
    log: Annotated[Path | None, typer.Option(help="Record everything in this MCAP file.", metavar="FILE")] = None,
    pace: Annotated[
        Pace, typer.Option(help="real: as recorded. fast: as fast as it goes, same input, same bytes. Live is real.")
    ] = Pace.REAL,
    summary: Annotated[Path | None, typer.Option(help="Write the run's figures here.", metavar="FILE.json")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a log that exists.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show no status line and no summary.")] = False,
) -> None:
    """Track the vehicle and send its pose to the autopilot; Ctrl-C ends it."""
    _tell_of_compiling()
    from bridge.settings import load_settings

    settings = load_settings(config).with_links(tuple(link or ()))
    request = RunRequest(settings, source, log, pace, summary, overwrite, quiet)

    from tools.session import run_session

    run_session(request, _clocks())


@app.command()
def demo(
    duration_s: Annotated[
        float, typer.Option("--duration_s", "--duration-s", help="Length of the flight [s].", metavar="S")
    ] = 60.0,
    seed: Annotated[int, typer.Option(help="Same seed, same flight, same noise.", metavar="N")] = 1,
    out: Annotated[Path, typer.Option(help="Folder for the log and the summary.", metavar="DIR")] = Path("logs/demo"),
    pace: Annotated[Pace, typer.Option(help="real: watch it fly. fast: as fast as it goes.")] = Pace.REAL,
    excite: Annotated[
        Path | None, typer.Option(help="Fly this plan of `excite` in place of the mission.", metavar="PLAN.toml")
    ] = None,
) -> None:
    """Fly a simulated helicopter on simulated cameras, closed loop, with nothing attached.

    Exit code 0 only if it held its path; else 1.
    """
    request = DemoRequest(duration_s, seed, out, pace)

    _tell_of_compiling()
    if excite is not None:
        from tools.excite.fly import fly_plan
        from tools.excite.plan_file import read_plan

        if not fly_plan(request, read_plan(excite), _clocks()).landed:
            raise typer.Exit(EXIT_PATH_NOT_HELD)
        return
    from tools.demo import run_demo

    if not run_demo(request, _clocks()).verdict.passed:
        raise typer.Exit(EXIT_PATH_NOT_HELD)


@app.command()
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


@app.command()
def monitor(
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

    run_monitor(MonitorRequest(log, port, once, json), _clocks().stopwatch)


@app.command()
def key(file: Annotated[Path, typer.Argument(help="The file to make; none may be there yet.")]) -> None:
    """Make a secret key for MAVLink 2 signing, for `[mavlink] signing_key` in the config (docs/autopilots.md)."""
    from bridge.signing import make_key

    make_key(file)
    typer.echo(f"{file}: 64 hexadecimal digits, mode 600; name it as [mavlink] signing_key in the config", err=True)


@app.command()
def colours(
    config: ConfigOption = "lab",
    source: Annotated[
        str, typer.Option(help="recording:DIR, video:A.mp4,B.mp4, camera:0,1 or sim:NAME.", metavar="URI")
    ] = "camera:0,1",
    frames: Annotated[int, typer.Option(help="Read at most so many frames of each camera.", metavar="N")] = 300,
    picture: Annotated[
        Path | None, typer.Option(help="Show here what would be detected, and what clashes.", metavar="FILE.png")
    ] = None,
    write: Annotated[
        Path | None, typer.Option(help="Write a copy of the config with the learned colours.", metavar="FILE.toml")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a config that exists.")] = False,
    json: JsonOption = False,
) -> None:
    """Learn the balls' colours from footage and warn of things in the room that look like them.

    Carry the vehicle slowly through the room meanwhile. Exit code 1 when the colours are not good to fly with.
    """
    _tell_of_compiling()
    from tools.colours.command import ColoursRequest, run_colours

    request = ColoursRequest(config, source, frames, picture, write, overwrite, json)
    if not run_colours(request, _clocks()).good:
        raise typer.Exit(EXIT_COLOURS_NOT_GOOD)


@bench.command()
def accuracy(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings with ground truth.", metavar="DIR...")],
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Compare estimates with the truth, by the filter and by the paper's own method."""
    _tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_accuracy

    bench_accuracy(recordings, load_settings(config), _clocks(), json)


@bench.command()
def speed(
    pairs: Annotated[int, typer.Option(help="Stereo pairs to track.", min=1)] = 1000,
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Time tracking and acquisition with the frames in memory."""
    _tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_speed
    from tools.bench.meter import CpuClocks

    cpu = CpuClocks(process=time.process_time_ns, thread=time.thread_time_ns)
    bench_speed(pairs, load_settings(config), _clocks(), cpu, json)


@bench.command()
def memory(
    pairs: Annotated[int, typer.Option(help="Stereo pairs to run.", min=10)] = 20_000,
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Watch the process's size over a long run with link and log."""
    _tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_memory

    bench_memory(pairs, load_settings(config), _clocks(), json)


@bench.command()
def consistency(
    seeds: Annotated[int, typer.Option(help="Simulated flights.", min=1)] = 50,
    gamma: Annotated[float, typer.Option(help="Of the simulated cameras; 1 is linear.", min=1.0, max=3.0)] = 2.2,
    json: JsonOption = False,
) -> None:
    """Fly many simulated flights and see whether the filter's covariance is true."""
    _tell_of_compiling()
    from tools.bench.commands import bench_consistency

    bench_consistency(seeds, gamma, json)


@bench.command()
def rooms(
    seed: Annotated[int, typer.Option(help="Same seed, same flight, same noise.", min=0)] = 1,
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Track simulated flights in other light, through other cameras, at other speeds."""
    _tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_rooms

    bench_rooms(load_settings(config), seed, json)


@app.command()
def sitl(
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
    faults: Annotated[bool, typer.Option("--faults", help="Rehearse what may go wrong, in the air.")] = False,
    out: Annotated[Path, typer.Option(help="Folder for log and report.", metavar="DIR")] = Path("logs/sitl"),
) -> None:
    """Fly an autopilot's own software on simulated cameras: origin, arming, hover, square, landing.

    Exit code 0 only if every figure keeps its limit; else 1.
    """
    from tools.sitl.session import SitlRequest

    request = SitlRequest(binary, frame, config, out, faults, connect=connect)

    from tools.sitl.command import run_sitl

    if not run_sitl(request, _clocks()).verdict.passed:
        raise typer.Exit(EXIT_FLIGHT_NOT_GOOD)


@app.command()
def check(
    config: ConfigOption = "lab",
    source: Annotated[
        str, typer.Option(help="As for run; none: look at the autopilot alone, without poses.", metavar="URI")
    ] = "camera:0,1",
    link: Annotated[
        str | None, typer.Option(help="The autopilot's link, as for run. Replaces the config's.", metavar="URI")
    ] = None,
    duration_s: Annotated[
        float, typer.Option("--duration_s", "--duration-s", help="How long poses are watched [s].", metavar="S")
    ] = 10.0,
    frame: Annotated[bool, typer.Option("--frame", help="Lead through the frame check: four moves by hand.")] = False,
    wiggle: Annotated[bool, typer.Option("--wiggle", help="Find the delay while you wiggle the vehicle.")] = False,
    apply: Annotated[bool, typer.Option("--apply", help="Write the wrong parameters, after asking.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before writing.")] = False,
    json: JsonOption = False,
) -> None:
    """Prove before take-off that the autopilot uses the poses: one page, a verdict a line, with its fix.

    Exit code 0 when nothing speaks against flying; 1 when something failed or could not be seen.
    """
    from tools.check.request import CheckRequest

    request = CheckRequest(config, source, link, duration_s, frame, wiggle, apply, yes, json)

    _tell_of_compiling()
    from tools.check.session import run_check

    if not run_check(request, _clocks()):
        raise typer.Exit(EXIT_CHECK_NOT_GOOD)

"""The command line `posebridge`, and the only place that takes the real clock."""

from __future__ import annotations

import importlib.metadata
import os
import signal
import sys
import time
from collections.abc import Sequence
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tools.commands import fly, identify, logs, place, prepare
from tools.commands.bench import bench
from tools.commands.calibrate import calibrate
from tools.commands.common import RealClocks
from tools.commands.group import Commands
from tools.request import Clocks, CpuClocks
from tools.start import EXIT_INTERRUPTED
from tracker.errors import OperatorError

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

EXIT_OPERATOR = 2
ONE_THREAD_EACH = ("OPENCV_FOR_THREADS_NUM", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

app = Commands(add_completion=False, pretty_exceptions_enable=False)
_COMMANDS = (
    fly.run, fly.demo, logs.replay, logs.compare, logs.export, logs.monitor, prepare.key, prepare.colours, place.place,
    fly.sitl, prepare.check, identify.excite, identify.sysid,
)  # fmt: skip
for command in _COMMANDS:
    app.command()(command)
app.add_typer(bench, name="bench")
app.add_typer(calibrate, name="calibrate")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 not good, 2 something the operator can mend, 130 interrupted."""
    sys.exit(run_command_line(sys.argv[1:] if arguments is None else arguments))


def run_command_line(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code; what the operator can mend is one line on stderr."""
    _keep_to_one_core()
    _interrupt_once()
    try:
        return int(app(list(arguments), prog_name="posebridge", standalone_mode=False) or 0)
    except typer.TyperException as error:
        message = error.format_message().replace("Value error, ", "").rstrip(".")
        return _refuse(f"{message}; see `{_named_in(arguments)} --help`")
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


def _named_in(arguments: Sequence[str]) -> str:
    """Return the command that arguments begin with, as far as there is one: its help page lists its options."""
    words: list[str] = ["posebridge"]
    known: Any = typer.main.get_command(app)
    for word in arguments:
        known = getattr(known, "commands", {}).get(word)
        if known is None:
            break
        words.append(word)
    return " ".join(words)


def _refuse(message: str) -> int:
    sys.stderr.write(f"posebridge: error: {' '.join(message.split())}\n")
    return EXIT_OPERATOR


def _interrupt_once() -> None:
    """Let the first SIGINT or SIGTERM end the run in order, as a KeyboardInterrupt, and later ones pass.

    `timeout`, and Ctrl-C through `make`, may signal twice: the second must not spoil the closing of the log. One that
    comes while a library written in C calls back is lost, since no exception rises through it: then the next counts.
    """

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    def lost(unraisable: UnraisableHookArgs) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            listen()
        else:
            heard_before(unraisable)

    def listen() -> None:
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, interrupt)

    heard_before, sys.unraisablehook = sys.unraisablehook, lost
    listen()


def _real_clocks() -> RealClocks:
    return RealClocks(
        Clocks(monotonic=time.monotonic_ns, stopwatch=time.perf_counter_ns, wall=time.time_ns, sleep_s=time.sleep),
        CpuClocks(process=time.process_time_ns, thread=time.thread_time_ns),
    )


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
    context: typer.Context,
    _version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version and exit.", metavar="", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    """Cameras watch coloured balls on a vehicle; its autopilot gets its pose over MAVLink.

    Exit code 0: done.
    1: done, and not good: a run without a pose, the path of a demo, colours, a place, a calibration, a check.
    2: something you can mend, told in one line.
    130: interrupted, links and log closed in order.
    """
    context.obj = _real_clocks()

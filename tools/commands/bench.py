"""`posebridge bench`: accuracy, speed, memory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import ConfigOption, JsonOption, clocks_of, cpu_clocks_of, tell_of_compiling
from tools.commands.group import Commands
from tools.request import ExportFormat

bench = Commands(help="Measure accuracy, speed and memory: the figures in docs/benchmarks.md.")


@bench.command()
def accuracy(
    context: typer.Context,
    recordings: Annotated[list[Path], typer.Argument(help="Recordings with ground truth.", metavar="DIR...")],
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Compare estimates with the truth, by the filter and by the paper's own method."""
    tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_accuracy

    bench_accuracy(recordings, load_settings(config), clocks_of(context), json)


@bench.command()
def speed(
    context: typer.Context,
    pairs: Annotated[int, typer.Option(help="Stereo pairs to track.", min=1)] = 1000,
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Time tracking and acquisition with the frames in memory."""
    tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_speed

    bench_speed(pairs, load_settings(config), clocks_of(context), cpu_clocks_of(context), json)


@bench.command()
def memory(
    context: typer.Context,
    pairs: Annotated[int, typer.Option(help="Stereo pairs to run.", min=10)] = 20_000,
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Watch the process's size over a long run with link and log."""
    tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_memory

    bench_memory(pairs, load_settings(config), clocks_of(context), json)


@bench.command()
def export(
    context: typer.Context,
    hours: Annotated[float, typer.Option(help="Length of the log.", min=0.01)] = 8.0,
    rate_hz: Annotated[
        float, typer.Option("--rate_hz", "--rate-hz", help="Rows a second.", min=0.1, max=2000.0)
    ] = 50.0,
    format_: Annotated[ExportFormat, typer.Option("--format", help="As for export.")] = ExportFormat.PARQUET,
    json: JsonOption = False,
) -> None:
    """Write a long log, export it at a fixed rate, and watch time and memory."""
    from tools.bench.commands import bench_export

    bench_export(hours, rate_hz, format_.value, cpu_clocks_of(context), json)


@bench.command()
def consistency(
    seeds: Annotated[int, typer.Option(help="Simulated flights.", min=1)] = 50,
    gamma: Annotated[float, typer.Option(help="Of the simulated cameras; 1 is linear.", min=1.0, max=3.0)] = 2.2,
    json: JsonOption = False,
) -> None:
    """Fly many simulated flights and see whether the filter's covariance is true."""
    tell_of_compiling()
    from tools.bench.commands import bench_consistency

    bench_consistency(seeds, gamma, json)


@bench.command()
def rooms(
    seed: Annotated[int, typer.Option(help="Same seed, same flight, same noise.", min=0)] = 1,
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Track simulated flights in other light, through other cameras, at other speeds."""
    tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_rooms

    bench_rooms(load_settings(config), seed, json)


@bench.command()
def calibration(
    seeds: Annotated[int, typer.Option(help="Drawn rooms of each kind.", min=1)] = 3,
    jpeg_quality: Annotated[
        int,
        typer.Option("--jpeg_quality", "--jpeg-quality", help="Also through JPEG; 0 for none.", min=0, max=100),
    ] = 90,
    config: ConfigOption = "lab",
    json: JsonOption = False,
) -> None:
    """Calibrate drawn rooms of two to eight cameras with the waved marker, and hold them against the truth."""
    tell_of_compiling()
    from bridge.settings import load_settings
    from tools.bench.commands import bench_calibration

    bench_calibration(load_settings(config), seeds, jpeg_quality, json)

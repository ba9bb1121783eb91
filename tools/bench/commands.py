"""`posebridge bench`: its commands and how their figures are shown."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Iterator
from pathlib import Path

from rich.table import Table

from bridge.settings import Settings
from bridge.summary import to_text
from tools.bench.accuracy import Accuracy, Limit, measure_accuracy
from tools.bench.calibration import CLAIM_DEG, CLAIM_MM, CLAIM_MS, Rooms, measure_calibration
from tools.bench.consistency import Average, measure_consistency
from tools.bench.export import measure_export
from tools.bench.memory import measure_memory
from tools.bench.rooms import measure_rooms
from tools.bench.speed import Speed, measure_speed
from tools.request import Clocks, CpuClocks
from tools.screen import screen

WIDTH = 140  # of the accuracy table; a narrower terminal wraps it


def bench_accuracy(recordings: list[Path], settings: Settings, clocks: Clocks, as_json: bool) -> None:
    """Compare both methods with the truth of each recording."""
    methods = [_with_method(settings, method) for method in ("ekf", "paper")]
    results = [result for directory in recordings for result in measure_accuracy(directory, methods, clocks)]
    if as_json:
        _print_json([dataclasses.asdict(result) for result in results])
        return
    names = ("recording", "method", "poses", "mm mean", "sd", "max", "deg mean", "sd", "max", "roll", "pitch", "yaw")
    table = Table(box=None, pad_edge=False)
    for column in (*names, "NEES / 6", "95 % band"):
        table.add_column(column, justify="left" if column in names[:2] else "right", no_wrap=True)
    for result in results:
        table.add_row(*_row(result))
    console = screen()
    wide = screen(width=max(console.width, WIDTH))
    wide.print(table)
    wide.print()
    wide.print(_limits(results))


def _limits(results: list[Accuracy]) -> Table:
    """Return rms errors, Cramer-Rao bounds and their ratio, for each ball and for the pose."""
    table = Table(box=None, pad_edge=False, title="rms error / Cramer-Rao bound = ratio", title_justify="left")
    table.add_column("recording", no_wrap=True)
    table.add_column("method", no_wrap=True)
    for name in (*(f"{ball} px" for ball in results[0].balls_px), "position mm", "attitude deg"):
        table.add_column(name, justify="right", no_wrap=True)
    for result in results:
        limits = (*result.balls_px.values(), result.position_limit_mm, result.attitude_limit_deg)
        table.add_row(result.recording, result.method, *(_cell(limit) for limit in limits))
    return table


def _cell(limit: Limit) -> str:
    return f"{limit.rms:.3f} / {limit.bound:.3f} = {limit.ratio:.1f}"


def bench_speed(pairs: int, settings: Settings, clocks: Clocks, cpu: CpuClocks, as_json: bool) -> None:
    """Time tracking and acquisition."""
    result = measure_speed(settings, clocks, cpu, pairs)
    if as_json:
        _print_json(_plain(dataclasses.asdict(result)))
        return
    console = screen()
    core = "one core" if result.pinned else "whatever cores the system gave"
    console.print(f"{result.pairs} pairs on {core}, frames and link in memory, log on disk")
    console.print(
        f"{result.pairs_per_cpu_s:.0f} pairs/s of the process's CPU time, {result.pairs_per_s:.0f} by the wall clock"
    )
    console.print(_stages_table(result))
    slow = result.slow
    causes = ", ".join(f"{count} by {cause}" for cause, count in slow.causes.items())
    console.print(
        f"{slow.over_limit} pairs over {slow.limit_ms:g} ms; the {slow.worst} slowest were held up: {causes}",
        soft_wrap=True,
    )
    console.print(
        f"log thread {result.log_thread_ms:.3f} ms of CPU time and {result.log_bytes:.0f} bytes a pair, on average\n"
    )
    console.print(to_text(result.run), soft_wrap=True)


def bench_memory(pairs: int, settings: Settings, clocks: Clocks, as_json: bool) -> None:
    """Watch the process's size over a long run."""
    result = measure_memory(settings, clocks, pairs)
    if as_json:
        _print_json(dataclasses.asdict(result))
        return
    table = Table("pairs", "resident MB", box=None, pad_edge=False)
    for done, size_mb in result.resident_mb.items():
        table.add_row(str(done), f"{size_mb:.1f}")
    console = screen()
    console.print(table)
    console.print(f"peak {result.peak_mb:.1f} MB, frames in memory included; log {result.log_mb:.1f} MB")


def bench_export(hours: float, rate_hz: float, format: str, cpu: CpuClocks, as_json: bool) -> None:
    """Export a long log and watch the process's size."""
    result = measure_export(hours, rate_hz, format, cpu)
    if as_json:
        _print_json(dataclasses.asdict(result))
        return
    console = screen()
    console.print(f"{result.hours:g} h of log, {result.log_mb:.0f} MB, written in {result.write_cpu_s:.1f} s of CPU")
    console.print(f"{result.rows} rows of {result.format} in {result.export_cpu_s:.1f} s of CPU")
    quarters = ", ".join(f"{mb:.0f}" for mb in result.grown_by_quarter_mb)
    console.print(
        f"memory grew by {result.grown_mb:.0f} MB at most; at a quarter, half, three quarters by {quarters} MB"
    )


def bench_consistency(seeds: int, gamma: float, as_json: bool) -> None:
    """Compare the errors of simulated flights with what the filter said of them."""
    result = measure_consistency(seeds, gamma)
    if as_json:
        _print_json(dataclasses.asdict(result))
        return
    table = Table("", "mean", "95 % band", "", "rms error", box=None, pad_edge=False)
    units = {"position": "mm", "attitude": "deg", "velocity": "m/s", "rate": "deg/s"}
    for name, unit in units.items():
        table.add_row(f"NEES {name} / 3", *_average(result.nees[name]), f"{result.rms[name]:.3f} {unit}")
    table.add_row("NIS / dof", *_average(result.nis), "")
    console = screen()
    console.print(table)
    console.print(
        f"{result.seeds} flights, gamma {result.gamma:g}, {result.instants} instants, "
        f"{result.missing} of them without estimate; "
        f"{result.wrong} of {result.estimates} estimates outside 5 sigma"
    )


def bench_rooms(settings: Settings, seed: int, as_json: bool) -> None:
    """Show the accuracy in simulated rooms of many kinds."""
    results = measure_rooms(settings, seed)
    if as_json:
        _print_json([dataclasses.asdict(result) for result in results])
        return
    names = ("poses", "mm mean", "max", "deg mean", "max", "NEES / 6", "wrong", "m/s rms", "deg/s rms")
    table = Table("room", box=None, pad_edge=False)
    for name in names:
        table.add_column(name, justify="right", no_wrap=True)
    for r in results:
        errors = (f"{figure:.3f}" for figure in (r.mm_mean, r.mm_max, r.deg_mean, r.deg_max))
        speeds = (f"{figure:.3f}" for figure in (r.speed_rms_m_s, r.rate_rms_deg_s))
        table.add_row(r.name, f"{r.estimates}/{r.frames}", *errors, f"{r.nees:.2f}", str(r.wrong), *speeds)
    console = screen()
    screen(width=max(console.width, WIDTH)).print(table)


def bench_calibration(settings: Settings, seeds: int, jpeg_quality: int, as_json: bool) -> None:
    """Show how well drawn rooms are calibrated."""
    results = measure_calibration(settings, seeds, (0, jpeg_quality) if jpeg_quality else (0,))
    if as_json:
        _print_json([dataclasses.asdict(result) for result in results])
        return
    table = Table("rooms", box=None, pad_edge=False)
    names = ("place mm mean", "max", "of sigma", "turn deg max", "of sigma", "clock ms max", "of sigma", "too long %")
    for name in (*names, "beyond the claim"):
        table.add_column(name, justify="right", no_wrap=True)
    for kind in results:
        through = f", JPEG {kind.jpeg_quality}" if kind.jpeg_quality else ""
        table.add_row(f"{len(kind.rooms)} of {kind.cameras} cameras{through}", *_missed(kind))
    console = screen()
    screen(width=max(console.width, WIDTH)).print(table)
    console.print(
        f"claim: {CLAIM_MM:g} mm, {CLAIM_DEG:g} deg, {CLAIM_MS:g} ms of every camera; beyond it so many rooms in "
        "place, turn and clock",
        soft_wrap=True,
    )


def _missed(kind: Rooms) -> Iterator[str]:
    """Yield the cells of a kind of rooms: means of the first and of the scale, else its worst."""
    rooms = [dataclasses.astuple(room) for room in kind.rooms]
    place, turn, clock, of_place, of_turn, of_clock, longer = zip(*rooms, strict=True)
    yield f"{sum(place) / len(place):.2f}"
    for worst, of_sigma, digits in ((place, of_place, 2), (turn, of_turn, 3), (clock, of_clock, 3)):
        yield f"{max(worst):.{digits}f}"
        yield f"{max(of_sigma):.1f}"
    yield f"{100 * sum(longer) / len(longer):+.3f}"
    yield " ".join(str(count) for count in kind.beyond)


def _average(value: Average) -> list[str]:
    low, high = value.band
    return [f"{value.mean:.2f}", f"{low:.2f}..{high:.2f}", "inside" if value.honest else "OUTSIDE"]


def _with_method(settings: Settings, method: str) -> Settings:
    return settings.model_copy(update={"tracker": settings.tracker.model_copy(update={"method": method})})


def _row(result: Accuracy) -> list[str]:
    low, high = result.nees_band
    figures = [*dataclasses.astuple(result.position_mm), *dataclasses.astuple(result.attitude_deg)]
    return [
        result.recording,
        result.method,
        f"{result.estimates}/{result.pairs}",
        *(f"{figure:.3f}" for figure in (*figures, *result.angles_deg)),
        f"{result.nees / 6.0:.2f}",
        f"{low / 6.0:.2f}..{high / 6.0:.2f}",
    ]


def _stages_table(result: Speed) -> Table:
    """Lay out where the time of a pair goes."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("a pair (ms)")
    for column in ("p50", "p95", "p99", "max", "share"):
        table.add_column(column, justify="right")
    rows = {
        "acquisition": result.acquire_ms,
        "snapshot": result.snapshot_ms,
        "whole pair": result.pair_ms,
        **result.stages_ms,
    }
    for name, spread in rows.items():
        figures = (spread.p50, spread.p95, spread.p99, spread.max)
        share = f"{result.shares[name]:.1%}" if name in result.shares else ""
        table.add_row(name, *("-" if figure is None else f"{figure:.3f}" for figure in figures), share)
    return table


def _plain(value: object) -> object:
    """Return mappings of a dataclass as plain dicts."""
    return json.loads(json.dumps(value, default=lambda mapping: dict(mapping)))


def _print_json(value: object) -> None:
    sys.stdout.write(json.dumps(value, indent=2) + "\n")

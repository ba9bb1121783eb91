"""`posebridge bench`: its commands and how their figures are shown."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from bridge.settings import Settings
from bridge.summary import to_text
from tools.bench.accuracy import Accuracy, measure_accuracy
from tools.bench.memory import measure_memory
from tools.bench.speed import CpuClocks, Speed, measure_speed
from tools.request import Clocks

WIDTH = 140  # of the accuracy table; a narrower terminal wraps it


def bench_accuracy(recordings: list[Path], settings: Settings, clocks: Clocks, as_json: bool) -> None:
    """Compare both methods with the truth of each recording."""
    results = [
        measure_accuracy(directory, _with_method(settings, method), clocks)
        for directory in recordings
        for method in ("ekf", "paper")
    ]
    if as_json:
        _print_json([dataclasses.asdict(result) for result in results])
        return
    names = ("recording", "method", "poses", "mm mean", "sd", "max", "deg mean", "sd", "max", "roll", "pitch", "yaw")
    table = Table(box=None, pad_edge=False)
    for column in (*names, "NEES / 6", "95 % band"):
        table.add_column(column, justify="left" if column in names[:2] else "right", no_wrap=True)
    for result in results:
        table.add_row(*_row(result))
    console = Console()
    Console(width=max(console.width, WIDTH)).print(table)


def bench_speed(pairs: int, settings: Settings, clocks: Clocks, cpu: CpuClocks, as_json: bool) -> None:
    """Time tracking and acquisition."""
    result = measure_speed(settings, clocks, cpu, pairs)
    if as_json:
        _print_json(_plain(dataclasses.asdict(result)))
        return
    console = Console()
    core = "one core" if result.pinned else "whatever cores the system gave"
    console.print(f"{result.pairs} pairs on {core}, frames and link in memory, log on disk")
    console.print(
        f"{result.pairs_per_cpu_s:.0f} pairs/s of the process's CPU time, {result.pairs_per_s:.0f} by the wall clock"
    )
    console.print(_stages_table(result))
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
    console = Console()
    console.print(table)
    console.print(f"peak {result.peak_mb:.1f} MB, frames in memory included; log {result.log_mb:.1f} MB")


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
    for column in ("p50", "p95", "p99", "max"):
        table.add_column(column, justify="right")
    rows = {"whole pair": result.pair_ms, "acquisition": result.acquire_ms, **result.stages_ms}
    for name, spread in rows.items():
        figures = (spread.p50, spread.p95, spread.p99, spread.max)
        table.add_row(name, *("-" if figure is None else f"{figure:.3f}" for figure in figures))
    return table


def _plain(value: object) -> object:
    """Return mappings of a dataclass as plain dicts."""
    return json.loads(json.dumps(value, default=lambda mapping: dict(mapping)))


def _print_json(value: object) -> None:
    sys.stdout.write(json.dumps(value, indent=2) + "\n")

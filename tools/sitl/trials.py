"""`posebridge sitl --mistakes`: every mistake tried, one flight each, and laid out in a table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.table import Table
from rich.text import Text

from bridge.settings import load_settings
from tools.screen import screen
from tools.sitl.command import WIDTH
from tools.sitl.mistakes import MISTAKES, Mistake
from tools.sitl.trial import Trial, attempt

RESULTS = "mistakes.json"


def run_trials(binary: Path | None, config: str, out: Path, mistakes: Sequence[Mistake] = MISTAKES) -> list[Trial]:
    """Try mistakes, print what came of them on stdout, and leave it in the folder. See `attempt`."""
    settings, console = load_settings(config), screen()
    console.width = max(console.width, WIDTH)
    out.mkdir(parents=True, exist_ok=True)
    trials = []
    for number, mistake in enumerate(mistakes):
        trial = attempt(mistake, settings, binary, out / f"{number:02d}")
        trials.append(trial)
        console.print(f"{trial.mistake}: {'; '.join(trial.texts) or 'nothing said'}", soft_wrap=True)
    console.print(table_of(trials))
    (out / RESULTS).write_text(json.dumps([asdict(each) for each in trials], indent=2) + "\n", encoding="utf-8")
    return trials


def table_of(trials: Sequence[Trial]) -> Table:
    """Lay trials out for a terminal."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for head in ("mistake", "EKF error", "off its path", "EKF ratio", "position", "fail-safe"):
        table.add_column(head, justify="left" if head == "mistake" else "right", no_wrap=True)
    for each in trials:
        table.add_row(
            each.mistake,
            f"{each.ekf_error_mm:.0f} mm",
            f"{each.off_path_mm:.0f} mm",
            f"{each.worst_ratio:.2f}",
            Text("lost", "red") if each.lost_position else "kept",
            Text("ACTED", "red") if each.landed else "no",
        )
        if each.grounded:
            table.add_row(f"  {each.grounded}")
    return table

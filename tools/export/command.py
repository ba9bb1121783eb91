"""`posebridge export`: the file, the bar, and what there is to say."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from rich.console import Console

from bridge.log.reader import LogReader
from tools.export.export import ExportTerms, export, out_beside
from tools.export.progress import progress
from tools.export.report import to_text
from tools.screen import screen

STDOUT = Path("-")
WIDTH = 140  # of the report where no terminal says otherwise
WHAT = {"tlog": "messages"}


def run_export(log: Path, terms: ExportTerms, out: Path | None) -> None:
    """Export a log. out: `-` for stdout, None for a file beside the log.

    Raises:
        OperatorError: see `export`.
    """
    LogReader(log)  # says what is wrong with it, before anything is shown
    console = screen(stderr=True, soft_wrap=True)
    if not console.is_terminal:
        console = screen(stderr=True, soft_wrap=True, width=WIDTH)
    if out == STDOUT:
        with tempfile.TemporaryDirectory() as folder:
            _write(log, terms, Path(folder) / "table", console)
            with (Path(folder) / "table").open("rb") as file:
                shutil.copyfileobj(file, sys.stdout.buffer)
            sys.stdout.flush()  # here, so that a reader who left, as `head` does, is noticed in time
        return
    out = out or out_beside(log, terms.format)
    count = _write(log, terms, out, console)
    what = WHAT.get(terms.format, "estimates" if terms.rate_hz is None else "rows")
    console.print(f"{count} {what} written to {out}")


def _write(log: Path, terms: ExportTerms, path: Path, console: Console) -> int:
    with progress(console, log.stat().st_size, 1 if terms.rate_hz is None else 2) as on_offset:
        done = export(log, terms, path, on_offset)
    if done.alignment is not None:
        console.print(to_text(done.alignment))
    for loss in done.lost:
        console.print(f"posebridge: warning: {log}: {loss}", style="yellow")
    return done.count

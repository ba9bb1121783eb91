"""Export a log: choose the walk and the writer, write whole or not at all, report."""

from __future__ import annotations

import glob
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bridge.log import topics
from bridge.log.losses import Loss
from bridge.log.reader import LogReader, OnOffset
from tools.export import native, tables
from tools.export.grid import Grid
from tools.export.lines import write_csv, write_tum
from tools.export.outfile import whole_or_absent
from tools.export.report import Report, report_of, to_json
from tools.export.survey import survey
from tools.export.tlog import Topics, links_of, write_tlog
from tools.kept import are_one, keep
from tracker.errors import OperatorError

FORMATS = ("csv", "mat", "parquet", "tlog", "tum")
RATES_HZ = (0.1, 2000.0)
_ESTIMATES = frozenset({topics.ESTIMATE.name})
_LINES = {"csv": write_csv, "tum": write_tum}


@dataclass(frozen=True, slots=True)
class ExportTerms:
    """How a log is exported.

    format: one of FORMATS.  rate_hz: of the fixed grid, None for each estimate at its own time.
    gap_ms: gaps longer than this stay empty [ms], None for three times what is usual between a stream's samples.
    Raises:
        OperatorError: an unknown format, or a rate or a gap that cannot be.
    """

    format: str
    rate_hz: float | None = None
    gap_ms: float | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        if self.format not in FORMATS:
            raise OperatorError(f"export: unknown format {self.format!r}; known are {', '.join(FORMATS)}")
        low, high = RATES_HZ
        if self.rate_hz is not None and not low <= self.rate_hz <= high:
            raise OperatorError(f"--rate_hz: {self.rate_hz:g} Hz must be {low:g} to {high:g} Hz; give a rate within")
        if self.gap_ms is not None and not self.gap_ms > 0:
            raise OperatorError(f"--gap_ms: {self.gap_ms:g} ms must be positive; give a longer one")
        if self.gap_ms is not None and self.rate_hz is None:
            raise OperatorError(
                f"--gap_ms: {self.gap_ms:g} ms: only rows at a fixed rate have gaps; give --rate_hz too"
            )
        if self.format == "tlog" and self.rate_hz is not None:
            raise OperatorError("--rate_hz: a tlog holds messages as they were, at no fixed rate; leave it out")


@dataclass(frozen=True, slots=True, eq=False)
class Exported:
    """What an export did. count: rows or messages written.  lost: of the log.  alignment: None without a fixed rate."""

    count: int
    lost: tuple[Loss, ...]
    alignment: Report | None = None


def export(log_path: Path, terms: ExportTerms, out_path: Path, on_offset: OnOffset | None = None) -> Exported:
    """Write a log in another format, all or nothing; beside a table of a fixed rate goes its alignment report.

    Args:
        log_path: an MCAP log; one cut short gives what is there.
        out_path: replaced once everything is written; a pipe or device is written as it goes.
        on_offset: told how far the log was read [bytes].
    Raises:
        OperatorError: no readable log, nothing in it, no writable output, or the output is the log itself or a .tlog
            that its flight wrote beside it.
    """
    reader = LogReader(log_path)
    keep((log_path,), out_path, "export")
    if any(are_one(own, out_path) for own in _own_tlogs(log_path)):
        raise OperatorError(f"export {out_path}: is what the flight itself wrote beside its log; name another file")
    if terms.rate_hz is not None:
        return _export_grid(reader, terms, terms.rate_hz, out_path, on_offset)
    with whole_or_absent(out_path) as path:
        if terms.format == "tlog":
            count = write_tlog(reader.records(Topics(), on_offset), path, links_of(reader))
        elif terms.format in _LINES:
            count = _LINES[terms.format](reader.records(_ESTIMATES, on_offset), path)
        else:
            count = tables.TABLES[terms.format](native.blocks(reader.records(_ESTIMATES, on_offset)), path)
    return Exported(count, reader.lost)


def out_beside(log_path: Path, format: str) -> Path:
    """Return where an export goes that nobody named: beside the log, not in the place of the flight's own .tlog."""
    return log_path.with_suffix(".export.tlog" if format == "tlog" else f".{format}")


def _own_tlogs(log_path: Path) -> Iterator[Path]:
    """Yield the .tlog files that lie beside a log as its flight writes them, see `bridge.log.tlog.tlog_paths`."""
    one = log_path.with_suffix(".tlog")
    numbered = log_path.parent.glob(f"{glob.escape(log_path.stem)}.*.tlog")
    for each in (one, *numbered):
        if each.is_file() and (each == one or each.with_suffix("").suffix[1:].isdigit()):
            yield each


def _export_grid(
    reader: LogReader, terms: ExportTerms, rate_hz: float, out_path: Path, on_offset: OnOffset | None
) -> Exported:
    surveyed = survey(reader, on_offset)
    gap_ns = None if terms.gap_ms is None else round(terms.gap_ms * 1e6)
    grid = Grid(reader, surveyed, rate_hz, gap_ns)
    if terms.format == "tum" and "x_m" not in grid.names():
        raise OperatorError(f"log {reader.path}: holds no estimate to make a trajectory of; export it as csv")
    with whole_or_absent(out_path) as path:
        count = tables.TABLES[terms.format](grid.blocks(on_offset), path)
    report = report_of(reader.path, rate_hz, grid, surveyed)
    if out_path.is_file():
        beside = out_path.with_name(f"{out_path.name}.alignment.json")
        with whole_or_absent(beside) as path:
            path.write_text(to_json(report), encoding="utf-8")
    return Exported(count, surveyed.lost, report)

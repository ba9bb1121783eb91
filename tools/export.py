"""Turn a log into files that other programs read."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridge.log import topics, triangle
from bridge.log.losses import Loss
from bridge.log.reader import LogReader, Record
from tracker.errors import OperatorError

_NS = 10**9
_AXES = ("x", "y", "z")
_SD_COLUMNS = (
    *(f"sd_{axis}_m" for axis in _AXES),
    *(f"sd_theta_{axis}_rad" for axis in _AXES),
    *(f"sd_v{axis}_m_s" for axis in _AXES),
    *(f"sd_w{axis}_rad_s" for axis in _AXES),
)
CSV_COLUMNS = (
    "t_ns",
    *(f"{axis}_m" for axis in _AXES),
    *(f"q{axis}" for axis in ("w", *_AXES)),
    *(f"v{axis}_m_s" for axis in _AXES),
    *(f"w{axis}_rad_s" for axis in _AXES),
    *_SD_COLUMNS,
    "state",
    "reset_counter",
    "nis",
    "nis_dof",
)


@dataclass(frozen=True, slots=True)
class Format:
    """One way to write a log down.

    topics: those it needs.  write: takes their records and a path, returns how many samples it wrote.
    """

    topics: frozenset[str]
    write: Callable[[Iterator[Record], Path], int]


@dataclass(frozen=True, slots=True)
class Report:
    """What an export did: samples written, and what could not be read of the log."""

    count: int
    lost: tuple[Loss, ...]


def export(log_path: Path, format: str, out_path: Path) -> Report:
    """Write a log's samples in another format, all or nothing.

    Args:
        log_path: an MCAP log; one cut short gives what is there.
        format: a key of FORMATS.
        out_path: replaced once everything is written; a pipe or device is written as it goes.
    Raises:
        OperatorError: an unknown format, no readable log, no writable output, or the output is the log itself.
    """
    if format not in FORMATS:
        raise OperatorError(f"export: unknown format {format!r}; known are {', '.join(sorted(FORMATS))}")
    reader = LogReader(log_path)
    if out_path.exists() and out_path.samefile(log_path):
        raise OperatorError(f"export {out_path}: is the log itself, which is kept; name another file")
    chosen = FORMATS[format]
    with _whole_or_absent(out_path) as path:
        count = chosen.write(reader.records(chosen.topics), path)
    return Report(count, reader.lost)


def tum_line(estimate: Mapping[str, Any]) -> str:
    """Return `t x y z qx qy qz qw` of an `/estimate` message: B in W at capture time [s, m].

    Source: the TUM RGB-D benchmark's trajectory format. The seconds are cut from the integer: a float holds no
    nanoseconds of a year.
    """
    t_ns = estimate["t_ns"]
    sign, size = ("-", -t_ns) if t_ns < 0 else ("", t_ns)
    w, x, y, z = estimate["q_BtoW"]
    pose = (_text(value) for value in (*estimate["p_BinW_m"], x, y, z, w))
    return " ".join((f"{sign}{size // _NS}.{size % _NS:09d}", *pose))


def csv_line(estimate: Mapping[str, Any]) -> str:
    """Return the values of CSV_COLUMNS of an `/estimate` message."""
    covariance = estimate["covariance"]
    motion = (estimate[key] for key in ("p_BinW_m", "q_BtoW", "v_BinW_m_s", "w_BinB_rad_s"))
    return ",".join(
        (
            str(estimate["t_ns"]),
            *(_text(value) for values in motion for value in values),
            *(_deviation(covariance[i]) for i in triangle.DIAGONAL),
            estimate["state"],
            str(estimate["reset_counter"]),
            _text(estimate["nis"]),
            str(estimate["nis_dof"]),
        )
    )


def _text(value: float | None) -> str:
    """Return the shortest text that reads back as the same number; the log's null was not finite."""
    return "nan" if value is None else repr(float(value))


def _deviation(variance: float | None) -> str:
    return "nan" if variance is None or variance < 0 else _text(math.sqrt(variance))


def _lines(line: Callable[[Mapping[str, Any]], str], header: str = "") -> Callable[[Iterator[Record], Path], int]:
    """Make a writer of one line a record."""

    def write(records: Iterator[Record], path: Path) -> int:
        count = 0
        with path.open("w", encoding="ascii", newline="\n") as file:
            file.write(header)
            for record in records:
                file.write(line(record.value) + "\n")
                count += 1
        return count

    return write


@contextmanager
def _whole_or_absent(out_path: Path) -> Iterator[Path]:
    """Give a path to write to; what is there replaces `out_path` at the end, or vanishes if the writing fails."""
    if out_path.is_dir():
        raise OperatorError(f"export {out_path}: is a directory; name a file in it")
    try:
        if out_path.exists() and not out_path.is_file():
            yield out_path
            return
        final = out_path.resolve()
        part = final.with_name(f".{final.name}.part")
        try:
            yield part
            part.replace(final)
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)
    except OSError as error:
        raise OperatorError(
            f"export {out_path}: cannot be written ({error.strerror}); free space or name a writable path"
        ) from error


_ESTIMATES = frozenset({topics.ESTIMATE.name})

FORMATS: Mapping[str, Format] = {
    "csv": Format(_ESTIMATES, _lines(csv_line, ",".join(CSV_COLUMNS) + "\n")),
    "tum": Format(_ESTIMATES, _lines(tum_line)),
}

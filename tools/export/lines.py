"""Estimates as lines of text, one each, at their own times: every number reads back bit for bit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bridge.log import triangle
from bridge.log.reader import Record
from tools.export.columns import ESTIMATE_NAMES

_NS = 10**9
CSV_COLUMNS = ("t_ns", *ESTIMATE_NAMES)


def tum_line(estimate: Mapping[str, Any]) -> str:
    """Return `t x y z qx qy qz qw` of an `/estimate` message: B in W at capture time [s, m]."""
    w, x, y, z = estimate["q_BtoW"]
    return pose_line(estimate["t_ns"], (*estimate["p_BinW_m"], x, y, z, w))


def pose_line(t_ns: int, pose: Sequence[float | None]) -> str:
    """Return a time and a pose, x y z qx qy qz qw, as a line.

    Source: the TUM RGB-D benchmark's trajectory format. The seconds are cut from the integer: a float holds no
    nanoseconds of a year.
    """
    sign, size = ("-", -t_ns) if t_ns < 0 else ("", t_ns)
    return " ".join((f"{sign}{size // _NS}.{size % _NS:09d}", *map(_text, pose)))


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


write_csv = _lines(csv_line, ",".join(CSV_COLUMNS) + "\n")
write_tum = _lines(tum_line)

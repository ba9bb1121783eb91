"""Estimates at their own times, as blocks of rows."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np

from bridge.log.reader import Record
from tools.export.columns import ESTIMATE_NAMES, estimate_row
from tools.export.grid import BLOCK_ROWS, Block, Column

_WHOLE = frozenset({"reset_counter", "nis_dof"})


def blocks(records: Iterator[Record]) -> Iterator[Block]:
    """Yield the rows of `/estimate` records; at least one block, if need be of none."""
    values = [record.value for record in islice(records, BLOCK_ROWS)]
    yield _block(values)
    while values := [record.value for record in islice(records, BLOCK_ROWS)]:
        yield _block(values)


def _block(values: list[dict[str, Any]]) -> Block:
    rows = np.array([estimate_row(value) for value in values], dtype=np.float64).reshape(-1, len(ESTIMATE_NAMES))
    block: dict[str, Column] = {"t_ns": np.array([value["t_ns"] for value in values], dtype=np.int64)}
    for name, column in zip(ESTIMATE_NAMES, rows.T, strict=True):
        block[name] = column.astype(np.int64) if name in _WHOLE else column
    block["state"] = np.array([value["state"] for value in values], dtype="U9")
    return block

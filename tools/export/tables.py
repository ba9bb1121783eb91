"""Blocks of rows as files: csv, Parquet, MATLAB and tum, one block in memory at a time."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import scipy.io

from tools.export.grid import Block, Column
from tools.export.lines import pose_line

Write = Callable[[Iterator[Block], Path], int]
"""Write blocks, the first of which names the columns of all, and return how many rows they had."""

GROUP_ROWS = 65_536  # of a Parquet row group: readers like them large
POSE_COLUMNS = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")


def write_csv(blocks: Iterator[Block], path: Path) -> int:
    """Write a header and a line a row; numbers read back bit for bit, nan stands for one that is not there."""
    count, writer = 0, None
    with path.open("wb") as file:
        for block in blocks:
            batch = _batch(block)
            if writer is None:
                file.write(",".join(batch.schema.names).encode() + b"\n")
                options = pyarrow.csv.WriteOptions(include_header=False, quoting_style="none")
                writer = pyarrow.csv.CSVWriter(file, batch.schema, write_options=options)
            writer.write_batch(batch)
            count += batch.num_rows
        if writer is not None:
            writer.close()
    return count


def write_parquet(blocks: Iterator[Block], path: Path) -> int:
    """Write a Parquet file, compressed with zstd."""
    count, waiting, writer = 0, [], None
    with path.open("wb") as file:
        for block in blocks:
            waiting.append(_batch(block))
            count += waiting[-1].num_rows
            if writer is None:
                writer = pq.ParquetWriter(file, waiting[0].schema, compression="zstd")
            if sum(batch.num_rows for batch in waiting) >= GROUP_ROWS:
                writer.write_table(pa.Table.from_batches(waiting))
                waiting.clear()
        if writer is not None:
            if waiting:
                writer.write_table(pa.Table.from_batches(waiting))
            writer.close()
    return count


def write_mat(blocks: Iterator[Block], path: Path) -> int:
    """Write a MATLAB 5 file, each column a variable (n, 1).

    MATLAB wants each variable whole: columns wait in files of their own, and are put in one after another.
    """
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        spool = _Spool(Path(folder))
        for block in blocks:
            spool.add(block)
        with path.open("wb") as file:
            for name, column in spool.columns():
                _put(file, name, column)
    return spool.count


def write_tum(blocks: Iterator[Block], path: Path) -> int:
    """Write `t x y z qx qy qz qw` of each row that has a pose."""
    count = 0
    with path.open("w", encoding="ascii", newline="\n") as file:
        for block in blocks:
            poses = np.stack([block[name] for name in POSE_COLUMNS], axis=1).astype(np.float64)
            known = np.isfinite(poses).all(axis=1)
            for t_ns, pose in zip(block["t_ns"][known].tolist(), poses[known].tolist(), strict=True):
                file.write(pose_line(t_ns, pose) + "\n")
            count += int(np.count_nonzero(known))
    return count


TABLES: Mapping[str, Write] = {"csv": write_csv, "mat": write_mat, "parquet": write_parquet, "tum": write_tum}


class _Spool:
    """Columns in files, each growing block by block."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._types: dict[str, np.dtype[np.generic]] = {}
        self.count = 0

    def add(self, block: Block) -> None:
        for name, column in block.items():
            self._types.setdefault(name, column.dtype)
            with (self._folder / name).open("ab") as file:
                file.write(column.astype(self._types[name]).tobytes())
        self.count += len(block["t_ns"])

    def columns(self) -> Iterator[tuple[str, Column]]:
        for name, kind in self._types.items():
            yield name, np.fromfile(self._folder / name, dtype=kind)


def _put(file: BinaryIO, name: str, column: Column) -> None:
    """Append a variable: scipy writes the file's head only where nothing stands yet."""
    scipy.io.savemat(file, {name: column}, oned_as="column")


def _batch(block: Block) -> pa.RecordBatch:
    return pa.RecordBatch.from_arrays([pa.array(column) for column in block.values()], names=list(block))

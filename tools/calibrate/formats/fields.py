"""Fields of a calibration file, read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tracker.errors import OperatorError
from tracker.types import Array

RADIAL_TANGENTIAL = "calibrate with radial-tangential distortion (Kalibr: pinhole-radtan, ROS: plumb_bob)"


@dataclass(frozen=True, slots=True)
class Fields:
    """A table of a file. where: the file, and the table in it, for messages."""

    where: str
    table: Mapping[str, Any]

    def __contains__(self, key: str) -> bool:
        return key in self.table

    def get(self, key: str) -> Any:
        """Return a field that must be there.

        Raises:
            OperatorError: it is not.
        """
        if key not in self.table:
            raise OperatorError(f"{self.where}: field `{key}` is missing; add it or calibrate again")
        return self.table[key]

    def sub(self, key: str) -> Fields:
        """Return a table within.

        Raises:
            OperatorError: it is missing or no table.
        """
        value = self.get(key)
        if not isinstance(value, Mapping):
            raise OperatorError(f"{self.where}: `{key}` must be a table, not {value!r}; correct it")
        return Fields(f"{self.where}, {key}", value)

    def numbers(self, key: str, *counts: int) -> Array:
        """Return finite numbers, flat; lists of lists and {rows, cols, data} are taken too.

        Args:
            counts: how many there may be.
        Raises:
            OperatorError: missing, not numbers, or not as many.
        """
        value = self.get(key)
        value = value.get("data") if isinstance(value, Mapping) else value
        try:
            numbers = np.asarray(value, dtype=np.float64).ravel()
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if len(numbers) not in counts or not np.isfinite(numbers).all():
            wanted = " or ".join(str(count) for count in counts)
            raise OperatorError(f"{self.where}: `{key}` must be {wanted} finite numbers, not {value!r}; correct it")
        return np.asarray(numbers)

    def model(self, key: str, known: tuple[str, ...]) -> str:
        """Return the name of a model that we can represent.

        Raises:
            OperatorError: another one, or none.
        """
        name = str(self.get(key))
        if name not in known:
            raise OperatorError(
                f"{self.where}: {key} {name!r} cannot be represented here; known: {', '.join(known)}; "
                f"{RADIAL_TANGENTIAL}"
            )
        return name


def read_yaml(path: Path) -> Fields:
    """Read a YAML file that holds a table.

    Raises:
        OperatorError: not readable, no YAML, no table.
    """
    try:
        document = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        raise OperatorError(f"{path}: is no YAML: {' '.join(str(error).split())}; write it anew") from error
    if not isinstance(document, dict):
        raise OperatorError(f"{path}: holds no table of fields; give a calibration file")
    return Fields(str(path), document)


def read_text(path: Path) -> str:
    """Read a text file.

    Raises:
        OperatorError: not readable, or no UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise OperatorError(f"{path}: is no UTF-8 text; give a calibration file") from error
    except OSError as error:
        raise OperatorError(f"{path}: cannot be read ({error.strerror}); check the path") from error


def write_text(path: Path, text: str) -> None:
    """Write a text file, and the folders it needs.

    Raises:
        OperatorError: it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"{path}: cannot be written ({error.strerror}); name a writable path") from error

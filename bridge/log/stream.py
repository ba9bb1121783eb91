"""The file, pipe or device that a log goes to."""

from __future__ import annotations

import stat
from io import BufferedWriter
from pathlib import Path
from typing import TYPE_CHECKING

from tracker.errors import OperatorError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class CountingStream(BufferedWriter):
    """A buffered stream that counts its own bytes: MCAP needs positions, and a pipe has none."""

    size_bytes = 0

    def write(self, data: ReadableBuffer, /) -> int:
        """Write all of `data`."""
        written = super().write(data)
        self.size_bytes += written
        return written

    def tell(self) -> int:
        """Return the bytes written so far."""
        return self.size_bytes


def open_stream(path: Path, overwrite: bool) -> CountingStream:
    """Open a new log.

    Raises:
        OperatorError: a file is there already and `overwrite` is not given; the path cannot be written.
    """
    try:
        return CountingStream(path.open("wb" if overwrite or _holds_nothing(path) else "xb", buffering=0))
    except FileExistsError:
        if path.is_dir():
            raise OperatorError(_is_directory(path)) from None
        raise OperatorError(
            f"log {path}: the file exists ({path.stat().st_size} bytes) and is kept; name another or add --overwrite"
        ) from None
    except IsADirectoryError:
        raise OperatorError(_is_directory(path)) from None
    except FileNotFoundError:
        raise OperatorError(f"log {path}: the directory {path.parent} does not exist; create it") from None
    except OSError as error:
        raise OperatorError(f"log {path}: cannot be written ({error.strerror}); name a writable path") from error


def _holds_nothing(path: Path) -> bool:
    """Say whether the path is a pipe or a device, where opening destroys nothing."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISCHR(mode)


def _is_directory(path: Path) -> str:
    return f"log {path}: is a directory; name a file in it, such as {path / 'flight.mcap'}"

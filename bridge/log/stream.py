"""The file, pipe or device that a log goes to."""

from __future__ import annotations

import fcntl
import os
import stat
from io import BufferedWriter, FileIO
from pathlib import Path
from typing import TYPE_CHECKING

from tracker.errors import OperatorError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_MODE = 0o666


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
        OperatorError: a file is there already and `overwrite` is not given, or another process writes it; the path
            cannot be written.
    """
    try:
        if not overwrite and not _holds_nothing(path):
            return CountingStream(_claimed(path.open("xb", buffering=0), path))
        return CountingStream(_claimed(open(path, "wb", buffering=0, opener=_as_it_is), path))
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


def _as_it_is(path: str, flags: int) -> int:
    """Open a file to write, with what it holds."""
    return os.open(path, flags & ~os.O_TRUNC, _MODE)


def _claimed(file: FileIO, path: Path) -> FileIO:
    """Lock a file against other recorders as long as it is open, then empty it; pipes and devices stay as they are."""
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            raise OperatorError(f"log {path}: another posebridge writes it just now; name another") from None
        except OSError:  # a file system without locks
            pass
        file.truncate(0)
    return file


def _holds_nothing(path: Path) -> bool:
    """Say whether the path is a pipe or a device, where opening destroys nothing."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISCHR(mode)


def _is_directory(path: Path) -> str:
    return f"log {path}: is a directory; name a file in it, such as {path / 'flight.mcap'}"

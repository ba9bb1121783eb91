"""The file an export writes: whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tracker.errors import OperatorError


@contextmanager
def whole_or_absent(out_path: Path) -> Iterator[Path]:
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

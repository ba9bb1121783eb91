"""A file's name says what is in it."""

from __future__ import annotations

from pathlib import Path

from tracker.errors import OperatorError


def check_suffix(path: Path | None, what: str, suffix: str) -> None:
    """Refuse a name that ends otherwise than what is written under it; devices and pipes are called as they are.

    Args:
        path: the file to be written, None for none.
        what: the option that names it.
        suffix: of the only kind that is written, such as ".png".
    Raises:
        OperatorError: another suffix, or none.
    """
    if path is None or path.suffix.lower() == suffix or (path.exists() and not path.is_file()):
        return
    raise OperatorError(f"{what} {path}: only {suffix[1:].upper()} is written there; give a name that ends in {suffix}")

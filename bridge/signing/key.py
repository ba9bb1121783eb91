"""The secret key, in a file that nobody else can read."""

from __future__ import annotations

import fcntl
import os
import secrets
import stat
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tracker.errors import OperatorError

KEY_BYTES = 32
_MODE = 0o600
_OTHERS = stat.S_IRWXG | stat.S_IRWXO


@dataclass(frozen=True, slots=True)
class Key:
    """A key in use: no other process can open it meanwhile, since two would give the same timestamps.

    secret: 32 bytes, never shown.  handle: holds the lock.
    """

    path: Path
    secret: bytes
    handle: int

    def __repr__(self) -> str:
        """Say which key, not what it is."""
        return f"Key({self.path})"

    def release(self) -> None:
        """Let others open the key. Twice is once."""
        with suppress(OSError):
            os.close(self.handle)


def open_key(path: Path) -> Key:
    """Read a key: 32 bytes, or 64 hexadecimal digits.

    Raises:
        OperatorError: no such file, not the user's own with mode 600, no key in it, or in use by another bridge.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        raise OperatorError(
            f"signing_key {path}: cannot be read ({error.strerror}); `posebridge key {path}` makes one"
        ) from error
    try:
        return Key(path, _secret(path, handle), handle)
    except OperatorError:
        os.close(handle)
        raise


def make_key(path: Path) -> None:
    """Write a new random key as 64 hexadecimal digits, mode 600.

    Raises:
        OperatorError: there is a file already, or none can be made there.
    """
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, _MODE)
    except FileExistsError as error:
        raise OperatorError(f"key {path}: there is a file already; name another, a key is never replaced") from error
    except OSError as error:
        raise OperatorError(f"key {path}: cannot be made ({error.strerror}); name another file") from error
    with os.fdopen(handle, "w") as file:
        file.write(secrets.token_hex(KEY_BYTES) + "\n")


def _secret(path: Path, handle: int) -> bytes:
    about = os.fstat(handle)
    if not stat.S_ISREG(about.st_mode):
        raise OperatorError(f"signing_key {path}: is no file; name the key's file")
    if about.st_uid != os.geteuid() or about.st_mode & _OTHERS:
        raise OperatorError(
            f"signing_key {path}: mode {stat.S_IMODE(about.st_mode):o}, owner {about.st_uid}; a secret must be "
            f"yours alone: chown it to you, and chmod 600 {path}"
        )
    secret = _decoded(os.read(handle, 1024))
    if secret is None:
        raise OperatorError(f"signing_key {path}: holds {about.st_size} bytes; must be 32 bytes, or 64 hex digits")
    if not any(secret):
        raise OperatorError(f"signing_key {path}: is all zero, which means no key; `posebridge key NEW` makes one")
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise OperatorError(
            f"signing_key {path}: another posebridge signs with it just now; end that one, or give each its own key"
        ) from error
    return secret


def _decoded(data: bytes) -> bytes | None:
    """Return the 32 bytes that a key file holds, None if it holds no key."""
    if len(data) == KEY_BYTES:
        return data
    try:
        secret = bytes.fromhex(data.decode("ascii").strip())
    except ValueError:
        return None
    return secret if len(secret) == KEY_BYTES else None

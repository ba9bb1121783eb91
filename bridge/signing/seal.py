"""What one bridge signs with on all its links: the key, and the timestamps that go with it."""

from __future__ import annotations

from pathlib import Path

from bridge.clock import Nanoseconds
from bridge.signing.key import Key, open_key
from bridge.signing.signature import Signing
from bridge.signing.stamps import Stamps, open_stamps
from tracker.errors import OperatorError

STAMP_SUFFIX = ".stamp"


class Seal:
    """The key in use, with its timestamps."""

    def __init__(self, key: Key, stamps: Stamps) -> None:
        self._key = key
        self._stamps = stamps

    def for_link(self, number: int) -> Signing:
        """Return the signatures of the link with this number, from 0 on."""
        return Signing(self._key.secret, number, self._stamps)

    def close(self) -> None:
        """Leave the last timestamp for the next run and let go of the key. Twice is once."""
        self._stamps.close()
        self._key.release()


def open_seal(path: Path, wall: Nanoseconds, stopwatch: Nanoseconds) -> Seal:
    """Open a key file; the timestamps lie beside it.

    Args:
        path: of the key.  wall: reads the calendar [ns].  stopwatch: reads a running time [ns].
    Raises:
        OperatorError: see `open_key`, `open_stamps`.
    """
    key = open_key(path)
    try:
        return Seal(key, open_stamps(path.with_name(path.name + STAMP_SUFFIX), wall, stopwatch))
    except OperatorError:
        key.release()
        raise

"""A thread that waits for a socket's bytes, so that what comes in is heard when it comes."""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Callable


class Listener:
    """Call `hear` whenever a descriptor is readable, until `close`.

    fileno: to wait on; it stays open until `close` has returned.  hear: reads all there is, without waiting.
    """

    def __init__(self, fileno: int, hear: Callable[[], None], name: str) -> None:
        self._fileno = fileno
        self._hear = hear
        self._wake_read, self._wake_write = os.pipe()
        self._thread = threading.Thread(target=self._run, name=f"{name} listener", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        os.write(self._wake_write, b"\0")
        self._thread.join()
        os.close(self._wake_read)
        os.close(self._wake_write)

    def _run(self) -> None:
        while True:
            readable, _, _ = select.select([self._fileno, self._wake_read], [], [])
            if self._wake_read in readable:
                return
            self._hear()

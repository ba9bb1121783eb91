"""The way in, light enough that Ctrl-C is heard while the command line itself is still being loaded."""

from __future__ import annotations

import os
import signal
from types import FrameType

EXIT_INTERRUPTED = 130


def main() -> None:
    """Load the command line and run it; until it listens itself, SIGINT and SIGTERM end the process, quietly."""
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, _leave)

    from tools import cli

    cli.main()


def _leave(_number: int, _frame: FrameType | None) -> None:
    """End the process where it stands: nothing is open yet, and an exception would fall into somebody's import."""
    os._exit(EXIT_INTERRUPTED)

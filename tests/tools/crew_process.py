"""A crew whose workers press Ctrl-C: each sends it to all processes of its group, as a terminal does, and waits."""

from __future__ import annotations

import os
import signal
import sys

from tools.bench.crew import side_by_side


def interrupt_all(_: int) -> None:
    """Interrupt the whole group, oneself included, and stay."""
    os.killpg(0, signal.SIGINT)
    while True:
        signal.pause()


if __name__ == "__main__":
    try:
        side_by_side(interrupt_all, (1, 2, 3, 4))
    except KeyboardInterrupt:
        sys.stdout.write("interrupted\n")

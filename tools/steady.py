"""Keep the interpreter itself from holding up the loop: its garbage collector and its threads' turns."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

# The thread that holds the interpreter gives it up after so long when another asks: with Python's own 5 ms the log's
# thread could keep a pose waiting for as long. Shorter ones gain nothing, since few of its calls are longer.
TURN_S = 0.0005
# The loop makes hardly any cycles; its values die as they go. So young garbage is looked for once in several hundred
# poses instead of many times in each, and what has lived through that rarely again.
YOUNG, MIDDLE, OLD = 20_000, 20, 20


@contextmanager
def steady() -> Iterator[None]:
    """Set the collector and the threads' turns for flight, and back again at the end.

    What is loaded by now is left out of every later collection, which so looks at the flight's own values alone; with
    all the libraries' it takes a tenth of a second.
    """
    turn_s, thresholds = sys.getswitchinterval(), gc.get_threshold()
    gc.collect()
    gc.freeze()
    gc.set_threshold(YOUNG, MIDDLE, OLD)
    sys.setswitchinterval(TURN_S)
    try:
        yield
    finally:
        sys.setswitchinterval(turn_s)
        gc.set_threshold(*thresholds)
        gc.unfreeze()

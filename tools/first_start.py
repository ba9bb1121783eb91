"""Tell the operator why the very first start takes so long."""

from __future__ import annotations

from collections.abc import Callable

from numba.core import event

COMPILING = "numba:compile"
Registrar = Callable[[str, event.Listener], None]


class CompilingNotice(event.Listener):
    """Say once that Numba compiles; code that it finds in its cache is not compiled and not told.

    tell: takes the line.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell: Callable[[str], None] | None = tell

    def on_start(self, started: event.Event) -> None:
        """Tell, if it is the first time."""
        if self._tell is None:
            return
        kept = started.data["dispatcher"].stats.cache_path is not None
        once = "once" if kept else "at each start, since no folder can be written (set NUMBA_CACHE_DIR to one that can)"
        self._tell(f"compiling the image kernels {once}; this takes about a minute")
        self._tell = None

    def on_end(self, ended: event.Event) -> None:
        """Do nothing."""


def tell_of_compiling(tell: Callable[[str], None]) -> Callable[[], None]:
    """Give a line to `tell` as soon as anything is compiled from now on, until what is returned is called."""
    notice = CompilingNotice(tell)
    register: Registrar = event.register
    unregister: Registrar = event.unregister
    register(COMPILING, notice)
    return lambda: unregister(COMPILING, notice)

"""The snapshots of a bridge that runs on this computer."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

from bridge.clock import Nanoseconds
from bridge.telemetry.parse import from_bytes
from bridge.telemetry.post import FIRST_PORT, HOST, PORTS, Caller
from bridge.telemetry.snapshot import Snapshot
from tracker.errors import OperatorError

PATIENCE_NS = 3_000_000_000
QUIET_NS = 1_500_000_000
WAIT_S = 0.25


@dataclass(frozen=True, slots=True)
class Heard:
    """What has come of a bridge. quiet_s: for how long it has said nothing [s], 0 while it talks.

    others: ports of other bridges that answered too.
    """

    port: int
    snapshot: Snapshot
    quiet_s: float
    others: tuple[int, ...]


def attach(port: int | None, stopwatch: Nanoseconds) -> Generator[Heard]:
    """Yield what the bridge says as it says it, a few times a second, until its run has ended.

    Args:
        port: where it answers; None for the first of the usual ports that does.
        stopwatch: reads a running time [ns].
    Raises:
        OperatorError: nobody answers within 3 s, or one of another version.
    """
    ports = range(FIRST_PORT, FIRST_PORT + PORTS) if port is None else range(port, port + 1)
    caller = Caller(ports, stopwatch)
    try:
        yield from _follow(caller, ports, stopwatch)
    finally:
        caller.close()


def _follow(caller: Caller, ports: range, stopwatch: Nanoseconds) -> Generator[Heard]:
    started_ns = heard_ns = stopwatch()
    newest: dict[int, Snapshot] = {}
    chosen: int | None = None
    while True:
        fresh = {port: one for port, data in caller.listen(WAIT_S) if (one := from_bytes(data)) is not None}
        newest |= fresh
        now_ns = stopwatch()
        if chosen is None:
            chosen = min(newest, default=None)
        if chosen is None:
            if now_ns - started_ns > PATIENCE_NS:
                raise OperatorError(_nobody(ports))
            continue
        heard_ns = now_ns if chosen in fresh else heard_ns
        quiet_ns = now_ns - heard_ns
        others = tuple(sorted(port for port, one in newest.items() if port != chosen and not one.ended))
        if chosen in fresh or quiet_ns > QUIET_NS:
            yield Heard(chosen, newest[chosen], quiet_ns / 1e9 if quiet_ns > QUIET_NS else 0.0, others)
        if newest[chosen].ended:
            return


def _nobody(ports: range) -> str:
    where = f"{HOST}:{ports[0]}" + (f" to {ports[-1]}" if len(ports) > 1 else "")
    return (
        f"monitor: no bridge answers on {where} within {PATIENCE_NS / 1e9:g} s; start `posebridge run` "
        "on this computer, give --port as its config's [monitor] port, or name a log"
    )

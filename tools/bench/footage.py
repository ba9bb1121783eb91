"""Simulated frames kept in memory, and played for as long as a measurement wants."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, cycle, islice

from bridge.settings import Settings, rig_of
from tools.request import Clocks
from tracker.rig import Rig
from tracker.sources.paths import scripted_path
from tracker.sources.sim import START_NS, SimSource, SimTiming
from tracker.types import Frame

RATE_HZ = 15.0
PERIOD_NS = round(1e9 / RATE_HZ)


class Footage:
    """A short flight, rendered once.

    name: of the path.  closed: whether it ends, after so many instants, as it began, speed and all.
    rig: what it was rendered with.  pairs: the frames, one tuple an instant.
    """

    def __init__(self, settings: Settings, clocks: Clocks, name: str, instants: int, *, closed: bool = False) -> None:
        self._closed = closed
        self.rig: Rig = rig_of(settings, None).rig
        self._stopwatch = clocks.stopwatch
        timing = SimTiming(RATE_HZ, instants / RATE_HZ)
        with SimSource(self.rig, scripted_path(name, START_NS), clocks.stopwatch, timing) as source:
            frames = [event for event in source if isinstance(event, Frame)]
        count = len(self.rig.cameras)
        self.pairs = [tuple(frames[i : i + count]) for i in range(0, len(frames), count)]

    def play(self, instants: int) -> Iterator[tuple[Frame, ...]]:
        """Yield that many instants, times going on.

        A closed path is flown round and round. Another is flown to and fro: its places do not jump, its speed does.
        """
        once = self.pairs if self._closed else chain(self.pairs, self.pairs[-2:0:-1])
        for k, pair in enumerate(islice(cycle(once), instants)):
            t_ns = START_NS + k * PERIOD_NS
            yield tuple([Frame(frame.camera, t_ns, frame.image, self._stopwatch()) for frame in pair])

"""A bridge that is watched, for the tests of telemetry: turns of the loop in, snapshots out."""

from __future__ import annotations

from dataclasses import dataclass, field

from bridge.alarms import Alarm, Limits
from bridge.monitor import Monitor
from bridge.telemetry.gauges import Names
from bridge.telemetry.post import Post
from bridge.telemetry.snapshot import About, Snapshot
from bridge.telemetry.states import Surroundings
from bridge.telemetry.telemetry import Telemetry
from bridge.wire import LinkState
from tests.bridge.recordings import Turn
from tracker.types import Step, TrackState

NAMES = Names(("cam0", "cam1"), ("ball0", "ball1", "ball2"), (0.0, 0.0))
UP = LinkState("memory:a", True, "", 1, 0, 0)
AROUND = Surroundings((UP,))
USUAL = Limits()


@dataclass(eq=False)
class Watched:
    """Telemetry and the monitor it reads; `around` is what else is known, `now_ns` what the stopwatch says."""

    names: Names = NAMES
    around: Surroundings = AROUND
    post: Post | None = None
    limits: Limits = USUAL
    now_ns: int = 0
    telemetry: Telemetry = field(init=False)

    def __post_init__(self) -> None:
        self.monitor = Monitor(self.names.cameras)
        self.telemetry = Telemetry(
            About("sim:test"), self.names, self.limits, self.monitor, self.post, lambda: self.now_ns
        )

    def fly(self, *turns: Turn) -> None:
        """Take turns."""
        for event, step, sent, now_ns in turns:
            self.monitor.take(event, step, sent)
            self.telemetry.take(event, step, sent, now_ns, lambda: self.around)

    def wait(self, t_ns: int, state: TrackState = TrackState.TRACKING) -> None:
        """Let a turn pass in which nothing comes."""
        self.monitor.take(None, Step(state), ())
        self.telemetry.take(None, Step(state), (), t_ns, lambda: self.around)

    def names_of_alarms(self) -> set[str]:
        """Return the names of the alarms that stand."""
        return {alarm.name for alarm in self.alarms()}

    def alarms(self) -> tuple[Alarm, ...]:
        """Return the alarms that stand."""
        return self.telemetry.alarms()

    def snapshot(self) -> Snapshot:
        """Return the state of the run."""
        return self.telemetry.snapshot(lambda: self.around)

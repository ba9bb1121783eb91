"""What a log holds of the cameras' stand: instants at which two cameras or more saw the marker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bridge.log.reader import LogReader
from bridge.log.turns import turns
from tracker.rig import Rig
from tracker.state import OFFSETS, State, mean_of
from tracker.types import BallSighting, Estimate

MOST = 1500  # instants: more tell little that is new
ENOUGH = 4  # sightings, in two cameras


@dataclass(frozen=True, slots=True, eq=False)
class Instant:
    """Where the tracker had the vehicle, and what was seen of it then, whether or not it went by that."""

    state: State
    sightings: tuple[BallSighting, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """A log's instants in order of time, and by camera when the flight itself said that it had moved [ns]."""

    instants: tuple[Instant, ...]
    told_ns: dict[int, int]

    def since(self, t_ns: int) -> tuple[Instant, ...]:
        """Return the instants from a time on, evenly thinned to MOST."""
        later = [one for one in self.instants if one.state.t_ns >= t_ns]
        return tuple(later[:: -(-len(later) // MOST) or 1])


def read_evidence(reader: LogReader, rig: Rig) -> Evidence:
    """Gather a log's instants; of poses that waited for later rounds, what was seen in these is none of theirs."""
    instants: list[Instant] = []
    told_ns: dict[int, int] = {}
    seen: list[BallSighting] = []
    rows_ns = [camera.readout_ns for camera in rig.cameras]  # a row may be younger than its picture by less than that
    for turn in turns(reader):
        seen += (*turn.step.sightings, *turn.step.refused)
        for estimate in turn.step.estimates:
            then = tuple(one for one in seen if one.t_ns <= estimate.t_ns + rows_ns[one.camera])
            seen = [one for one in seen if one.t_ns > estimate.t_ns + rows_ns[one.camera]]
            if len(then) >= ENOUGH and len({one.camera for one in then}) >= 2:
                instants.append(Instant(_state(estimate, rig), then))
        if turn.step.health is not None:
            for index, camera in enumerate(turn.step.health.cameras):
                if camera.moved:
                    told_ns.setdefault(index, turn.step.health.t_ns)
    return Evidence(tuple(instants), told_ns)


def _state(estimate: Estimate, rig: Rig) -> State:
    count = len(rig.cameras)
    offsets_s = estimate.clock_offsets_s if len(estimate.clock_offsets_s) else np.zeros(count)
    size = OFFSETS + count - 1
    mean = mean_of(estimate.p_BinW, estimate.R_BtoW, estimate.v_BinW, estimate.w_BinB, offsets_s)
    return State(estimate.t_ns, mean, np.zeros((size, size)))

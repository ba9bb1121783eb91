"""What a log tells of its instants is the same whether poses went out at once or waited."""

from __future__ import annotations

from pathlib import Path

from bridge.heard import NOTHING
from bridge.log.reader import LogReader
from tests.system.bumps import CLOCKS, SETTINGS
from tests.system.flights import RIG
from tools.bench.trial import Trial, footage
from tools.calibrate.refine.evidence import Instant, read_evidence
from tools.session import recorder_of, tracker_of
from tracker.scene import Look
from tracker.sources.sim import SimTiming

TRIAL = Trial("random-1", SimTiming(15.0, 1.2), Look(gamma=1.0), seed=1)


def instants(lag_rounds: int, path: Path) -> tuple[Instant, ...]:
    """Return what the log of a short flight holds."""
    waiting = SETTINGS.tracker.model_copy(update={"lag_rounds": lag_rounds})
    settings = SETTINGS.model_copy(update={"tracker": waiting})
    tracker, recorder = (
        tracker_of(settings, RIG, CLOCKS),
        recorder_of(path, settings, RIG, {}, CLOCKS, block_when_full=True),
    )
    newest_ns = 0
    for event in footage(TRIAL, RIG, None):
        newest_ns = event.t_ns
        recorder.take(event, tracker.step(event), (), newest_ns, NOTHING)
    recorder.take(None, tracker.finish(), (), newest_ns, NOTHING)
    recorder.close()
    return read_evidence(LogReader(path), RIG).instants


def test_what_was_seen_belongs_to_the_pose_of_its_own_instant_however_long_that_waited(tmp_path: Path) -> None:
    at_once, late = (
        [(one.state.t_ns, [seen[:3] for seen in one.sightings]) for one in instants(lag, tmp_path / f"{lag}.mcap")]
        for lag in (0, 3)
    )
    assert len(at_once) > 10
    assert late == at_once

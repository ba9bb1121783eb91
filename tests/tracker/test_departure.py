"""A pose on its way out goes by what its own images were looked at with."""

from __future__ import annotations

import numpy as np

from tests.tracker.rigs import PROCESS, ring_rig, sightings, state
from tracker.departure import Departure
from tracker.filter.ekf import update
from tracker.filter.history import History
from tracker.filter.predict import first_guess
from tracker.filter.reported import reported
from tracker.image.eyes import Eyes
from tracker.types import Rejected, TrackState

RIG = ring_rig(2)
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (0.6, -0.4, 0.2), (0.3, -0.2, 0.8))
UNMOVED, DOUBTED_PX, SURE_PX = np.zeros(2), np.full(2, 0.08), np.full(2, 0.01)


def test_what_the_eyes_learn_while_a_pose_waits_makes_it_no_surer() -> None:
    seen = sightings(FLYING, RIG, [(0, 0), (1, 0)], 0.05, np.random.default_rng(1))
    found = update(first_guess(FLYING, PROCESS), seen, RIG, 0.999)
    assert not isinstance(found, Rejected)
    history, departure, eyes = History(lag_rounds=1), Departure(1, lambda: 0), Eyes(RIG)
    history.restart(found)
    eyes.doubts_px = DOUBTED_PX
    departure.take(0, 0, TrackState.TRACKING, 0, {}, eyes)
    eyes.doubts_px = SURE_PX
    (left,) = departure.due(history, RIG, UNMOVED, all_of_them=True)
    told = found.state, found.spread, RIG, eyes.exposure_s
    doubted, sure = (reported(*told, px, UNMOVED)[0] for px in (DOUBTED_PX, SURE_PX))
    assert np.array_equal(left.covariance, doubted)
    assert np.trace(doubted[:3, :3]) > np.trace(sure[:3, :3])

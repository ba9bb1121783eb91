"""The paper's protocol in other rooms: a marker that somebody moves on a step at a time, 50 mm, 5 or 10 deg a frame.

No vehicle flies so. Where a step leaves two balls about where they were, or one camera still finds all of them, the
track has an explanation for what is left, and it is the wrong one.
"""

from __future__ import annotations

from functools import cache

import pytest

from tools.bench.crew import fly_all
from tools.bench.trial import Flown, Trial
from tracker.scene.random_look import random_look
from tracker.sources.sim import SimTiming

ROOMS = (1, 4, 9, 11)
PERIOD_S, STEPS = 1.0 / 15.0, 39
FAR_MM, FAR_DEG = 1.5, 1.0  # a step of 5 deg by two balls of three is 4 to 6 mm and as many degrees off


@cache
def flown() -> list[Flown]:
    return fly_all([Trial("protocol", SimTiming(15.0, STEPS * PERIOD_S), random_look(s, 2.2), s) for s in ROOMS])


@pytest.mark.parametrize("room", range(len(ROOMS)))
def test_every_step_is_followed_at_once(room: int) -> None:
    one = flown()[room]
    assert len(one) == STEPS
    assert not one.wrong()
    assert one.position_mm.max() < FAR_MM
    assert one.attitude_deg.max() < FAR_DEG

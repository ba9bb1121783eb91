"""What a bench of accuracy says when there is nothing to compare."""

from __future__ import annotations

import numpy as np
import pytest

from bridge.settings import load_settings, rig_of
from tools.bench.accuracy import Yardstick, compare
from tracker.errors import OperatorError
from tracker.sources.groundtruth import GroundTruth
from tracker.types import Estimate, Step, TrackState, frozen_array

RIG = rig_of(load_settings("lab"), None).rig
TRUTH = GroundTruth(np.array([0], dtype=np.int64), frozen_array(np.zeros((1, 3))), frozen_array([np.eye(3)]))
YARDSTICK = Yardstick("dark", RIG, TRUTH, (), {}, {})


def test_a_method_that_found_nothing_is_named_and_the_colours_are_to_be_looked_at() -> None:
    with pytest.raises(OperatorError, match="method paper found no pose in any frame; check colours"):
        compare(YARDSTICK, "paper", [Step(TrackState.LOST)])


def test_estimates_at_other_times_than_the_truths_are_told_apart_from_none() -> None:
    away = Estimate(1, np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.eye(12), TrackState.TRACKING, 0)
    with pytest.raises(OperatorError, match="no estimate at the time of a true pose"):
        compare(YARDSTICK, "ekf", [Step(TrackState.TRACKING, estimates=(away,))])

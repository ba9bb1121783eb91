"""A ball painted over in a recording for a second: what goes out stays within 5 sigma of the recording's truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.settings import load_settings, rig_of
from bridge.settings.tuning import tuning_of
from tools.bench.trial import POSE_LIMIT
from tracker.maths import so3
from tracker.pipeline import Tracker
from tracker.rig import Rig
from tracker.sources.groundtruth import GroundTruth, read_ground_truth
from tracker.sources.recording import RecordingSource
from tracker.types import Array, Estimate, Frame

FIRST_S, LAST_S = 2.0, 3.0
AROUND_PX = 14  # of a ball's centre is painted over, from what stands around that


def painted_over(frame: Frame, rig: Rig, ball: int, truth: GroundTruth) -> Frame:
    """Fill a ball's surroundings from what stands around them."""
    i = int(np.argmin(np.abs(truth.t_ns - frame.t_ns)))
    ball_inW = truth.R_BtoW[i] @ rig.marker.points_inB[ball] + truth.p_BinW[i]
    uv_px = rig.cameras[frame.camera].project(ball_inW[None])[0][0]
    mask = np.zeros(frame.image.shape[:2], np.uint8)
    cv2.circle(mask, (round(uv_px[0]), round(uv_px[1])), AROUND_PX, 255, cv2.FILLED)
    image = np.asarray(cv2.inpaint(frame.image, mask, 3.0, cv2.INPAINT_TELEA), np.uint8)
    image.flags.writeable = False
    return replace(frame, image=image)


def distance2(estimate: Estimate, p_BinW: Array, R_BtoW: Array) -> float:
    """Return the squared Mahalanobis distance of a pose from the truth."""
    e = np.concatenate((p_BinW - estimate.p_BinW, so3.log(estimate.R_BtoW.T @ R_BtoW)))
    return float(e @ np.linalg.solve(estimate.covariance[:6, :6], e))


@pytest.mark.parametrize("ball", range(3))
def test_a_ball_painted_over_for_a_second_makes_no_pose_wrong(lab_flight: Path, ball: int) -> None:
    settings, truth = load_settings("lab"), read_ground_truth(lab_flight)
    source = RecordingSource(lab_flight, lambda: 0)
    rig = rig_of(settings, source.cameras, source.camera_count).rig
    tracker = Tracker(rig, tuning_of(settings.tracker), lambda: 0)
    estimates: list[Estimate] = []
    for event in source:
        t_s = (event.t_ns - int(truth.t_ns[0])) * 1e-9
        if isinstance(event, Frame) and FIRST_S <= t_s < LAST_S:
            event = painted_over(event, rig, ball, truth)
        estimates += tracker.step(event).estimates
    estimates += tracker.finish().estimates
    assert [estimate.t_ns for estimate in estimates] == truth.t_ns.tolist()
    distances = [distance2(*row) for row in zip(estimates, truth.p_BinW, truth.R_BtoW, strict=True)]
    assert max(distances) < POSE_LIMIT
    hidden = (truth.t_ns - truth.t_ns[0]) * 1e-9
    among = [e for e, t_s in zip(estimates, hidden, strict=True) if FIRST_S + 0.5 < t_s < LAST_S - 0.05]
    assert min(float(np.trace(e.covariance[3:6, 3:6])) for e in among) > np.radians(2.0) ** 2  # truly hidden
    assert {e.reset_counter for e in estimates} == {0}

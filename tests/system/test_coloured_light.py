"""A recording seen in light of another colour than the config's: from the start, and changing in flight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.settings import load_settings, rig_of
from bridge.settings.tuning import tuning_of
from tools.bench.trial import POSE_LIMIT, nees
from tracker.maths import so3
from tracker.pipeline import Tracker
from tracker.sources.groundtruth import GroundTruth, read_ground_truth
from tracker.sources.recording import RecordingSource
from tracker.types import Array, Estimate, Frame

PAIRS = 45
CHANGE_PAIR = 15
NEUTRAL = (1.0, 1.0, 1.0)
REDDER, BLUER = (0.8, 1.0, 1.2), (1.2, 1.0, 0.8)
Light = Callable[[int, int], tuple[float, float, float]]
"""Factors on blue, green and red by pair and camera."""
STEADY: dict[str, Light] = {
    "redder": lambda _pair, _camera: REDDER,
    "bluer": lambda _pair, _camera: BLUER,
    "redder, and dimmer by half": lambda _pair, _camera: (0.4, 0.5, 0.6),
}
CHANGING: dict[str, Light] = {
    "redder at once": lambda pair, _camera: REDDER if pair >= CHANGE_PAIR else NEUTRAL,
    "bluer at once": lambda pair, _camera: BLUER if pair >= CHANGE_PAIR else NEUTRAL,
    "redder at once in one camera": lambda pair, camera: REDDER if pair >= CHANGE_PAIR and camera == 1 else NEUTRAL,
    "to and fro": lambda pair, _camera: (1.0 - 0.2 * np.sin(pair / 4), 1.0, 1.0 + 0.2 * np.sin(pair / 4)),
}


def flown(recording: Path, light: Light) -> tuple[list[Estimate], GroundTruth]:
    """Track a recording's first pairs in a light."""
    settings, truth = load_settings("lab"), read_ground_truth(recording)
    source = RecordingSource(recording, lambda: 0)
    tracker = Tracker(rig_of(settings, source.cameras, 2).rig, tuning_of(settings.tracker), lambda: 0)
    estimates: list[Estimate] = []
    for event in source:
        pair = int(np.searchsorted(truth.t_ns, event.t_ns))
        if not isinstance(event, Frame) or pair >= PAIRS:
            continue
        lit = np.clip(np.rint(event.image * np.array(light(pair, event.camera))), 0, 255).astype(np.uint8)
        estimates += tracker.step(replace(event, image=lit)).estimates
    return [*estimates, *tracker.finish().estimates], truth


def errors(estimates: list[Estimate], truth: GroundTruth) -> Array:
    """Return position and rotation errors (n, 6) [m, rad]."""
    at = np.searchsorted(truth.t_ns, [estimate.t_ns for estimate in estimates])
    found = [
        (*(truth.p_BinW[i] - e.p_BinW), *so3.log(e.R_BtoW.T @ truth.R_BtoW[i]))
        for e, i in zip(estimates, at, strict=True)
    ]
    return np.array(found)


def assert_right(estimates: list[Estimate], truth: GroundTruth) -> None:
    """No pose is wrong, and they are as accurate as in the config's light."""
    off = errors(estimates, truth)
    assert nees(off, np.stack([estimate.covariance[:6, :6] for estimate in estimates])).max() < POSE_LIMIT
    assert np.linalg.norm(off[:, :3], axis=1).mean() < 0.3e-3


@pytest.mark.parametrize("light", STEADY.values(), ids=STEADY)
def test_in_light_of_another_colour_the_marker_is_found_within_half_a_second(light: Light, lab_flight: Path) -> None:
    estimates, truth = flown(lab_flight, light)
    assert len(estimates) >= PAIRS - 7
    assert_right(estimates, truth)


@pytest.mark.parametrize("light", CHANGING.values(), ids=CHANGING)
def test_light_that_changes_its_colour_in_flight_costs_nothing(light: Light, lab_flight: Path) -> None:
    estimates, truth = flown(lab_flight, light)
    assert len(estimates) == PAIRS
    assert_right(estimates, truth)

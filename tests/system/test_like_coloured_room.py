"""Flights before wood of a ball's own colour: the ball is one spot with it, until the room behind is taken off."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
import pytest

from bridge.settings import load_settings
from tests.system.bumps import CLOCKS
from tests.system.flights import DARK, DURATION_S, FRAMES, LINEAR, RATE_HZ, RIG, TIMING, VEHICLE
from tools.bench.trial import Flown, Trial, tracked
from tools.session import tracker_of
from tracker.scene import SceneRenderer, Trouble
from tracker.scene.backdrop import backdrop
from tracker.sources.paths import Pose, ScriptedPath
from tracker.sources.sim import START_NS
from tracker.types import Array, Event, Frame, Image

WOOD_BGR = np.array([52.0, 94.0, 158.0])  # of the orange ball's hue, and saturated enough
BOTH = tuple(range(len(RIG.cameras)))
ALL_SEEN = 2 * len(RIG.cameras) * len(RIG.marker)
MARGIN_PX = 40
START_S = 0.6  # until what has moved is told from what has not
GONE_S = 0.5


@dataclass(frozen=True)
class Case:
    """A room and a flight: boards hang behind where the balls are from one time to another [s], in some cameras.

    stands_s: how long the vehicle stands before it flies.  gone_s: from when on no ball is to be seen, for GONE_S.
    """

    name: str
    first_s: float = 0.0
    last_s: float = DURATION_S
    cameras: tuple[int, ...] = BOTH
    stands_s: float = 0.0
    gone_s: float = np.inf

    def __str__(self) -> str:
        return self.name.replace(" ", "-")

    @property
    def path(self) -> ScriptedPath:
        """Return the truth."""
        return ScriptedPath(self.name, self._pose, START_NS)

    def _pose(self, t_s: float) -> Pose:
        return VEHICLE.path(max(0.0, t_s - self.stands_s))

    def trouble(self, t_s: float) -> Trouble:
        """Return what spoils a picture."""
        gone = self.gone_s <= t_s < self.gone_s + GONE_S
        return Trouble(repainted=tuple((ball, DARK) for ball in range(len(RIG.marker)))) if gone else Trouble()


CASES = [
    Case("all along"),
    Case("where it starts", last_s=0.5),
    Case("on its way", 2.0, 3.0),
    Case("in one camera", cameras=(1,)),
    Case("it stands there first", stands_s=1.0),
    Case("it is gone for a while", gone_s=2.5),
]
each_case = pytest.mark.parametrize("case", CASES, ids=str)


def wood(width_px: int, height_px: int, rng: np.random.Generator) -> Array:
    """Return boards (height, width, 3) with grain along them and joints."""
    grain = cv2.resize(rng.normal(1.0, 0.12, (height_px, max(2, width_px // 40))), (width_px, height_px))
    boards = WOOD_BGR * cv2.GaussianBlur(grain, (0, 0), 1.2)[..., None]
    boards[:: height_px // 4 + 1] = WOOD_BGR / 2.0
    return np.asarray(boards)


def room(camera: int, case: Case) -> Image:
    """Return what a camera sees without the vehicle."""
    view, rng = RIG.cameras[camera], np.random.default_rng(camera + 1)
    wall = backdrop(view.width_px, view.height_px, rng)
    if camera in case.cameras:
        seen = np.concatenate([view.project(balls(case.path.path(t_s)))[0] for t_s in _times_s(case)])
        left, top = np.maximum(seen.min(axis=0) - MARGIN_PX, 0).astype(int)
        right, bottom = np.minimum(seen.max(axis=0) + MARGIN_PX, (view.width_px, view.height_px)).astype(int)
        wall[top:bottom, left:right] = wood(right - left, bottom - top, rng)
    return np.clip(wall, 0, 255).astype(np.uint8)


def _times_s(case: Case) -> Array:
    return np.linspace(case.first_s, case.last_s, 40)


def balls(pose: Pose) -> Array:
    """Return where the balls are (n, 3) [m]."""
    p_BinW, R_BtoW = pose
    return np.asarray(RIG.marker.points_inB @ R_BtoW.T + p_BinW)


def frames(case: Case) -> Iterable[Event]:
    """Render a flight."""
    renderer, count = SceneRenderer(RIG, LINEAR, 1, [room(camera, case) for camera in BOTH]), LINEAR.sub_exposures
    shutter_ns = ((np.arange(count) + 0.5) / count - 0.5) * LINEAR.exposure_s * 1e9
    for k in range(FRAMES):
        t_ns = START_NS + round(k * 1e9 / RATE_HZ)
        poses = [case.path.pose_at(t_ns + round(after_ns)) for after_ns in shutter_ns]
        for camera in BOTH:
            yield Frame(camera, t_ns, renderer.render(camera, poses, case.trouble(k / RATE_HZ)), t_ns)


@cache
def flown(case: Case) -> Flown:
    return tracked(Trial(case.path, TIMING, LINEAR, seed=1), RIG, frames(case))


@each_case
def test_no_pose_is_wrong(case: Case) -> None:
    assert flown(case).wrong() == {}


@each_case
def test_the_track_starts_once_the_vehicle_moves(case: Case) -> None:
    assert flown(case).seconds[0] < case.stands_s + START_S


@each_case
def test_every_round_gives_a_pose_from_then_on(case: Case) -> None:
    run = flown(case)
    missing_s = np.diff(run.seconds).max() - 1.0 / RATE_HZ
    assert missing_s < (0.01 if case.gone_s > DURATION_S else GONE_S + 0.1)
    assert run.seconds[-1] > DURATION_S - 1.5 / RATE_HZ


@each_case
def test_the_ball_is_seen_before_the_wood(case: Case) -> None:
    run = flown(case)
    assert (run.nis_dof == ALL_SEEN).mean() > 0.85
    assert run.between(case.stands_s + 1.0, DURATION_S).position_mm.mean() < 0.3


def test_what_a_track_starts_on_is_told() -> None:
    """Before wood by the first of two attempts: the balls without the room, and then with it."""
    tracker = tracker_of(load_settings("lab"), RIG, CLOCKS)
    steps = (tracker.step(frame) for frame in frames(CASES[0]))
    first = next(step for step in steps if step.estimates)
    assert len(first.sightings) == len(RIG.cameras) * len(RIG.marker)

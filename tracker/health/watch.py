"""The watch over the calibration while flying.

each round: a few patches of the room in each camera -> Background
every other second: the newest sightings of all cameras -> Agreement (evidence), residuals (figures)
-> Health, whenever one of them has something to say
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from tracker.camera import Camera
from tracker.filter.measure import predicted_pixels
from tracker.health.agreement import Agreement, Odds, left_open
from tracker.health.background import NEVER_NS, Background
from tracker.health.mend import turned
from tracker.health.rays import residuals
from tracker.health.sample import Sample, take_sample
from tracker.rig import Rig
from tracker.standing import CameraHealth, Health, Witness
from tracker.state import State
from tracker.types import BallSighting, Frame

SAMPLE_NS = 2_000_000_000
TOGETHER_NS = 70_000_000  # sightings of different cameras this close are held against one state
FIGURES = 5  # samples that the figures are of
REACH = 1.5  # of the marker's size: how far rotor and boom reach round the balls
NOBODY = Odds(at_odds=False)


class CalibrationWatch:
    """Notice that a camera no longer stands where it stood when the flight began, or where the room file has it.

    rig: as calibrated.  sigma_px: what a camera adds to the noise of its fits [px].
    calibrated_px: by how much balls missed when the room was calibrated [px]; None where nobody measured it.
    """

    def __init__(self, rig: Rig, sigma_px: float, calibrated_px: float | None = None) -> None:
        self._rig = rig
        self._sigma_px = max(sigma_px, calibrated_px or 0.0)
        cameras = rig.cameras
        self._backgrounds = [Background(camera, ahead=k / len(cameras)) for k, camera in enumerate(cameras)]
        faults = None if calibrated_px is None else left_open(calibrated_px, rig)
        self._agreement = Agreement(len(cameras), faults)
        self._odds = NOBODY
        self._left: deque[Callable[[], None]] = deque()  # of the last sample's judgement, a part a round
        self._newest: dict[int, list[BallSighting]] = {}
        self._sampled_ns = self._due_ns = -NEVER_NS
        self._taken_ns = NEVER_NS
        self._figures: deque[tuple[list[float], list[float]]] = deque(maxlen=FIGURES)
        self._size_m = float(np.linalg.norm(rig.marker.points_inB, axis=1).max())

    def take(
        self,
        frames: Sequence[Frame],
        used: Sequence[BallSighting],
        refused: Sequence[BallSighting],
        state: State | None,
        t_ns: int,
    ) -> Health | None:
        """Take one round.

        Args:
            frames: of one instant, t_ns [ns].  used, refused: sightings in them that fit the state, and that did not.
            state: at that instant; None while nothing is tracked.
        Returns:
            How the calibration stands, where the round told something new of it.
        """
        if self._left:
            self._left.popleft()()
            return None if self._left else self.health(state, t_ns)
        if not refused and self._taken_ns <= t_ns < self._due_ns:
            return None
        self._taken_ns = t_ns
        for camera in {one.camera for one in refused}:
            self._backgrounds[camera].hurry()
        looked = [self._look(frame, state) for frame in frames]
        self._remember(used, refused)
        if state is not None:
            self._sample(state, t_ns)
        self._due_ns = min(self._sampled_ns + SAMPLE_NS - TOGETHER_NS, *(each.due_ns for each in self._backgrounds))
        return self.health(state, t_ns) if any(looked) else None

    def health(self, state: State | None, t_ns: int) -> Health:
        """Return how the calibration stands."""
        off_px = [value for figures, _ in self._figures for value in figures]
        longer_m = [value for _, figures in self._figures for value in figures]
        cameras = tuple(self._camera(index, state) for index in range(len(self._rig.cameras)))
        named = any(camera.moved for camera in cameras)
        at_odds, from_start = self._odds.at_odds and not named, self._odds.from_start
        return Health(t_ns, cameras, at_odds, _rms(off_px), _rms(longer_m, 1e3), from_start)

    def mended(self, camera: int) -> Camera | None:
        """Return a moved camera as the room tells that it stands now, None where the room does not tell."""
        background = self._backgrounds[camera]
        if background.witness is not Witness.MOVED or background.shift is None:
            return None
        return turned(self._rig.cameras[camera], background.shift)

    def _remember(self, used: Sequence[BallSighting], refused: Sequence[BallSighting]) -> None:
        """Keep each camera's newest sightings: what fits, or where nothing does, what does not."""
        for camera in {one.camera for one in (*used, *refused)}:
            fitting = [one for one in used if one.camera == camera]
            self._newest[camera] = fitting or [one for one in refused if one.camera == camera]

    def _look(self, frame: Frame, state: State | None) -> bool:
        """Look at the room in a frame, but not where the vehicle is."""
        background, camera = self._backgrounds[frame.camera], self._rig.cameras[frame.camera]
        if background.chosen or state is None:
            return background.look(frame.image, frame.t_ns)
        balls_px, _ = predicted_pixels(state, self._rig, frame.camera, frame.t_ns)
        off_px = REACH * self._size_m * camera.focal_px / float(np.linalg.norm(state.p_BinW - camera.p_CinW))
        return background.look(frame.image, frame.t_ns, balls_px[np.isfinite(balls_px).all(axis=1)], off_px)

    def _sample(self, state: State, t_ns: int) -> None:
        """Hold the newest sightings against each other, if it is time; what that says is found in the next rounds."""
        if 0 <= t_ns - self._sampled_ns < SAMPLE_NS:
            return
        near = [one for seen in self._newest.values() for one in seen if abs(one.t_ns - t_ns) <= TOGETHER_NS]
        sample = take_sample(near, state, self._rig, self._sigma_px)
        if sample is not None:
            self._sampled_ns = t_ns
            self._left += (lambda: self._weigh(sample)), (lambda: self._figures.append(residuals(near, self._rig)))

    def _weigh(self, sample: Sample) -> None:
        self._odds = self._agreement.add(sample)

    def _camera(self, index: int, state: State | None) -> CameraHealth:
        background, camera = self._backgrounds[index], self._rig.cameras[index]
        largest_px = 0.0 if background.newest is None else background.newest.largest_px
        away_m = 0.0 if state is None else float(np.linalg.norm(state.p_BinW - camera.p_CinW))
        moved = background.witness is Witness.MOVED or index in self._odds.suspects
        at_vehicle_mm = 1e3 * largest_px * away_m / camera.focal_px
        return CameraHealth(camera.name, moved, background.witness, largest_px, at_vehicle_mm)


def _rms(values: Sequence[float], scale: float = 1.0) -> float | None:
    return scale * math.sqrt(sum(value * value for value in values) / len(values)) if values else None

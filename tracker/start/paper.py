"""The paper's own method, for comparison: blob centroids, triangulation, eq. 4-6, each round by itself."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType

import numpy as np

from tracker.image.detect import Blob
from tracker.image.look import look_everywhere
from tracker.maths import so3
from tracker.rig import Rig
from tracker.rounds import Rounds
from tracker.start.acquire import CENTROID_SIGMA_PX
from tracker.start.associate import associate
from tracker.start.pose3 import pose
from tracker.start.triangulate import triangulate
from tracker.state import ATTITUDE, POSITION, RATE, VELOCITY
from tracker.tuning import Tuning
from tracker.types import (
    Array,
    BallSighting,
    Estimate,
    Event,
    Frame,
    Point,
    Reason,
    Rejected,
    Step,
    TrackState,
    frozen_array,
)

STEP_M = 1e-5  # of the finite differences


class PaperTracker:
    """Measure the pose in every round on its own, as the paper does; there is no filter and nothing is predicted.

    The largest blob of each colour is the ball. Velocity and rate are differences to the round before; after a gap
    they are unknown, with a variance that says so.
    """

    def __init__(self, rig: Rig, tuning: Tuning, stopwatch: Callable[[], int]) -> None:
        self._rig = rig
        self._tuning = tuning
        self._stopwatch = stopwatch
        self._rounds = Rounds(len(rig.cameras), tuning.sync_window_ns)
        self._before: Estimate | None = None
        self._track = TrackState.SEARCHING

    def step(self, event: Event) -> Step:
        """Take one event of the source and return what came of it."""
        if isinstance(event, Rejected):
            return Step(self._track, rejections=(event,))
        return self._work(self._rounds.take(event), event.t_ns)

    def finish(self) -> Step:
        """Work off the round that was still open when the frames ended."""
        return self._work(self._rounds.rest(), None)

    def _work(self, rounds: list[tuple[Frame, ...]], now_ns: int | None) -> Step:
        sightings: list[BallSighting] = []
        rejections: list[Rejected] = []
        estimates: list[Estimate] = []
        for frames in rounds:
            started_ns = self._stopwatch()
            seen = [sighting for frame in frames for sighting in self._look(frame)]
            sightings += seen
            found = self._locate(seen, max(frame.t_ns for frame in frames))
            if isinstance(found, Rejected):
                rejections.append(found)
            elif self._before is None or found[0] > self._before.t_ns:
                self._track = TrackState.TRACKING
                estimates.append(self._estimate(*found, max(frame.available_ns for frame in frames), started_ns))
        if now_ns is not None and self._before is not None and now_ns - self._before.t_ns > self._tuning.coast_limit_ns:
            self._track = TrackState.LOST
        return Step(self._track, tuple(sightings), tuple(rejections), tuple(estimates))

    def _look(self, frame: Frame) -> list[BallSighting]:
        """Take the largest blob of each colour for the ball."""
        blobs: list[list[Blob]] = look_everywhere(frame, self._rig.cameras[frame.camera], self._rig)
        cov_px = frozen_array(CENTROID_SIGMA_PX**2 * np.eye(2))
        return [
            BallSighting(frame.camera, ball, frame.t_ns, found[0].uv_px, cov_px)
            for ball, found in enumerate(blobs)
            if found
        ]

    def _locate(self, seen: list[BallSighting], t_ns: int) -> tuple[int, Array, Array, Array] | Rejected:
        """Triangulate the balls and return (t_ns, p_BinW, R_BtoW, covariance (6, 6))."""
        points: list[Point] = []
        for ball in range(len(self._rig.marker)):
            point = self._point([sighting for sighting in seen if sighting.ball == ball])
            if isinstance(point, Rejected):
                name = self._rig.marker.balls[ball].name
                return Rejected(point.reason, f"{name}: {point.detail}", t_ns)
            points.append(point)
        chosen = associate([[point] for point in points], self._rig.marker, 0.0)
        if isinstance(chosen, Rejected):
            return Rejected(chosen.reason, chosen.detail, t_ns)
        places = np.stack([point.p_inW for point in points])
        found = pose(places, self._rig.marker)
        if isinstance(found, Rejected):
            return Rejected(found.reason, found.detail, t_ns)
        J = self._jacobian(places)
        if J is None:
            return Rejected(Reason.SINGULAR, "the attitude has no derivative here", t_ns)
        spread = np.zeros((J.shape[1], J.shape[1]))
        for i, point in enumerate(points):
            spread[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = point.covariance
        return t_ns, found[0], found[1], J @ spread @ J.T

    def _point(self, seen: list[BallSighting]) -> Point | Rejected:
        cameras = [self._rig.cameras[sighting.camera] for sighting in seen]
        if len(cameras) < 2:
            return Rejected(Reason.NOT_FOUND, "not seen by two cameras")
        rays = [camera.bearings(s.uv_px[None])[0] @ camera.R_CtoW.T for camera, s in zip(cameras, seen, strict=True)]
        sigma = CENTROID_SIGMA_PX / min(camera.focal_px for camera in cameras)
        return triangulate(np.stack(rays), np.stack([camera.p_CinW for camera in cameras]), sigma)

    def _jacobian(self, places: Array) -> Array | None:
        """Return d (position, rotation vector in B) / d points, (6, 3n), by central differences."""
        J = np.empty((6, places.size))
        here = pose(places, self._rig.marker)
        for k in range(places.size):
            step = np.zeros(places.size)
            step[k] = STEP_M
            ahead = pose(places + step.reshape(places.shape), self._rig.marker)
            behind = pose(places - step.reshape(places.shape), self._rig.marker)
            if isinstance(here, Rejected) or isinstance(ahead, Rejected) or isinstance(behind, Rejected):
                return None
            J[:3, k] = (ahead[0] - behind[0]) / (2.0 * STEP_M)
            J[3:, k] = (so3.log(here[1].T @ ahead[1]) - so3.log(here[1].T @ behind[1])) / (2.0 * STEP_M)
        return J

    def _estimate(
        self, t_ns: int, p_BinW: Array, R_BtoW: Array, covariance: Array, available_ns: int, started_ns: int
    ) -> Estimate:
        P = np.zeros((12, 12))
        P[:6, :6] = covariance
        v_BinW, w_BinB = np.zeros(3), np.zeros(3)
        P[VELOCITY, VELOCITY] = self._tuning.process.initial_speed_m_s**2 * np.eye(3)
        P[RATE, RATE] = self._tuning.process.initial_rate_rad_s**2 * np.eye(3)
        before = self._before
        if before is not None and t_ns - before.t_ns <= self._tuning.coast_limit_ns:
            dt = (t_ns - before.t_ns) * 1e-9
            v_BinW = (p_BinW - before.p_BinW) / dt
            w_BinB = so3.log(before.R_BtoW.T @ R_BtoW) / dt
            P[VELOCITY, VELOCITY] = (covariance[POSITION, POSITION] + before.covariance[POSITION, POSITION]) / dt**2
            P[RATE, RATE] = (covariance[ATTITUDE, ATTITUDE] + before.covariance[ATTITUDE, ATTITUDE]) / dt**2
        estimate = Estimate(
            t_ns=t_ns,
            p_BinW=frozen_array(p_BinW),
            R_BtoW=frozen_array(R_BtoW),
            v_BinW=frozen_array(v_BinW),
            w_BinB=frozen_array(w_BinB),
            covariance=frozen_array(P),
            state=self._track,
            reset_counter=0,
            available_ns=available_ns,
            stages_ns=MappingProxyType({"wait": started_ns - available_ns, "track": self._stopwatch() - started_ns}),
        )
        self._before = estimate
        return estimate

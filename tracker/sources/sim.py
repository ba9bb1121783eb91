"""Frames of a vehicle that is simulated, seen by cameras that are simulated too."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.scene import Look, SceneRenderer, Trouble
from tracker.sources.paths import Pose, Vehicle
from tracker.sources.protocol import ClosesOnExit, Stopwatch
from tracker.types import Event, Frame, Image

START_NS = 1_000_000_000
"""Stream time of a simulation's first frame [ns]: not zero, which some autopilots read as `unknown`."""

NEAR_M = 0.04  # from a ball's centre: the ball, and how far it may go while half the picture is read out
BAND_PX = 2  # rows that a simulated rolling shutter exposes together: of 480 in 20 ms, within 0.1 ms

Troubles = Callable[[int, int], Trouble]
"""What spoils the picture of a camera (index) at a time [ns]."""


@dataclass(frozen=True, slots=True)
class SimTiming:
    """When the simulated cameras take pictures.

    rate_hz: frames a second of each camera.  duration_s: how long.  start_ns: mid-exposure of frame 0 [ns].
    offsets_ns: how much later than the first each camera takes its pictures; empty for a shared trigger. Cameras
        that run freely are up to a frame apart.
    delay_ns: time from mid-exposure until the frame is in memory: a vehicle that is flown has gone on meanwhile.
    """

    rate_hz: float = 15.0
    duration_s: float = 20.0
    start_ns: int = START_NS
    offsets_ns: tuple[int, ...] = ()
    delay_ns: int = 0

    def times(self, camera_count: int) -> Iterator[tuple[int, int]]:
        """Yield (t_ns, camera) in the order of time, then camera."""
        offsets = self.offsets_ns or (0,) * camera_count
        order = sorted(range(camera_count), key=lambda camera: (offsets[camera], camera))
        for frame in range(round(self.duration_s * self.rate_hz)):
            at_ns = self.start_ns + round(frame * 1e9 / self.rate_hz)
            for camera in order:
                yield at_ns + offsets[camera], camera

    def check(self, camera_count: int) -> None:
        """Refuse what cannot be.

        Raises:
            OperatorError: a rate or duration that is not positive, or offsets that do not fit the cameras.
        """
        for name, value in (("rate_hz", self.rate_hz), ("duration_s", self.duration_s)):
            if not (np.isfinite(value) and value > 0):
                raise OperatorError(f"sim: {name} {value:g} must be positive; correct it")
        if self.offsets_ns and len(self.offsets_ns) != camera_count:
            raise OperatorError(
                f"sim: {len(self.offsets_ns)} offsets for {camera_count} cameras; give one for each camera, or none"
            )
        period_ns = 1e9 / self.rate_hz
        if any(not 0 <= offset < period_ns for offset in self.offsets_ns):
            raise OperatorError(
                f"sim: offsets_ns must lie from 0 to the frame period, {period_ns:.0f} ns; correct them"
            )


class SimSource(ClosesOnExit):
    """Render each frame when it is asked for, in the order of time.

    The vehicle may be scripted (open loop) or flown by what becomes of the frames (closed loop): before a frame is
    given out the vehicle is taken on to the frame's time and delay, so that an answer to the frame reaches it no
    earlier than in life.
    """

    def __init__(
        self,
        rig: Rig,
        vehicle: Vehicle,
        stopwatch: Stopwatch,
        timing: SimTiming | None = None,
        look: Look | None = None,
        seed: int = 0,
        troubles: Troubles | None = None,
    ) -> None:
        """Prepare the renderer.

        Args:
            rig: the cameras as they truly are, and the marker.
            vehicle: where the balls are.
            stopwatch: stamps `Frame.available_ns`.
            timing, look, seed: when the pictures are taken, how they look, and their noise.
            troubles: what spoils a picture; None for nothing.
        Raises:
            OperatorError: a timing that cannot be.
        """
        self.cameras = rig.cameras
        self.camera_count = len(rig.cameras)
        self._vehicle = vehicle
        self._stopwatch = stopwatch
        self._timing = timing or SimTiming()
        self._timing.check(self.camera_count)
        self._look = look or Look()
        self._times = self._timing.times(self.camera_count)
        self._renderer = SceneRenderer(rig, self._look, seed)
        self._troubles = troubles or _no_trouble
        self._points_inB = rig.marker.points_inB
        self._closed = False

    def __iter__(self) -> Iterator[Event]:
        """Yield the frames."""
        for t_ns, camera in self._times:
            if self._closed:
                return
            yield self._frame(t_ns, camera)

    def pose_at(self, t_ns: int) -> Pose:
        """Return the true p_BinW (3,) [m] and R_BtoW (3, 3) at t_ns [ns]."""
        return self._vehicle.pose_at(t_ns)

    def close(self) -> None:
        """End the iteration."""
        self._closed = True

    def _frame(self, t_ns: int, camera: int) -> Frame:
        image = self._exposed(t_ns, camera, t_ns)
        if self.cameras[camera].readout_ns:
            image = self._rolled(t_ns, camera, image)
        image.flags.writeable = False
        self._vehicle.pose_at(t_ns + self._timing.delay_ns)
        return Frame(camera, t_ns, image, self._stopwatch())

    def _exposed(self, t_ns: int, camera: int, row_ns: int) -> Image:
        """Render the picture of a frame with every row exposed round one time [ns]."""
        poses = [self._vehicle.pose_at(row_ns + after_ns) for after_ns in self._shutter_ns()]
        return self._renderer.render(camera, poses, self._troubles(camera, t_ns))

    def _rolled(self, t_ns: int, camera: int, image: Image) -> Image:
        """Read a picture out as a rolling shutter does: round each ball, every band of rows at its own time."""
        eye, (p_BinW, R_BtoW) = self.cameras[camera], self._vehicle.pose_at(t_ns)
        points_inW = self._points_inB @ R_BtoW.T + p_BinW
        reach_px = NEAR_M * eye.focal_px / np.abs(eye.in_camera(points_inW)[:, 2])
        rows = eye.project(points_inW)[0][:, 1]
        rolled = image.copy()
        for top in range(0, eye.height_px, BAND_PX):
            if (np.abs(rows - top) < reach_px).any():
                band = slice(top, top + BAND_PX)
                row_ns = t_ns + round(eye.delay_ns(top + (BAND_PX - 1) / 2.0))
                rolled[band] = self._exposed(t_ns, camera, row_ns)[band]
        return rolled

    def _shutter_ns(self) -> list[int]:
        """Return the sub-exposures' times from mid-exposure [ns], each the middle of an equal part."""
        count, exposure_ns = self._look.sub_exposures, self._look.exposure_s * 1e9
        return [round(((k + 0.5) / count - 0.5) * exposure_ns) for k in range(count)]


def _no_trouble(_camera: int, _t_ns: int) -> Trouble:
    return Trouble()

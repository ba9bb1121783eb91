"""Which frames are fit to be tracked."""

from __future__ import annotations

import numpy as np

from tracker.rig import Rig
from tracker.types import Frame, Image, Reason, Rejected

GLANCE_ROWS, GLANCE_COLUMNS = 37, 41  # one pixel in so many is compared at first


class Intake:
    """Refuse images of the wrong size, and an image that its camera has just given before.

    No sensor gives the same noise twice: a repeated image comes from a driver that hangs and goes on stamping. Sent on,
    it would be a stale pose with fresh stamps, which an autopilot believes until it crashes.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._last: dict[int, tuple[bytes, Image]] = {}

    def refuse(self, frame: Frame) -> Rejected | None:
        """Say why a frame cannot be used, or None; remember its image."""
        camera = self._rig.cameras[frame.camera]
        height, width = frame.image.shape[:2]
        if (width, height) != (camera.width_px, camera.height_px):
            detail = f"{camera.name}: {width} x {height} px, calibrated for {camera.width_px} x {camera.height_px}"
            return Rejected(Reason.WRONG_SIZE, detail, frame.t_ns, frame.camera)
        last = self._last.get(frame.camera)
        glance = frame.image[::GLANCE_ROWS, ::GLANCE_COLUMNS].tobytes()
        self._last[frame.camera] = glance, frame.image
        if last is None or last[0] != glance or not np.array_equal(last[1], frame.image):
            return None
        return Rejected(Reason.REPEATED, f"{camera.name} gives the same image again", frame.t_ns, frame.camera)

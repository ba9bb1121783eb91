"""Which frames are fit to be tracked."""

from __future__ import annotations

import numpy as np

from tracker.rig import Rig
from tracker.types import Frame, Image, Reason, Rejected

LEAP_NS = 1_000_000_000
GLANCE_ROWS, GLANCE_PX = 61, 8  # of one row in so many, so many pixels side by side are compared at first


class Intake:
    """Refuse images of the wrong size, stamps that leap ahead, and an image that its camera has just given before.

    No sensor gives the same noise twice: a repeated image comes from a driver that hangs and goes on stamping. Sent on,
    it would be a stale pose with fresh stamps, which an autopilot believes until it crashes.
    One stamp far in the future would make all true frames after it look late. It is believed when the camera goes on
    from there: then there was a pause.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._last: dict[int, tuple[bytes, Image]] = {}
        self._newest_ns: int | None = None
        self._leapt_ns: dict[int, int] = {}

    def wait(self, t_ns: int) -> None:
        """Take note that time went on to t_ns [ns] without a frame."""
        self._newest_ns = t_ns if self._newest_ns is None else max(self._newest_ns, t_ns)

    def refuse(self, frame: Frame) -> Rejected | None:
        """Say why a frame cannot be used, or None; remember its image."""
        camera = self._rig.cameras[frame.camera]
        height, width = frame.image.shape[:2]
        if (width, height) != (camera.width_px, camera.height_px):
            detail = f"{camera.name}: {width} x {height} px, calibrated for {camera.width_px} x {camera.height_px}"
            return Rejected(Reason.WRONG_SIZE, detail, frame.t_ns, frame.camera)
        if self._leaps(frame):
            detail = f"{camera.name}: stamped more than {LEAP_NS * 1e-9:g} s after every frame before it"
            return Rejected(Reason.EARLY, detail, frame.t_ns, frame.camera)
        last = self._last.get(frame.camera)
        middle = width // 2
        glance = frame.image[::GLANCE_ROWS, middle : middle + GLANCE_PX].tobytes()
        self._last[frame.camera] = glance, frame.image
        if last is None or last[0] != glance or not np.array_equal(last[1], frame.image):
            return None
        return Rejected(Reason.REPEATED, f"{camera.name} gives the same image again", frame.t_ns, frame.camera)

    def _leaps(self, frame: Frame) -> bool:
        """Say whether a stamp leaps ahead, and its camera has not leapt there before."""
        newest_ns, leapt_ns = self._newest_ns, self._leapt_ns.get(frame.camera)
        if newest_ns is not None and frame.t_ns - newest_ns > LEAP_NS:
            self._leapt_ns[frame.camera] = frame.t_ns
            if leapt_ns is None or not 0 < frame.t_ns - leapt_ns <= LEAP_NS:
                return True
        self.wait(frame.t_ns)
        return False

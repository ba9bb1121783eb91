"""One live camera: how it is set up, what it refused, and when its frames were exposed."""

from __future__ import annotations

from dataclasses import dataclass

import cv2

from tracker.errors import OperatorError
from tracker.sources.capture import V4L2_BUFFERS, Capture, is_network

ASSUMED_RATE_HZ = 30.0
MAX_LATENCY_MS = 1000.0
MAX_DEVICE_AGE_NS = 500_000_000
_MANUAL_EXPOSURE = 1  # V4L2_EXPOSURE_MANUAL
_EXPOSURE_STEPS_PER_MS = 10  # V4L2_CID_EXPOSURE_ABSOLUTE counts 100 us


@dataclass(frozen=True, slots=True)
class LiveCamera:
    """A camera as the operator describes it; None leaves a setting as the device has it.

    address: number, device path, rtsp:// or http:// address, or GStreamer pipeline.
    name: its name in messages.
    fps, width_px, height_px, fourcc: what to ask the device for [Hz, px]; fourcc such as "MJPG" (two raw USB cameras
        do not fit on one USB 2 bus).
    exposure_ms: fixed exposure time [ms].
    latency_ms: measured time from mid-exposure to the stamp [ms], in place of the default of `latencies`.
    lock: fix exposure, white balance and focus. Automatic ones change the balls' colours and the calibration.
    """

    address: str
    name: str
    fps: float | None = None
    width_px: int | None = None
    height_px: int | None = None
    fourcc: str | None = None
    exposure_ms: float | None = None
    latency_ms: float | None = None
    lock: bool = True

    def __post_init__(self) -> None:
        """Refuse settings that no camera can have, by OperatorError."""
        for key in ("fps", "width_px", "height_px", "exposure_ms"):
            value = getattr(self, key)
            if value is not None and not value > 0:
                raise OperatorError(f"camera {self.name}: {key} {value:g} must be positive; correct it or leave it out")
        if self.latency_ms is not None and not 0 <= self.latency_ms <= MAX_LATENCY_MS:
            raise OperatorError(
                f"camera {self.name}: latency_ms {self.latency_ms:g} must be 0 to {MAX_LATENCY_MS:g}; measure it again"
            )
        if self.fps is not None and self.exposure_ms is not None and self.exposure_ms > 1e3 / self.fps:
            raise OperatorError(
                f"camera {self.name}: exposure_ms {self.exposure_ms:g} must be at most {1e3 / self.fps:.4g} at "
                f"{self.fps:g} frames a second; it is in milliseconds: correct it, or the frame rate"
            )
        if self.fourcc is not None and len(self.fourcc) != 4:
            raise OperatorError(f"camera {self.name}: fourcc {self.fourcc!r} must be four letters, such as MJPG")


@dataclass(frozen=True, slots=True)
class Latencies:
    """How long after mid-exposure the two possible stamps of a frame are taken [ns].

    device_ns: the driver's own time of the frame.  arrival_ns: the frame's arrival in this program.
    """

    device_ns: int
    arrival_ns: int


def latencies(camera: LiveCamera, rate_hz: float) -> Latencies:
    """Say how long after mid-exposure a frame is stamped, as far as it can be known without measuring.

    A V4L2 driver stamps a buffer when its first data arrive: the exposure of the first row has just ended, so
    mid-exposure was half the exposure time before. A frame arrives whole after being read out and sent as well, which
    takes up to one frame period. Where the exposure time is not known, half a period is taken: the error is then at
    most a quarter of a period, 8 ms at 30 Hz. `latency_ms`, once measured, replaces either sum.

    Args:
        rate_hz: the frame rate the device reports [Hz], not within 1..1000 if it reports none.
    """
    if camera.latency_ms is not None:
        measured_ns = round(camera.latency_ms * 1e6)
        return Latencies(measured_ns, measured_ns)
    reported = rate_hz if 1.0 <= rate_hz <= 1000.0 else ASSUMED_RATE_HZ
    period_ms = 1e3 / (camera.fps or reported)
    exposure_ms = period_ms / 2.0 if camera.exposure_ms is None else camera.exposure_ms
    return Latencies(round(exposure_ms / 2.0 * 1e6), round((exposure_ms / 2.0 + period_ms) * 1e6))


def mid_exposure_ns(capture: Capture, arrival_ns: int, latency: Latencies) -> int:
    """Return when the frame just grabbed was exposed [ns].

    The V4L2 backend gives the buffer's time, on the host's monotonic clock with most drivers. A driver that stamps
    with another clock is found out because the frame would be from the future or more than 500 ms old; then, and
    with every other backend, the arrival counts.
    """
    if capture.getBackendName() == "V4L2":
        device_ns = round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6)
        if 0 <= arrival_ns - device_ns <= MAX_DEVICE_AGE_NS:
            return device_ns - latency.device_ns
    return arrival_ns - latency.arrival_ns


def set_up(capture: Capture, camera: LiveCamera) -> tuple[str, ...]:
    """Ask a device for the camera's settings.

    Returns:
        One line for each thing it refused, for the operator to read.
    """
    if capture.getBackendName() == "V4L2":
        refused = (*_set_format(capture, camera), *_lock(capture, camera))
    else:
        refused = _cannot_set(capture, camera)
    return (*refused, *_wrong_size(capture, camera))


def _set_format(capture: Capture, camera: LiveCamera) -> tuple[str, ...]:
    """Set format before size before rate: each resets the ones after it."""
    wanted: list[tuple[str, int, float | None]] = [
        (f"format {camera.fourcc}", cv2.CAP_PROP_FOURCC, _fourcc(camera)),
        (f"width {camera.width_px} px", cv2.CAP_PROP_FRAME_WIDTH, camera.width_px),
        (f"height {camera.height_px} px", cv2.CAP_PROP_FRAME_HEIGHT, camera.height_px),
        (f"rate {camera.fps} Hz", cv2.CAP_PROP_FPS, camera.fps),
        (f"{V4L2_BUFFERS} buffers", cv2.CAP_PROP_BUFFERSIZE, V4L2_BUFFERS),
    ]
    return _refused(capture, camera, wanted)


def _lock(capture: Capture, camera: LiveCamera) -> tuple[str, ...]:
    if not camera.lock:
        return ()
    steps = None if camera.exposure_ms is None else round(camera.exposure_ms * _EXPOSURE_STEPS_PER_MS)
    wanted: list[tuple[str, int, float | None]] = [
        ("manual exposure", cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL_EXPOSURE),
        (f"exposure {camera.exposure_ms} ms", cv2.CAP_PROP_EXPOSURE, steps),
        ("fixed white balance", cv2.CAP_PROP_AUTO_WB, 0),
        ("fixed focus", cv2.CAP_PROP_AUTOFOCUS, 0),
    ]
    return _refused(capture, camera, wanted)


def _refused(capture: Capture, camera: LiveCamera, wanted: list[tuple[str, int, float | None]]) -> tuple[str, ...]:
    """Set what is wanted, in order, and say what was refused."""
    return tuple(
        f"camera {camera.name}: the device refused {what}"
        for what, prop, value in wanted
        if value is not None and not capture.set(prop, value)
    )


def _cannot_set(capture: Capture, camera: LiveCamera) -> tuple[str, ...]:
    if not camera.lock:
        return ()
    where = "in the camera's own settings" if is_network(camera.address) else "in the pipeline or with v4l2-ctl"
    return (
        f"camera {camera.name}: exposure and white balance cannot be locked through {capture.getBackendName()}; "
        f"lock them {where}",
    )


def _wrong_size(capture: Capture, camera: LiveCamera) -> tuple[str, ...]:
    width, height = (round(capture.get(p)) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
    if camera.width_px in (None, width) and camera.height_px in (None, height):
        return ()
    return (f"camera {camera.name}: gives {width} x {height} px, not {camera.width_px} x {camera.height_px} px",)


def _fourcc(camera: LiveCamera) -> int | None:
    return None if camera.fourcc is None else cv2.VideoWriter.fourcc(*camera.fourcc)

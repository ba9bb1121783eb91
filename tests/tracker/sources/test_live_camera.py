"""How a USB camera is set up and stamped. No such device is at hand in a test: a scripted one stands in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest
from cv2.typing import MatLike

from tracker.errors import OperatorError
from tracker.sources.capture import Capture
from tracker.sources.live_camera import LiveCamera, latencies, mid_exposure_ns, set_up

ARRIVAL_NS = 5_000_000_000_000


@dataclass
class Device:
    """A V4L2 device with the controls it has, and the buffer time it gives."""

    position_ms: float = 0.0
    backend: str = "V4L2"
    refuses: frozenset[int] = frozenset()
    controls: dict[int, float] = field(default_factory=dict)

    def grab(self) -> bool:
        return True

    def retrieve(self) -> tuple[bool, MatLike]:
        return True, np.zeros((480, 640, 3), dtype=np.uint8)

    def get(self, propId: int) -> float:
        return self.position_ms if propId == cv2.CAP_PROP_POS_MSEC else self.controls.get(propId, 0.0)

    def set(self, propId: int, value: float) -> bool:
        if propId in self.refuses:
            return False
        self.controls[propId] = value
        return True

    def getBackendName(self) -> str:
        return self.backend

    def release(self) -> None: ...


def stamp(device: Capture, camera: LiveCamera) -> int:
    return mid_exposure_ns(device, ARRIVAL_NS, latencies(camera, rate_hz=30.0))


def test_a_driver_that_stamps_with_the_hosts_clock_is_believed() -> None:
    device = Device(position_ms=(ARRIVAL_NS - 20_000_000) / 1e6)
    camera = LiveCamera("0", "left", exposure_ms=4.0)
    assert stamp(device, camera) == ARRIVAL_NS - 20_000_000 - 2_000_000


@pytest.mark.parametrize("age_ms", [-0.001, 500.001, 1.7e12, -1.7e12])
def test_a_stamp_of_another_clock_is_not_believed(age_ms: float) -> None:
    device = Device(position_ms=ARRIVAL_NS / 1e6 - age_ms)
    camera = LiveCamera("0", "left", fps=50.0, exposure_ms=4.0)
    assert stamp(device, camera) == ARRIVAL_NS - 2_000_000 - 20_000_000


def test_only_v4l2_gives_capture_times() -> None:
    device = Device(position_ms=(ARRIVAL_NS - 1) / 1e6, backend="FFMPEG")
    camera = LiveCamera("http://camera", "left", fps=50.0, exposure_ms=4.0)
    assert stamp(device, camera) == ARRIVAL_NS - 22_000_000


def test_a_measured_latency_replaces_either_default() -> None:
    camera = LiveCamera("0", "left", exposure_ms=4.0, latency_ms=33.0)
    assert stamp(Device(), camera) == ARRIVAL_NS - 33_000_000
    assert stamp(Device(position_ms=(ARRIVAL_NS - 10**6) / 1e6), camera) == ARRIVAL_NS - 34_000_000


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan"), 90_000.0])
def test_a_device_that_tells_no_rate_is_taken_for_one_of_30_hz(rate_hz: float) -> None:
    assert latencies(LiveCamera("0", "left"), rate_hz) == latencies(LiveCamera("0", "left"), 30.0)


def test_exposure_white_balance_and_focus_are_locked() -> None:
    device = Device()
    assert set_up(device, LiveCamera("0", "left", fourcc="MJPG", fps=30.0, exposure_ms=4.0)) == ()
    assert device.controls == {
        cv2.CAP_PROP_FOURCC: cv2.VideoWriter.fourcc(*"MJPG"),
        cv2.CAP_PROP_FPS: 30.0,
        cv2.CAP_PROP_BUFFERSIZE: 2,
        cv2.CAP_PROP_AUTO_EXPOSURE: 1,
        cv2.CAP_PROP_EXPOSURE: 40,
        cv2.CAP_PROP_AUTO_WB: 0,
        cv2.CAP_PROP_AUTOFOCUS: 0,
    }


def test_automatic_exposure_goes_off_before_an_exposure_is_set() -> None:
    device = Device()
    set_up(device, LiveCamera("0", "left", exposure_ms=4.0))
    order = list(device.controls)
    assert order.index(cv2.CAP_PROP_AUTO_EXPOSURE) < order.index(cv2.CAP_PROP_EXPOSURE)


def test_without_locking_no_control_is_touched() -> None:
    device = Device()
    assert set_up(device, LiveCamera("0", "left", lock=False, exposure_ms=4.0)) == ()
    assert list(device.controls) == [cv2.CAP_PROP_BUFFERSIZE]


def test_what_the_device_refuses_is_told_and_the_rest_is_set() -> None:
    device = Device(refuses=frozenset({cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_AUTOFOCUS, cv2.CAP_PROP_FRAME_WIDTH}))
    device.controls[cv2.CAP_PROP_FRAME_WIDTH] = 800.0
    camera = LiveCamera("0", "left", width_px=640, height_px=480, exposure_ms=4.0)
    assert set_up(device, camera) == (
        "camera left: the device refused width 640 px",
        "camera left: the device refused exposure 4.0 ms",
        "camera left: the device refused fixed focus",
        "camera left: gives 800 x 480 px, not 640 x 480 px",
    )
    assert device.controls[cv2.CAP_PROP_AUTO_WB] == 0


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: LiveCamera("0", "left", fps=0.0), "fps 0 must be positive"),
        (lambda: LiveCamera("0", "left", exposure_ms=-4.0), "exposure_ms -4 must be positive"),
        (lambda: LiveCamera("0", "left", exposure_ms=float("nan")), "exposure_ms nan must be positive"),
        (
            lambda: LiveCamera("0", "left", fps=30.0, exposure_ms=4000.0),
            "camera left: exposure_ms 4000 must be at most 33.33 at 30 frames a second",
        ),
        (lambda: LiveCamera("0", "left", width_px=0), "width_px 0 must be positive"),
        (lambda: LiveCamera("0", "left", latency_ms=-1.0), "latency_ms -1 must be 0 to 1000"),
        (lambda: LiveCamera("0", "left", latency_ms=1e6), "must be 0 to 1000"),
        (lambda: LiveCamera("0", "left", fourcc="MJPEG"), "must be four letters"),
    ],
)
def test_settings_no_camera_can_have_are_refused(make: Callable[[], LiveCamera], told: str) -> None:
    with pytest.raises(OperatorError, match=told):
        make()

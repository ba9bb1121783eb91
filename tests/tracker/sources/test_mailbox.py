"""The newest frame of each camera, handed from thread to thread."""

from __future__ import annotations

import threading

import numpy as np

from tracker.sources.mailbox import Mailbox
from tracker.types import Frame, Reason, Rejected

IMAGE = np.zeros((2, 2, 3), dtype=np.uint8)


def frame(camera: int, t_ns: int) -> Frame:
    return Frame(camera, t_ns, IMAGE)


def test_frames_come_in_order_of_arrival_the_newest_of_each_camera_only() -> None:
    box = Mailbox(2)
    for put in (frame(0, 1), frame(1, 2), frame(0, 3)):
        box.put(put)
    taken = [box.take(0.0) for _ in range(2)]
    assert [each.t_ns for each in taken if isinstance(each, Frame)] == [2, 3]
    assert box.take(0.0) is None
    assert box.dropped == (1, 0)


def test_trouble_is_never_replaced_and_comes_before_frames() -> None:
    box = Mailbox(2)
    troubles = [Rejected(Reason.DISCONNECTED, ""), Rejected(Reason.UNDECODABLE, "")]
    box.put(frame(0, 1))
    for trouble in troubles:
        box.put(trouble)
    assert [box.take(0.0), box.take(0.0)] == troubles
    assert isinstance(box.take(0.0), Frame)


def test_a_closed_box_gives_nothing_and_wakes_who_waits() -> None:
    box = Mailbox(1)
    taken: list[object] = []
    reader = threading.Thread(target=lambda: taken.append(box.take(timeout_s=60.0)))
    reader.start()
    box.close()
    reader.join(timeout=30.0)
    assert taken == [None]
    box.put(frame(0, 1))
    assert box.take(0.0) is None

"""The very bytes that go on the wire: whatever makes them quicker must not change one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bridge.dialect import Encoder, Identity
from bridge.pack import MESSAGES, Packer, heartbeat
from bridge.wire import Message
from tests.bridge.estimates import estimate
from tests.bridge.mavlink_by_hand import parse
from tracker.maths import so3
from tracker.types import Estimate, frozen_array

KNOWN = {
    "VISION_POSITION_ESTIMATE": (
        "fd7500000007c5660000d202964900000000519844be6790aa3f000000c044e6f7bd54caf33d2ee1febf23b90639f5423fb8"
        "1cd7bbb6fa5ed236dd1132b740c228b7ad1739396a0b7836f7e58ab68124eb36ebd8de364701a239321b29b716248f3706a8"
        "8737681fdc39b14894b7f26f623868ef0b3adf3b333815c4263a0922b9"
    ),
    "ATT_POS_MOCAP": (
        "fd7800000107c58a0000d202964900000000d5870b3f42138b3c12e8a93dff8855bf519844be6790aa3f000000c023b90639"
        "f5423fb81cd7bbb6fa5ed236dd1132b740c228b7ad1739396a0b7836f7e58ab68124eb36ebd8de364701a239321b29b71624"
        "8f3706a88737681fdc39b14894b7f26f623868ef0b3adf3b333815c4263a3733"
    ),
    "VISION_SPEED_ESTIMATE": (
        "fd3900000207c5670000d202964900000000c8b6b8bd7d97413fcdccccbd8798583aa826a3b8d1eabdb8a826a3b8123e4e3a"
        "0c690138d1eabdb80c690138e694803a09a462"
    ),
    "ODOMETRY": (
        "fde900000307c54b0100d202964900000000519844be6790aa3f000000c0d5870b3f42138b3c12e8a93dff8855bf151523bf"
        "d1cabbbe042c64be0000803e0000003f0000c0bf23b90639f5423fb81cd7bbb6fa5ed236dd1132b740c228b7ad1739396a0b"
        "7836f7e58ab68124eb36ebd8de364701a239321b29b716248f3706a88737681fdc39b14894b7f26f623868ef0b3adf3b3338"
        "15c4263a852a5d3ae6c0adb8aa24b9b80bc84637d9a85ab7a7896eb7c2288d3aa66786b8516f9038d9e09eb86152adb8da74"
        "983a232a00b826fb0c382acc1938e02d903acdafe6b882a8fbb8f609a03a7b690a392829b03a140c0902521d50"
    ),
    "HEARTBEAT": ("fd090000ff07c5000000000000001208000403eae6"),
}


def known_estimate() -> Estimate:
    """Return an estimate in which no number is zero and no two are alike."""
    spread = np.linspace(0.01, 0.12, 12)
    covariance = np.diag(np.linspace(1e-4, 12e-4, 12)) + 1e-2 * np.outer(spread, spread)
    R_BtoW = so3.exp(np.array([0.1, -0.2, 2.5]))
    moving = estimate(1_234_567_890_123, (0.5, -1.25, 2.0), R_BtoW, (0.3, -0.7, 0.1), covariance, 9)
    return replace(moving, w_BinB=frozen_array((0.25, -0.5, 1.5)))


def known_messages() -> dict[str, Message]:
    return {**Packer(30.0).messages(known_estimate(), MESSAGES), "HEARTBEAT": heartbeat(0)}


@pytest.mark.parametrize(("name", "sequence"), [*zip(KNOWN, (0, 1, 2, 3, 255), strict=True)])
def test_a_known_estimate_goes_out_as_known_bytes(name: str, sequence: int) -> None:
    message = known_messages()[name]
    frame = Encoder(Identity(7))(message, sequence)
    assert frame.hex() == KNOWN[name]
    (read,) = parse(frame)
    assert (read.name, read.sequence, read.fields) == (name, sequence, dict(message.fields))


def test_the_bytes_hold_the_twist_that_matrices_give() -> None:
    given = known_estimate()
    (read,) = parse(Encoder(Identity(7))(known_messages()["ODOMETRY"], 3))
    flip, R_WtoB = np.diag([1.0, -1.0, -1.0]), given.R_BtoW.T
    v_B = R_WtoB @ given.v_BinW
    assert [read.fields[name] for name in ("vx", "vy", "vz")] == pytest.approx((flip @ v_B).tolist(), rel=1e-6)
    rates = [read.fields[name] for name in ("rollspeed", "pitchspeed", "yawspeed")]
    assert rates == pytest.approx((flip @ given.w_BinB).tolist(), rel=1e-6)
    J = np.zeros((6, 12))
    J[:3, 3:6], J[:3, 6:9], J[3:, 9:] = flip @ so3.hat(v_B), flip @ R_WtoB, flip
    expected = (J @ given.covariance @ J.T)[np.triu_indices(6)]
    assert read.fields["velocity_covariance"] == pytest.approx(expected.tolist(), rel=1e-6)

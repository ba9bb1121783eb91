"""PX4's parameters for flight on the bridge's poses: config/px4.params holds the same, to be loaded."""

from __future__ import annotations

from bridge.preflight.rules import Rule, exactly, with_bits, within

DELAY = "EKF2_EV_DELAY"
INSTANCES = range(3)
PORT_BAUDS = ("SER_TEL1_BAUD", "SER_TEL2_BAUD", "SER_TEL3_BAUD")


def rules(velocity: bool) -> tuple[Rule, ...]:
    """Return what must be.

    velocity: whether the bridge sends velocity besides the pose; ODOMETRY has it.
    Source: PX4's parameter reference, 1.14 and newer.
    """
    bits, what = (15, "position 1 + 2, velocity 4, yaw 8") if velocity else (11, "position 1 + 2, yaw 8")
    return (
        Rule(("EKF2_EV_CTRL",), bits, with_bits(bits), f"{bits}: {what} from vision"),
        Rule(("EKF2_HGT_REF",), 3, exactly(3), "3: height is vision's", reboot=True),
        Rule(("EKF2_GPS_CTRL",), 0, exactly(0), "0: no GPS indoors"),
        Rule(("EKF2_MAG_TYPE",), 5, exactly(5), "5: no compass; yaw comes from vision", reboot=True),
        Rule(("SYS_HAS_GPS",), 0, exactly(0), "0: it does not wait for a GPS", reboot=True, optional=True),
        Rule(("SYS_HAS_MAG",), 0, exactly(0), "0: it does not wait for a compass", reboot=True, optional=True),
        Rule(("EKF2_EV_QMIN",), 0, within(0, 1), "0: the bridge's quality falls to 1 before it stops", optional=True),
        Rule(("EKF2_EV_NOISE_MD",), 0, exactly(0), "0: noise as the bridge says, parameters its floor", doubt=True),
        Rule(("EKF2_EVP_NOISE",), 0.05, within(0.005, 0.1), "0.05 m: floor of the noise", doubt=True),
        Rule(("EKF2_EVV_NOISE",), 0.05, within(0.005, 0.1), "0.05 m/s: floor of the noise", doubt=True),
        Rule(("EKF2_EVA_NOISE",), 0.05, within(0.005, 0.1), "0.05 rad: floor of the noise", doubt=True),
    )  # fmt: skip


def port_names() -> tuple[str, ...]:
    """Return the parameters of its serial ports."""
    return (*(f"MAV_{instance}_CONFIG" for instance in INSTANCES), *PORT_BAUDS)

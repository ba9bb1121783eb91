"""ArduPilot's parameters for flight on the bridge's poses: config/ardupilot-heli.parm holds the same, to be loaded."""

from __future__ import annotations

from bridge.preflight.rules import Rule, exactly, within

VISION, NOTHING = 6, 0
"""Values of EK3_SRC1_*: external navigation, none."""

DELAY = "VISO_DELAY_MS"
GYRO_FILTER = "INS_GYRO_FILTER"
PORTS = range(8)


def rules(velocity: bool) -> tuple[Rule, ...]:
    """Return what must be.

    velocity: whether the bridge sends velocity besides the pose.
    Source: flown in ArduPilot's SITL unless it is in its documentation; ../shared/mavlink-facts.md has the figures.
    """
    speed = VISION if velocity else NOTHING
    why = "velocity is sent" if velocity else "no velocity is sent"
    return (
        Rule(("AHRS_EKF_TYPE",), 3, exactly(3), "3: EKF3 is the filter that takes poses"),
        Rule(("EK3_ENABLE",), 1, exactly(1), "1: EKF3 runs", reboot=True),
        Rule(("VISO_TYPE",), 1, exactly(1), "1: poses come by MAVLink", reboot=True),
        Rule(("EK3_SRC1_POSXY",), VISION, exactly(VISION), "6: position from vision"),
        Rule(("EK3_SRC1_VELXY",), speed, exactly(speed), f"{speed}: {why}; 3 waits for a GPS"),
        Rule(("EK3_SRC1_POSZ",), VISION, exactly(VISION), "6: height from vision; barometers wander"),
        Rule(("EK3_SRC1_VELZ",), speed, exactly(speed), f"{speed}: {why}; 3 waits for a GPS"),
        Rule(("EK3_SRC1_YAW",), VISION, exactly(VISION), "6: yaw from vision; compasses err indoors"),
        Rule(("GPS1_TYPE", "GPS_TYPE"), 0, exactly(0), "0: no GPS; with one it never arms indoors", reboot=True),
        Rule(("COMPASS_ENABLE",), 0, exactly(0), "0: yaw comes from vision alone", reboot=True),
        Rule(("VISO_ORIENT",), 0, exactly(0), "0: the bridge turns the poses itself", optional=True),
        Rule(("VISO_SCALE",), 1, exactly(1), "1: the bridge's metres are metres", optional=True),
        Rule(("VISO_QUAL_MIN",), 0, within(-1, 0), "0: only ODOMETRY has a quality", optional=True),
        Rule(("VISO_POS_M_NSE",), 0.1, within(0.01, 0.15), "0.1 m: floor of the noise; 0.2 is lazy", doubt=True),
        Rule(("VISO_VEL_M_NSE",), 0.1, within(0.01, 0.15), "0.1 m/s: floor of the noise", doubt=True),
        Rule(("VISO_YAW_M_NSE",), 0.1, within(0.01, 0.15), "0.1 rad: floor of the noise", doubt=True),
        Rule(
            ("EK3_OGN_HGT_MASK",), 4, exactly(4), "4: else z is off by the barometer, 80 mm",
            doubt=True, optional=True,
        ),
        Rule(("FS_EKF_ACTION",), 1, within(1, 3), "1: it lands when its filter fails"),
    )  # fmt: skip


def port_names() -> tuple[str, ...]:
    """Return the parameters of its serial ports."""
    return tuple(f"SERIAL{port}_{what}" for port in PORTS for what in ("PROTOCOL", "BAUD"))


def gyro_lag_s(cutoff_hz: float) -> float:
    """Return by how much the gyro that it reports lags behind the vehicle [s].

    Derivation: INS_GYRO_FILTER is a second-order Butterworth low-pass; its phase falls by sqrt(2) f / fc at low
        frequencies f, so everything slower comes sqrt(2) / (2 pi fc) late.
    """
    return 2.0**0.5 / (2.0 * 3.141592653589793 * cutoff_hz) if cutoff_hz > 0.0 else 0.0

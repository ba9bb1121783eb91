"""ArduPilot's parameters for the simulated flight: a helicopter on vision alone, a line a reason."""

from __future__ import annotations

from collections.abc import Mapping

from tools.sitl.airframe import COLLECTIVE_DEG, COLLECTIVE_PWM

VISION: Mapping[str, float] = {
    "GPS1_TYPE": 0,  # indoors; with one configured it never arms ("GPS 1: Bad fix")
    "SIM_GPS1_TYPE": 0,  # nor has the simulator one
    "SIM_GPS1_ENABLE": 0,
    "COMPASS_ENABLE": 0,  # the heading comes from vision
    "AHRS_EKF_TYPE": 3,
    "EK3_ENABLE": 1,
    "EK3_SRC1_POSXY": 6,
    "EK3_SRC1_VELXY": 6,  # velocity is sent: 8 times less error, and only then can the failsafe act
    "EK3_SRC1_POSZ": 6,
    "EK3_SRC1_VELZ": 6,
    "EK3_SRC1_YAW": 6,
    "EK3_OGN_HGT_MASK": 4,  # else LOCAL_POSITION_NED's z is off by the barometer's noise at the origin's setting
    "VISO_TYPE": 1,
    "VISO_POS_M_NSE": 0.1,
    "VISO_VEL_M_NSE": 0.1,
    "VISO_YAW_M_NSE": 0.1,
    "WP_YAW_BEHAVIOR": 0,  # the nose stays where the target says
    "FS_EKF_ACTION": 1,  # land
    "SERIAL1_BAUD": 1500,  # SITL takes the wire's time at this rate off every stamp, though UDP needs none
    "LOG_DISARMED": 0,
    "RTL_ALT": 0,
}
_SWASH: Mapping[str, float] = {
    "FRAME_CLASS": 6,
    "H_COL_MIN": COLLECTIVE_PWM[0],
    "H_COL_MAX": COLLECTIVE_PWM[1],
    "H_COL_ANG_MIN": COLLECTIVE_DEG[0],
    "H_COL_ANG_MAX": COLLECTIVE_DEG[1],
    "H_RSC_MODE": 2,  # rotor speed by setpoint, switched by channel 8
    "H_RSC_SETPOINT": 66,
    "ATC_HOVR_ROL_TRM": 0,  # no tail rotor pushes it aside
}
_RATES: Mapping[str, float] = {
    "ATC_ANG_RLL_P": 6,
    "ATC_ANG_PIT_P": 6,
    "ATC_ANG_YAW_P": 4,
    "ATC_RAT_RLL_FF": 0.2,  # full swash turns it at 5 rad/s
    "ATC_RAT_PIT_FF": 0.2,
    "ATC_RAT_RLL_P": 0.06,
    "ATC_RAT_PIT_P": 0.06,
    "ATC_RAT_RLL_I": 0.1,
    "ATC_RAT_PIT_I": 0.1,
    "ATC_RAT_RLL_ILMI": 0.1,
    "ATC_RAT_PIT_ILMI": 0.1,
    "ATC_RAT_RLL_D": 0,
    "ATC_RAT_PIT_D": 0,
    "ATC_RAT_YAW_P": 0.2,
    "ATC_RAT_YAW_I": 0.05,
    "ATC_RAT_YAW_D": 0,
    "ATC_RAT_YAW_FF": 0,
}
_RADIO: Mapping[str, float] = {
    f"RC{channel}_{what}": value
    for channel in range(1, 9)
    for what, value in (("MIN", 1000), ("MAX", 2000), ("TRIM", 1500))
}
_SERVOS: Mapping[str, float] = {"SERVO8_MIN": 1000, "SERVO8_MAX": 2000}
HELICOPTER: Mapping[str, float] = {**_SWASH, **_RATES, **_RADIO, **_SERVOS}


def parameters(delay_ms: int) -> dict[str, float]:
    """Return what the flight wants. delay_ms: least time from mid-exposure to arrival, VISO_DELAY_MS."""
    return {**HELICOPTER, **VISION, "VISO_DELAY_MS": delay_ms}


def parameter_file(delay_ms: int, extra: Mapping[str, float]) -> str:
    """Return the text of a defaults file; `extra` outweighs what the flight wants."""
    values = {**parameters(delay_ms), **extra}
    return "".join(f"{name} {value:g}\n" for name, value in values.items())

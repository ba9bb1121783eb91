"""An autopilot's STATUSTEXT in plain words: what it means, why it comes, what to do."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum


class Weight(StrEnum):
    """What a text means for flying."""

    BLOCKS = "blocks"  # it will not arm, or must not fly
    DOUBT = "doubt"  # it flies, and something is not as it should be
    GOOD = "good"  # a step on the way to flying


@dataclass(frozen=True, slots=True)
class Meaning:
    """A text's meaning, its likely cause and the remedy; the last two may be empty."""

    weight: Weight
    meaning: str
    cause: str = ""
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class _Entry:
    pattern: re.Pattern[str]
    meaning: Meaning


def explain(text: str) -> Meaning | None:
    """Return what a STATUSTEXT means, None for one that says nothing about position or is not known."""
    return next((entry.meaning for entry in _TABLE if entry.pattern.search(text)), None)


def _blocks(pattern: str, meaning: str, cause: str, remedy: str) -> _Entry:
    return _Entry(re.compile(pattern, re.IGNORECASE), Meaning(Weight.BLOCKS, meaning, cause, remedy))


def _doubt(pattern: str, meaning: str, cause: str, remedy: str) -> _Entry:
    return _Entry(re.compile(pattern, re.IGNORECASE), Meaning(Weight.DOUBT, meaning, cause, remedy))


def _good(pattern: str, meaning: str) -> _Entry:
    return _Entry(re.compile(pattern, re.IGNORECASE), Meaning(Weight.GOOD, meaning))


# ArduPilot's texts as its source has them (AP_Arming, AP_Arming_Copter, AP_NavEKF3, AP_NavEKF_Source, ekf_check,
# AP_VisualOdom); PX4's from its EstimatorChecks. Causes: measured with ArduPilot's simulator where that was possible.
# The first that matches counts.
_TABLE: tuple[_Entry, ...] = (
    _blocks(
        r"VisOdom: not healthy",
        "it gets no poses",
        "nothing of the bridge has come for 300 ms, VISO_TYPE is 0 since boot, or the messages are of no kind it takes",
        "look at the rates on this page; set VISO_TYPE 1 and reboot; check SERIALn_PROTOCOL 2 and the baud",
    ),
    _blocks(
        r"EK3 sources require GPS",
        "its filter is told to use GPS, and there is none",
        "EK3_SRC1_VELXY or VELZ stands at its default, 3",
        "set EK3_SRC1_VELXY and VELZ to 6 if velocity is sent, else 0 (--apply does)",
    ),
    _blocks(
        r"EK3 sources require VisualOdom",
        "its filter is told to use vision, and vision is off",
        "VISO_TYPE is 0",
        "set VISO_TYPE 1 and reboot (--apply does)",
    ),
    _blocks(
        r"EK3 sources require (\w+)",
        "its filter is told to use a sensor that is not there",
        "an EK3_SRC1_ parameter names another source than vision",
        "set EK3_SRC1_POSXY, POSZ and YAW to 6 (--apply does)",
    ),
    _blocks(
        r"Check EK3_SRC\d_",
        "a source of its filter has a value it does not know",
        "an EK3_SRC parameter is mistyped",
        "set it to 6 (vision) or 0 (none)",
    ),
    _blocks(
        r"EK3_MAG_CAL and EK3_SRC1_YAW inconsistent",
        "compass calibration in flight and yaw from vision exclude each other",
        "EK3_MAG_CAL is 5 or 6",
        "set EK3_MAG_CAL 3",
    ),
    _blocks(
        r"waiting for home",
        "it does not know where on Earth it is",
        "no EKF origin: without GPS someone must send one",
        "set [mavlink] origin_latitude_deg and origin_longitude_deg, or set it on the ground station's map",
    ),
    _blocks(
        r"origin already set",
        "an origin was refused, for it has one",
        "two programs send an origin, or it was sent too early and is lost: then only a reboot helps",
        "if GLOBAL_POSITION_INT stays at 0, reboot the autopilot and send the origin once its EKF is ready",
    ),
    _blocks(
        r"GPS \d+: (Bad fix|not healthy|was not found)|GPS fix too low|Estimator not using GPS",
        "it waits for a GPS that this room will never give",
        "GPS1_TYPE (older: GPS_TYPE) is not 0; PX4: SYS_HAS_GPS is 1",
        "set GPS1_TYPE 0, PX4 SYS_HAS_GPS 0 and EKF2_GPS_CTRL 0, and reboot",
    ),
    _blocks(
        r"Need Position Estimate|need position estimate",
        "its filter has no position yet",
        "poses have not come long enough, they are rejected, or there is no origin",
        "wait ten seconds with poses; then look at origin and fusion on this page",
    ),
    _blocks(
        r"Need Alt Estimate",
        "its filter has no height yet",
        "EK3_SRC1_POSZ names a sensor that is silent",
        "set EK3_SRC1_POSZ 6 (--apply does)",
    ),
    _blocks(
        r"EKF variance|EKF Failsafe(?! Cleared)|EKF \w+ variance",
        "what vision says and what its gyro and accelerometer say contradict each other",
        "a wrong delay, a wrong yaw, a jump, or ten seconds without poses",
        "do not fly: run the frame check and the wiggle, then look at innovations here",
    ),
    _blocks(
        r"stopped aiding",
        "its filter has lost the position and only keeps the vehicle level",
        "poses stopped, or were rejected for long",
        "look at worst gap and fusion on this page",
    ),
    _blocks(
        r"Yaw inconsistent|EKF attitude is bad|AHRS: Not healthy|AHRS not healthy",
        "its estimators disagree about attitude or yaw",
        "the compass against vision's yaw, or gyros that have not settled",
        "set COMPASS_ENABLE 0, keep it still after power-on; then run the frame check",
    ),
    _blocks(
        r"Compass \d* ?not healthy|Compass not calibrated|Check mag field|Compasses inconsistent"
        r"|Compass Sensor \d missing|magnetic interference",
        "it insists on a compass",
        "indoors a compass is wrong; yaw comes from vision",
        "set COMPASS_ENABLE 0 and reboot; PX4: EKF2_MAG_TYPE 5, SYS_HAS_MAG 0",
    ),
    _blocks(
        r"(Accels|Gyros) inconsistent",
        "its inertial sensors disagree",
        "they need about 25 s after power-on to settle, or were moved meanwhile",
        "keep it still and wait; if it stays, calibrate the accelerometer",
    ),
    _blocks(
        r"ekf2 missing data|Waiting for estimator",
        "its filter has not started",
        "it has just booted, or no source of position is enabled",
        "wait 20 s; then look at EKF2_EV_CTRL and EKF2_HGT_REF here",
    ),
    _blocks(
        r"heading estimate not stable|Yaw estimate error",
        "yaw from vision and its gyro or compass disagree",
        "EKF2_EV_CTRL lacks bit 3, a compass is still used, or the delay is wrong",
        "set EKF2_EV_CTRL 15, EKF2_MAG_TYPE 5; run the frame check",
    ),
    _blocks(
        r"(horizontal|vertical) velocity (estimate not stable|unstable)|velocity estimate error|position estimate error"
        r"|height estimate (not stable|error)",
        "poses and its inertial sensors disagree",
        "a wrong EKF2_EV_DELAY or yaw, late messages, or a vehicle that is being moved",
        "keep it still; run the wiggle and the frame check",
    ),
    _doubt(
        r"lane switch|EKF primary changed",
        "it has changed to another of its filters",
        "poses with jumps or outliers: in flight this comes before worse",
        "look at resets and rejections in the bridge's log",
    ),
    _doubt(
        r"yaw fallback|emergency yaw reset|ground mag anomaly|yaw re-aligned",
        "it has changed its yaw by itself",
        "its yaw source is not vision, or vision was silent",
        "set EK3_SRC1_YAW 6, COMPASS_ENABLE 0 (--apply does)",
    ),
    _doubt(
        r"EKF3 IMU\d forced reset",
        "its filter has started anew",
        "numbers that made no sense: a jump, or a covariance of zero",
        "look at the bridge's log at this time",
    ),
    _good(r"is using external nav data", "its filter uses the bridge's poses"),
    _good(r"fusing odometry", "its filter uses the bridge's odometry"),
    _good(r"yaw aligned|yaw external", "its filter has a yaw"),
    _good(r"tilt alignment complete", "its filter knows which way is down"),
    _good(r"origin set", "its filter has an origin"),
    _good(r"EKF3 IMU\d initialised|EKF3 active", "its filter has started"),
    _good(r"EKF Failsafe Cleared", "the failsafe is over"),
)

"""Mistakes that a sender of poses can make, each done to true poses, without cameras and tracker."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bridge.wire import FieldValue, Message
from tracker.maths import so3
from tracker.types import Estimate, frozen_array

SENT = ("VISION_POSITION_ESTIMATE", "VISION_SPEED_ESTIMATE")
"""What the profile for ArduPilot sends."""

AGE_MS = 30
_STEP_BACK_NS = 10_000_000_000
_POSITION_VARIANCES = (0, 6, 11)


@dataclass(frozen=True, slots=True)
class Shot:
    """One pose on its way. estimate: the truth.  first: what it was when the mistake began.  luck: drawn from 0..1."""

    estimate: Estimate
    first: Estimate
    luck: float


Told = Callable[[Shot], Estimate | None]
Edit = Callable[[Message], Message]


def _truth(shot: Shot) -> Estimate | None:
    return shot.estimate


def _nothing(_shot: Shot) -> Estimate | None:
    return None


def _untouched(message: Message) -> Message:
    return message


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake.

    lasts_s: how long it is made in flight; None: from the autopilot's start to the end.
    told: what is sent of a pose, None for nothing.  edit: what becomes of each message.
    messages: what is sent of each pose.  age_ms: how old poses are when sent, where `VISO_DELAY_MS` is `AGE_MS`.
    """

    name: str
    lasts_s: float | None
    told: Told = _truth
    edit: Edit = _untouched
    messages: tuple[str, ...] = SENT
    age_ms: int = AGE_MS


def _aside(forward_m: float, counts: int = 0) -> Told:
    shift = np.array([forward_m, 0.0, 0.0])

    def told(shot: Shot) -> Estimate:
        truth = shot.estimate
        return replace(truth, p_BinW=frozen_array(truth.p_BinW + shift), reset_counter=truth.reset_counter + counts)

    return told


def _outliers(share: float, size_m: float) -> Told:
    wrong = _aside(size_m)
    return lambda shot: wrong(shot) if shot.luck < share else shot.estimate


def _stale(shot: Shot) -> Estimate:
    """Repeat the pose with which it began, standing still, under fresh stamps."""
    return replace(shot.first, t_ns=shot.estimate.t_ns)


def _turned(angle_deg: float) -> Told:
    turn = so3.exp(np.array([0.0, 0.0, math.radians(angle_deg)]))
    return lambda shot: replace(shot.estimate, R_BtoW=frozen_array(shot.estimate.R_BtoW @ turn))


def _earlier(by_ns: int) -> Told:
    return lambda shot: replace(shot.estimate, t_ns=shot.estimate.t_ns - by_ns)


def _counted_once(shot: Shot) -> Estimate:
    return replace(shot.estimate, reset_counter=1)


def _without_stamp(message: Message) -> Message:
    return _with(message, usec=0)


def _variances(*values: float) -> Edit:
    """Return what sets the variances of x, y and z; what holds none of them stays."""

    def edit(message: Message) -> Message:
        covariance = message.fields.get("covariance")
        if message.name != SENT[0] or not isinstance(covariance, list):
            return message
        told = [float(each) for each in covariance]
        for place, value in zip(_POSITION_VARIANCES, values, strict=True):
            told[place] = value
        return _with(message, covariance=told)

    return edit


def _with(message: Message, **fields: FieldValue) -> Message:
    changed: Mapping[str, FieldValue] = {**message.fields, **fields}
    return message._replace(fields=changed)


_NAN = math.nan
MISTAKES = (
    Mistake("none", 5.0),
    Mistake("silence of 0.5 s", 0.5, _nothing),
    Mistake("silence of 2 s", 2.0, _nothing),
    Mistake("silence of 10 s", 10.0, _nothing),
    Mistake("the last pose repeated for 3 s, stamps fresh", 3.0, _stale),
    Mistake("one pose in twenty 5 m off, 10 s", 10.0, _outliers(0.05, 5.0)),
    Mistake("3 m jump for 5 s, told by reset_counter", 5.0, _aside(3.0, counts=1)),
    Mistake("3 m jump for 5 s, not told", 5.0, _aside(3.0)),
    Mistake("two pose messages, reset_counter 1 in one, 5 s", 5.0, _counted_once, messages=(*SENT, "ATT_POS_MOCAP")),
    Mistake("variance of x not a number, 5 s", 5.0, edit=_variances(_NAN, 1e-6, 1e-6)),
    Mistake("variance of y alone not a number, 5 s", 5.0, edit=_variances(1e-6, _NAN, 1e-6)),
    Mistake("stamps go back by 10 s, for 5 s", 5.0, _earlier(_STEP_BACK_NS)),
    Mistake("stamps zero, 5 s", 5.0, edit=_without_stamp),
    Mistake("poses 200 ms older than VISO_DELAY_MS", None, age_ms=AGE_MS + 200),
    Mistake("poses 400 ms older than VISO_DELAY_MS", None, age_ms=AGE_MS + 400),
    Mistake("yaw 20 deg off", None, _turned(20.0)),
    Mistake("yaw 90 deg off", None, _turned(90.0)),
)

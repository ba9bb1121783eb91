"""What is wrong with a run, in words: cause and remedy."""

from bridge.alarms.readings import BallReading, CameraReading, Limits, Readings
from bridge.alarms.rule import Level
from bridge.alarms.rules import RULES
from bridge.alarms.watch import Alarm, Standing, advance, standing_alarms

__all__ = [
    "RULES",
    "Alarm",
    "BallReading",
    "CameraReading",
    "Level",
    "Limits",
    "Readings",
    "Standing",
    "advance",
    "standing_alarms",
]

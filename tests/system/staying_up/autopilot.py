"""An ArduPilot as far as its talk goes, at the far end of any link: it beats, tells the time, has an origin, obeys."""

from __future__ import annotations

import select
from collections.abc import Mapping
from time import monotonic_ns

from bridge.dialect import Encoder, Identity, Reader, enum, make_message, message_id
from bridge.wire import FieldValue, Message, Received
from tests.contracts.far_ends import FarEnd

BEAT_NS = 200_000_000
ORIGIN: Mapping[str, FieldValue] = {"latitude": 321_000_000, "longitude": 348_000_000, "altitude": 30_000}


class StandIn:
    """One autopilot. heard, bytes_came: all that came in since its start.  calls: whether it speaks first."""

    def __init__(self, end: FarEnd, system_id: int = 1, *, calls: bool = False) -> None:
        self._end = end
        self._calls = calls
        self._encode = Encoder(Identity(system_id, 1))
        self._sequence = 0
        self._beat_ns, self._beat_every_ns = 0, BEAT_NS
        self.heard: list[Received] = []
        self.bytes_came = bytearray()
        self.boot()

    def boot(self) -> None:
        """Start anew: the clock from zero, no origin, nothing heard."""
        self.heard.clear()
        self.bytes_came.clear()
        self._reader = Reader()
        self._booted_ns = monotonic_ns() - 5_000_000_000
        self._has_origin = False

    def now_ns(self) -> int:
        """Return the time since its start [ns]."""
        return monotonic_ns() - self._booted_ns

    def turn(self) -> None:
        """Take in and answer what has come; beat when it is time."""
        while select.select([self._end.fileno()], [], [], 0.0)[0]:
            data = self._end.take()
            if not data:  # the line has not carried more yet
                break
            self.bytes_came += data
            for message in self._reader.feed(data, monotonic_ns()):
                self.heard.append(message)
                for reply in self._replies(message):
                    self.say(reply)
        if (self.heard or self._calls) and monotonic_ns() - self._beat_ns > self._beat_every_ns:
            self._beat_ns = monotonic_ns()
            self.say(make_message("HEARTBEAT", 0, type=enum("MAV_TYPE_HELICOPTER"), autopilot=3))

    def tell_lies(self) -> None:
        """Name another origin, and beat at every turn."""
        self._has_origin, self._beat_every_ns = True, 0

    def say(self, message: Message) -> None:
        """Send a message."""
        self._end.write(self._encode(message, self._sequence))
        self._sequence = (self._sequence + 1) % 256

    def poses(self) -> list[int]:
        """Return the stamps of the poses that came [us]."""
        return [each.whole("usec") for each in self.heard if each.message == "VISION_POSITION_ESTIMATE"]

    def texts(self) -> list[str]:
        """Return the STATUSTEXTs that came."""
        return [str(each.fields["text"]) for each in self.heard if each.message == "STATUSTEXT"]

    def told_origins(self) -> int:
        """Return how often an origin was told."""
        return sum(each.message == "COMMAND_INT" for each in self.heard)

    def _replies(self, message: Received) -> list[Message]:
        if message.message == "TIMESYNC" and message.whole("tc1") == 0:
            return [make_message("TIMESYNC", 0, tc1=self.now_ns(), ts1=message.whole("ts1"))]
        if message.message == "COMMAND_INT":
            self._has_origin = True
        elif message.message != "COMMAND_LONG":
            return []
        ack = make_message("COMMAND_ACK", 0, command=message.whole("command"), result=0)
        if message.whole("command") == enum("MAV_CMD_REQUEST_MESSAGE"):
            return [ack, *self._told(round(message.number("param1")))]
        return [ack]

    def _told(self, number: int) -> list[Message]:
        if number == message_id("EKF_STATUS_REPORT"):
            return [make_message("EKF_STATUS_REPORT", 0, flags=831)]
        if not self._has_origin:
            return []
        if number == message_id("GLOBAL_POSITION_INT"):
            return [make_message("GLOBAL_POSITION_INT", 0, lat=ORIGIN["latitude"], lon=ORIGIN["longitude"])]
        return [make_message("GPS_GLOBAL_ORIGIN", 0, **ORIGIN)]

"""Reading and writing an autopilot's parameters: a client that only says what is due."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType

from bridge.preflight.encoding import field_of, same, value_of
from bridge.wire import FieldValue, Message, Received
from tracker.errors import OperatorError

RETRY_NS = 600_000_000  # a radio's round trip is below 0.3 s
TRIES = 4
OUTSTANDING = 8  # autopilots answer a few a loop; more would only wait in their queue
NAME_LENGTH = 16


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter as the autopilot holds it. kind: MAV_PARAM_TYPE."""

    name: str
    value: float
    kind: int


class _Stage(Enum):
    """How far a parameter's talk has come."""

    READING = auto()
    SETTING = auto()
    READING_BACK = auto()


@dataclass(slots=True)
class _Talk:
    """One parameter talked about. asked_ns: when it was asked last, None for not yet."""

    stage: _Stage
    target: float = 0.0
    asked_ns: int | None = None
    tries: int = 0


class ParameterClient:
    """Ask for parameters by name and write them, one small message at a time.

    A write is only believed once the autopilot, asked anew, says the new value.

    Args:
        system_id, component_id: the autopilot's.
        bytewise: PX4's encoding of integers, else ArduPilot's.
    """

    def __init__(self, system_id: int, component_id: int, bytewise: bool) -> None:
        self._target = {"target_system": system_id, "target_component": component_id}
        self._bytewise = bytewise
        self._talks: dict[str, _Talk] = {}
        self._known: dict[str, Parameter] = {}
        self._absent: list[str] = []
        self._refused: list[str] = []
        self._written: list[str] = []

    @property
    def known(self) -> Mapping[str, Parameter]:
        """What the autopilot said, by name."""
        return MappingProxyType(self._known)

    @property
    def absent(self) -> tuple[str, ...]:
        """Names the autopilot never answered to: its firmware lacks them, or the link is too poor."""
        return tuple(self._absent)

    @property
    def written(self) -> tuple[str, ...]:
        """Names written and read back right."""
        return tuple(self._written)

    @property
    def refused(self) -> tuple[str, ...]:
        """Names written in vain: read back, they hold another value, or nobody answers."""
        return tuple(self._refused)

    @property
    def busy(self) -> bool:
        """Something is still asked for."""
        return bool(self._talks)

    def read(self, names: Iterable[str]) -> None:
        """Ask for these parameters, known ones anew."""
        for name in names:
            if len(name.encode()) > NAME_LENGTH:
                raise OperatorError(f"parameter {name}: longer than {NAME_LENGTH} characters; no autopilot has such")
            self._talks.setdefault(name, _Talk(_Stage.READING))

    def write(self, name: str, value: float) -> None:
        """Set a parameter, then read it back.

        Raises:
            OperatorError: one that was not read before (its type must be known), or a value its type cannot hold.
        """
        if name not in self._known:
            raise OperatorError(f"parameter {name}: the autopilot has not told it; read it before writing it")
        field_of(value, self._known[name].kind, self._bytewise)
        self._talks[name] = _Talk(_Stage.SETTING, value)

    def due(self, now_ns: int) -> Message | None:
        """Return the message to send now, None for nothing; links may drop more than one of a name at a time.

        now_ns: monotonic time [ns].
        """
        for name, talk in tuple(self._talks.items())[:OUTSTANDING]:
            if talk.asked_ns is not None and now_ns - talk.asked_ns < RETRY_NS:
                continue
            if talk.tries == (TRIES if talk.stage is _Stage.READING else 2 * TRIES):  # a write is two questions
                self._give_up(name, talk)
                continue
            talk.asked_ns = now_ns
            talk.tries += 1
            return self._set(name, talk.target, now_ns) if talk.stage is _Stage.SETTING else self._ask(name, now_ns)
        return None

    def take(self, received: Received) -> None:
        """Take a message from the autopilot; any but PARAM_VALUE passes."""
        if received.message != "PARAM_VALUE":
            return
        name = str(received.fields["param_id"])
        kind = int(str(received.fields["param_type"]))
        self._known[name] = Parameter(name, value_of(received, self._bytewise), kind)
        if name in self._absent:
            self._absent.remove(name)
        if name in self._talks:
            self._go_on(name, self._talks[name])

    def _go_on(self, name: str, talk: _Talk) -> None:
        """Take the next step after an answer."""
        if talk.stage is _Stage.READING:
            del self._talks[name]
        elif talk.stage is _Stage.SETTING and talk.asked_ns is not None:
            talk.stage, talk.asked_ns = _Stage.READING_BACK, None
        elif talk.stage is _Stage.READING_BACK and talk.asked_ns is not None:
            if same(self._known[name].value, talk.target):
                del self._talks[name]
                self._written.append(name)
            else:
                talk.stage, talk.asked_ns = _Stage.SETTING, None

    def _give_up(self, name: str, talk: _Talk) -> None:
        del self._talks[name]
        (self._absent if talk.stage is _Stage.READING else self._refused).append(name)

    def _ask(self, name: str, now_ns: int) -> Message:
        return Message("PARAM_REQUEST_READ", now_ns, 0, {**self._target, "param_id": name, "param_index": -1})

    def _set(self, name: str, value: float, now_ns: int) -> Message:
        kind = self._known[name].kind
        field = field_of(value, kind, self._bytewise)
        fields: dict[str, FieldValue] = {**self._target, "param_id": name, "param_value": field, "param_type": kind}
        return Message("PARAM_SET", now_ns, 0, fields)

"""The text that names a source: KIND:ARGUMENT."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from tracker.errors import OperatorError


class SourceKind(StrEnum):
    """What can give frames."""

    RECORDING = "recording"
    VIDEO = "video"
    CAMERA = "camera"
    SIM = "sim"
    LOG = "log"


EXAMPLES = {
    SourceKind.RECORDING: "recording:DIR",
    SourceKind.VIDEO: "video:LEFT.mp4,RIGHT.mp4",
    SourceKind.CAMERA: "camera:0,1",
    SourceKind.SIM: "sim:NAME",
    SourceKind.LOG: "log:FILE.mcap",
}
_NEEDS_ARGUMENT = frozenset({SourceKind.RECORDING, SourceKind.VIDEO, SourceKind.LOG})


@dataclass(frozen=True, slots=True)
class SourceUri:
    """A source as the operator named it. argument: what follows the first colon, "" if nothing does."""

    kind: SourceKind
    argument: str

    @property
    def items(self) -> tuple[str, ...]:
        """Split the argument at commas, or at semicolons if it holds any (a GStreamer pipeline has commas)."""
        separator = ";" if ";" in self.argument else ","
        return tuple(item.strip() for item in self.argument.split(separator) if item.strip())

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the files that the frames come out of; a recording is a folder of many."""
        if self.kind is SourceKind.LOG:
            return (Path(self.argument),)
        return tuple(map(Path, self.items)) if self.kind is SourceKind.VIDEO else ()

    def __str__(self) -> str:
        return f"{self.kind}:{self.argument}"


def parse_source(text: str) -> SourceUri:
    """Read a source URI.

    Args:
        text: such as "recording:DIR"; `camera:` and `sim:` may stand without an argument.
    Raises:
        OperatorError: no colon, an unknown kind, or a kind that needs an argument without one.
    """
    known = ", ".join(EXAMPLES.values())
    kind_text, colon, argument = text.strip().partition(":")
    if not colon:
        raise OperatorError(f"source {text!r}: no kind before a colon; write one of {known}")
    if kind_text not in set(SourceKind):
        raise OperatorError(f"source {text!r}: unknown kind {kind_text!r}; write one of {known}")
    kind = SourceKind(kind_text)
    if kind in _NEEDS_ARGUMENT and not argument.strip():
        raise OperatorError(f"source {text!r}: nothing after the colon; write {EXAMPLES[kind]}")
    return SourceUri(kind, argument.strip())

"""MCAP's outermost layer: opcode, length, content, again and again. Source: mcap.dev/spec."""

from __future__ import annotations

import struct
from collections.abc import Container, Iterator
from dataclasses import dataclass
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from bridge.log.losses import Losses

_HEAD = struct.Struct("<BQ")
NO_END = "no end mark, the recorder was killed or still runs and up to 1 s may be missing,"


@dataclass(frozen=True, slots=True)
class Framed:
    """One record of the file: what it is, its content, and where it starts."""

    opcode: int
    content: bytes
    offset: int


def read_frames(stream: BinaryIO, size_bytes: int, wanted: Container[int], losses: Losses) -> Iterator[Framed]:
    """Yield the wanted records of the data section, as far as the file is whole.

    mcap's own readers take short reads for data and lengths at their word; here both are held against the file's size.

    Args:
        stream: the file, read from its beginning.
        size_bytes: its size.
        wanted: opcodes to yield; the content of others is skipped unread.
        losses: takes note of a file that does not end properly.
    """
    offset = len(MCAP0_MAGIC)
    while True:
        stream.seek(offset)
        head = stream.read(_HEAD.size)
        if not head:
            losses.add(NO_END, 0, offset)
            return
        if len(head) < _HEAD.size:
            losses.add("the file ends inside a record", size_bytes - offset, offset)
            return
        opcode, length = _HEAD.unpack(head)
        end = offset + _HEAD.size + length
        if opcode == 0:
            losses.add("not a record", size_bytes - offset, offset)
            return
        if end > size_bytes:
            losses.add(f"the file ends inside a {_name(opcode)}", size_bytes - offset, offset)
            return
        if opcode in (Opcode.DATA_END, Opcode.FOOTER):
            return
        if opcode in wanted:
            content = stream.read(length)
            if len(content) < length:
                losses.add(f"the file ends inside a {_name(opcode)}", len(content), offset)
                return
            yield Framed(opcode, content, offset)
        offset = end


def _name(opcode: int) -> str:
    try:
        return Opcode(opcode).name.lower().replace("_", " ")
    except ValueError:
        return f"record of unknown kind 0x{opcode:02x}"

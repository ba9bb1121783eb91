"""What may come in on a port that was not meant well, or not meant at all: by the hundred thousand, from a seed."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.signing.signature import SIGNED

TEXTS = (
    b"\x00" * 50,
    b"\xff" * 50,
    b"%s%n{0}\x1b[2J",
    "\N{SNOWMAN}".encode() * 16,
    b"\xed\xa0\x80" * 16,
    b"\xc3(" * 25,
)
NUMBERS = (0.0, float("nan"), float("inf"), -float("inf"), 3.4e38, 1e-45)


def frame(number: int, payload: bytes, system_id: int = 1, *, version: int = 2, flags: int = 0) -> bytes:
    """Return a frame with the right checksum, whatever is in it; a flagged one gets a signature of noughts."""
    if version == 1:
        body = bytes((len(payload), 0, system_id, 1, number & 0xFF)) + payload
        marker = b"\xfe"
    else:
        head = struct.pack("<BBBBBBHB", len(payload), flags, 0, 0, system_id, 1, number & 0xFFFF, number >> 16)
        body, marker = head + payload, b"\xfd"
    extra = dialect.mavlink_map[number].crc_extra if number in dialect.mavlink_map else 0
    checksum: int = dialect.x25crc(body + bytes((extra,))).crc
    return marker + body + checksum.to_bytes(2, "little") + (bytes(13) if flags & SIGNED else b"")


def corpus(generator: np.random.Generator) -> list[bytes]:
    """Return frames of every message of the dialect with random contents, and of what hurts by its contents alone."""
    frames: list[bytes] = []
    for number, kind in dialect.mavlink_map.items():
        size = kind.unpacker.size
        payloads = (generator.bytes(size), bytes(size), b"\xff" * size, generator.bytes(size)[: size // 2])
        frames += [frame(number, payload, int(generator.choice((1, 1, 1, 9, 255)))) for payload in payloads]
        frames += [frame(number, generator.bytes(size), version=1)] if number < 256 else []
        frames += [frame(number, generator.bytes(size), flags=SIGNED)]
    frames += [frame(dialect.MAVLINK_MSG_ID_STATUSTEXT, bytes((2,)) + text[:50]) for text in TEXTS]
    frames += [frame(dialect.MAVLINK_MSG_ID_ATTITUDE, struct.pack("<I6f", 1, *[value] * 6)) for value in NUMBERS]
    frames += [
        frame(dialect.MAVLINK_MSG_ID_TIMESYNC, struct.pack("<qq", a, b)) for a in (0, 2**63 - 1) for b in (-1, 1)
    ]
    frames += [frame(0x00FFFFFF, bytes(255)), b"\xfd\xff\x00" * 8, b"\xfe\xff" * 8, b"\xfd" * 300]
    return frames


def chunks(count: int, size: int, seed: int) -> Iterator[bytes]:
    """Yield `count` messages, `size` a chunk: about a third whole, the others bitten or cut, noise in between."""
    generator = np.random.default_rng(seed)
    frames = corpus(generator)
    for _ in range(count // size):
        chosen = [frames[k] for k in generator.integers(0, len(frames), size)]
        data = np.frombuffer(b"".join(chosen), np.uint8).copy()
        _bite(data, size, generator)
        yield b"".join(_cut(data.tobytes(), size // 20, generator))


def _cut(whole: bytes, cuts: int, generator: np.random.Generator) -> Iterator[bytes]:
    """Yield what is left when so many pieces are taken out, in the place of every other one some noise."""
    at = 0
    for k, start in enumerate(np.sort(generator.integers(0, len(whole), cuts)).tolist()):
        yield whole[at:start]
        yield generator.bytes(30) if k % 2 else b""
        at = start + int(generator.integers(1, 60))
    yield whole[at:]


def _bite(data: NDArray[np.uint8], bites: int, generator: np.random.Generator) -> None:
    """Spoil so many bytes, wherever they fall: markers, lengths, checksums, contents."""
    places = generator.integers(0, len(data), bites)
    data[places] ^= generator.integers(1, 256, bites).astype(np.uint8)

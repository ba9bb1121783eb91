"""Read a log: whole, cut short, or damaged."""

from __future__ import annotations

import struct
from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import orjson
import zstandard
from google.protobuf.message import DecodeError
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import breakup_chunk
from mcap.well_known import MessageEncoding
from mcap.writer import MCAP0_MAGIC
from mcap_protobuf.decoder import DecoderFactory

from bridge.log.framing import Framed, read_frames
from bridge.log.losses import Loss, Losses
from tracker.errors import OperatorError

Decoder = Callable[[bytes], Any]
OnOffset = Callable[[int], None]
"""Told how far into the file a walk has come [bytes]."""
_MESSAGES = frozenset({Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK})
# Whatever the libraries raise on bytes that are not what they claim to be; MemoryError for a length that is noise,
# RuntimeError from lz4, TypeError for protobuf descriptors that contradict each other.
_DAMAGE = (McapError, DecodeError, zstandard.ZstdError, struct.error, ValueError, TypeError, MemoryError, RuntimeError)


@dataclass(frozen=True, slots=True)
class Record:
    """One message of the log.

    log_ns: stream time of arrival [ns].  publish_ns: stream time of capture [ns].
    value: a dict of a JSON topic, a message of a protobuf topic, bytes of an encoding not known here.
    """

    topic: str
    log_ns: int
    publish_ns: int
    value: Any


class LogReader:
    """Read an MCAP file front to back, one chunk in memory at a time.

    Raises:
        OperatorError: no such file, nothing in it, or no MCAP.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._losses = Losses()
        with self._opened() as stream:
            magic = stream.read(len(MCAP0_MAGIC))
        if not magic:
            raise OperatorError(f"log {path}: the file is empty; nothing was recorded in it")
        if magic != MCAP0_MAGIC:
            raise OperatorError(f"log {path}: is no MCAP file; name a log that `run --log` wrote")

    @property
    def path(self) -> Path:
        """The file's path, as given."""
        return self._path

    @property
    def lost(self) -> tuple[Loss, ...]:
        """What the last walk through the file could not read; empty for a whole file."""
        return self._losses.all()

    def records(self, topics: Container[str] | None = None, on_offset: OnOffset | None = None) -> Iterator[Record]:
        """Yield the messages of some topics, or of all, in the order they were written."""
        self._losses = losses = Losses()
        decoders = _Decoders(losses)
        for framed in self._frames(_MESSAGES, losses):
            if on_offset is not None:
                on_offset(framed.offset)
            for record in _unpack(framed, losses):
                if isinstance(record, Message):
                    yield from decoders.decode(record, topics, framed.offset)
                elif isinstance(record, Schema | Channel):
                    decoders.learn(record)

    def attachments(self) -> dict[str, bytes]:
        """Return the attached files by name."""
        return {record.name: record.data for record in self._parsed(Opcode.ATTACHMENT, Attachment)}

    def metadata(self) -> dict[str, dict[str, str]]:
        """Return the metadata: names and values by topic."""
        return {record.name: dict(record.metadata) for record in self._parsed(Opcode.METADATA, Metadata)}

    def _parsed(self, opcode: Opcode, kind: Any) -> Iterator[Any]:
        self._losses = losses = Losses()
        for framed in self._frames(frozenset({opcode}), losses):
            yield from _parse(kind, framed, losses)

    def _frames(self, wanted: frozenset[Opcode], losses: Losses) -> Iterator[Framed]:
        with self._opened() as stream:
            try:
                size_bytes = stream.seek(0, 2)
                yield from read_frames(stream, size_bytes, wanted, losses)
            except OSError as error:
                raise OperatorError(f"log {self._path}: cannot be read ({error.strerror}); copy it anew") from error

    def _opened(self) -> BinaryIO:
        try:
            if self._path.exists() and not self._path.is_file():
                raise OperatorError(f"log {self._path}: is no regular file; name a log file")
            return self._path.open("rb")
        except FileNotFoundError:
            raise OperatorError(f"log {self._path}: no such file; check the path") from None
        except OSError as error:
            raise OperatorError(f"log {self._path}: cannot be opened ({error.strerror}); check the path") from error


class _Decoders:
    """Schemas and channels met so far, and how to decode their messages."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._protobuf = DecoderFactory()
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._decoders: dict[int, Decoder] = {}

    def learn(self, record: Schema | Channel) -> None:
        """Take note of a schema or a channel."""
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        else:
            self._channels[record.id] = record

    def decode(self, message: Message, topics: Container[str] | None, offset: int) -> Iterator[Record]:
        """Yield the message's record; none if it is not asked for or cannot be decoded."""
        channel = self._channels.get(message.channel_id)
        if channel is None:
            self._losses.add("messages whose topic's description is lost", len(message.data), offset)
            return
        if topics is not None and channel.topic not in topics:
            return
        try:
            if channel.id not in self._decoders:
                self._decoders[channel.id] = self._decoder(channel)
            value = self._decoders[channel.id](message.data)
        except _DAMAGE:
            self._losses.add(f"messages of {channel.topic} that its schema does not fit", len(message.data), offset)
            return
        yield Record(channel.topic, message.log_time, message.publish_time, value)

    def _decoder(self, channel: Channel) -> Decoder:
        if channel.message_encoding == MessageEncoding.JSON:
            return orjson.loads
        schema = self._schemas.get(channel.schema_id)
        return self._protobuf.decoder_for(channel.message_encoding, schema) or bytes


def _unpack(framed: Framed, losses: Losses) -> Sequence[McapRecord]:
    """Return the schemas, channels and messages in one record of the file."""
    if framed.opcode == Opcode.MESSAGE:
        return _parse(_SizedMessage(len(framed.content)), framed, losses)
    if framed.opcode == Opcode.CHUNK:
        try:
            chunk = Chunk.read(ReadDataStream(BytesIO(framed.content)))
            return breakup_chunk(chunk, validate_crc=True)
        except _DAMAGE:
            losses.add("a damaged chunk", len(framed.content), framed.offset)
            return ()
    return _parse(Schema if framed.opcode == Opcode.SCHEMA else Channel, framed, losses)


class _SizedMessage:
    """Read a message that stands outside of any chunk: mcap wants its length apart."""

    def __init__(self, length: int) -> None:
        self._length = length

    def read(self, stream: ReadDataStream) -> Message:
        message: Message = Message.read(stream, self._length)
        return message


def _parse(kind: Any, framed: Framed, losses: Losses) -> Sequence[Any]:
    try:
        return (kind.read(ReadDataStream(BytesIO(framed.content))),)
    except _DAMAGE:
        losses.add("a damaged record", len(framed.content), framed.offset)
        return ()

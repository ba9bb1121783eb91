"""An MCAP file as it grows: chunks of messages with their index, then the summary. Source: mcap.dev/spec.

Most records are written by mcap's own classes. Messages and chunks are packed here: mcap's writer takes 10 us for each
message, in Python, and a flight's log has nine of them for every pair of frames.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from io import BufferedWriter
from typing import Any

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC

CHUNK_BYTES = 128 * 1024  # a flush ends a chunk earlier, twice a second
COMPRESSION_LEVEL = 1  # as small as 3, the usual one, on these records, in half the time
_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_MESSAGE_FIELDS_BYTES = 22
_CHUNK = struct.Struct("<BQQQQII4sQ")  # opcode, length, times, size, checksum, "zstd" and its length, length
_CHUNK_FIELDS_BYTES = 44
_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, length of the entries
_FOOTER = struct.Struct("<BQQQ")  # as far as the summary's checksum goes


@dataclass(slots=True, eq=False)
class _OpenChunk:
    """Records that wait to be compressed together; offsets by channel: log time and place of each message."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0
    first_ns: int = 2**64 - 1
    last_ns: int = 0
    offsets: dict[int, list[int]] = field(default_factory=dict)

    def add(self, part: bytes) -> None:
        self.parts.append(part)
        self.size += len(part)


class Container:
    """Write an MCAP file to a stream. For one thread.

    Raises:
        OSError: from every method, whatever the stream raises.
    """

    def __init__(self, stream: BufferedWriter) -> None:
        self._stream = stream
        self._compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
        self._chunk = _OpenChunk()
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._sequences = [0]  # of the next message by channel; their numbers begin at 1
        self._counts: Counter[int] = Counter()
        stream.write(MCAP0_MAGIC + _bytes_of(Header("", LIBRARY_IDENTIFIER)))

    def add_channel(
        self, topic: str, message_encoding: str, schema_name: str, schema_encoding: str, data: bytes
    ) -> int:
        """Add a topic with its schema and return its channel's number."""
        schema = Schema(len(self._schemas) + 1, data, schema_encoding, schema_name)
        channel = Channel(len(self._channels) + 1, topic, message_encoding, {}, schema.id)
        self._schemas.append(schema)
        self._channels.append(channel)
        self._sequences.append(0)
        self._chunk.add(_bytes_of(schema) + _bytes_of(channel))
        return channel.id

    def add_message(self, channel: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Append a message [ns]; MCAP knows no time before 0, so the file's own stamps stop there."""
        if log_ns < 0 or publish_ns < 0:
            log_ns, publish_ns = max(log_ns, 0), max(publish_ns, 0)
        chunk, sequence, size = self._chunk, self._sequences[channel], len(data)
        self._sequences[channel] = sequence + 1
        entries = chunk.offsets.get(channel)
        if entries is None:
            entries = chunk.offsets[channel] = []
        entries += log_ns, chunk.size
        head = _MESSAGE.pack(_MESSAGE_OPCODE, _MESSAGE_FIELDS_BYTES + size, channel, sequence, log_ns, publish_ns)
        chunk.parts += head, data
        chunk.size += _MESSAGE.size + size
        if log_ns < chunk.first_ns:
            chunk.first_ns = log_ns
        if log_ns > chunk.last_ns:
            chunk.last_ns = log_ns
        if chunk.size > CHUNK_BYTES:
            self._end_chunk()

    def add_attachment(self, created_ns: int, name: str, media_type: str, data: bytes) -> None:
        """Append a whole file, made at a wall clock's time [ns]."""
        record = _bytes_of(Attachment(created_ns, 0, name, media_type, data))
        place = self._stream.tell()
        self._attachments.append(AttachmentIndex(place, len(record), 0, created_ns, len(data), name, media_type))
        self._stream.write(record)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Append names and values."""
        record = _bytes_of(Metadata(name, dict(values)))
        self._metadata.append(MetadataIndex(self._stream.tell(), len(record), name))
        self._stream.write(record)

    def flush(self) -> None:
        """End the chunk, if there is a message in it, and hand everything to the kernel."""
        self._end_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write index and footer; the stream stays open."""
        self._end_chunk()
        self._stream.write(_bytes_of(DataEnd(0)))
        start = self._stream.tell()
        groups: tuple[tuple[Opcode, Iterable[McapRecord]], ...] = (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        )
        summary, offsets = b"", b""
        for opcode, records in groups:
            group = b"".join(map(_bytes_of, records))
            offsets += _bytes_of(SummaryOffset(opcode, start + len(summary), len(group))) if group else b""
            summary += group
        offset_start = start + len(summary)
        summary += offsets
        checked = summary + _FOOTER.pack(Opcode.FOOTER, 20, start, offset_start)
        self._stream.write(summary + _bytes_of(Footer(start, offset_start, zlib.crc32(checked))) + MCAP0_MAGIC)
        self._stream.flush()

    def _end_chunk(self) -> None:
        """Compress the open chunk and write it with its index, unless no message is in it."""
        chunk = self._chunk
        if not chunk.offsets:
            return
        self._chunk = _OpenChunk()
        plain = b"".join(chunk.parts)
        packed = self._compressor.compress(plain)
        fields = (chunk.first_ns, chunk.last_ns, len(plain), zlib.crc32(plain), 4, b"zstd", len(packed))
        record = _CHUNK.pack(Opcode.CHUNK, _CHUNK_FIELDS_BYTES + len(packed), *fields) + packed
        place = self._stream.tell()
        indices, index_places = b"", {}
        for channel, entries in chunk.offsets.items():
            index_places[channel] = place + len(record) + len(indices)
            size = 8 * len(entries)
            indices += _INDEX.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size)
            indices += struct.pack(f"<{len(entries)}Q", *entries)
            self._counts[channel] += len(entries) // 2
        self._chunks.append(
            ChunkIndex(
                chunk_length=len(record),
                chunk_start_offset=place,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=chunk.last_ns,
                message_index_length=len(indices),
                message_index_offsets=index_places,
                message_start_time=chunk.first_ns,
                uncompressed_size=len(plain),
            )
        )
        self._stream.write(record + indices)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max((each.message_end_time for each in self._chunks), default=0),
            message_start_time=min((each.message_start_time for each in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _bytes_of(record: McapRecord) -> bytes:
    """Return a whole record: opcode, length, content."""
    builder: Any = RecordBuilder()
    record.write(builder)
    written: bytes = builder.end()
    return written

"""Decompression of a recording's chunks, bounded by the largest chunk that gazerig writes."""

import zlib
from io import BytesIO

import zstandard
from mcap.exceptions import McapError
from mcap.records import Chunk

LARGEST_BYTES = 64 << 20
"""Limit of a compressed or decompressed chunk; the writer's chunks have about 1 MB."""


class BadChunk(McapError):
    """A chunk that does not match its header."""


def decompress_chunk(chunk: Chunk) -> bytes:
    """Decompress the records of a chunk.

    Raises:
        BadChunk: The chunk is too large, does not match its header or uses another compression.
        zstandard.ZstdError: The chunk is damaged.
    """
    size = chunk.uncompressed_size
    if size > LARGEST_BYTES:
        raise BadChunk(f"a chunk of {size / 1e6:.0f} MB")
    if chunk.compression == "zstd":
        data = _decompress_zstd(chunk.data, size)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise BadChunk("a chunk compressed by another program")
    if len(data) != size:
        raise BadChunk("a chunk whose size differs from its header")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise BadChunk("a chunk with a wrong checksum")
    return data


def _decompress_zstd(packed: bytes, size: int) -> bytes:
    """Decompress at most one byte more than ``size``: a few bytes can expand to gigabytes."""
    decompressor = zstandard.ZstdDecompressor(max_window_size=LARGEST_BYTES)
    with decompressor.stream_reader(BytesIO(packed), read_across_frames=True) as reader:
        found: bytes = reader.read(size + 1)
    return found

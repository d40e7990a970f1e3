"""Chunks of a recording unpacked, never to more than a chunk of ours can hold."""

import zlib
from io import BytesIO

import zstandard
from mcap.exceptions import McapError
from mcap.records import Chunk

LARGEST_BYTES = 64 << 20
"""Of a packed or an unpacked chunk; the writer ends one at about 1 MB, plus one message."""


class BadChunk(McapError):
    """A chunk is not what it says."""


def unpacked(chunk: Chunk) -> bytes:
    """Return the records of a chunk.

    Raises:
        BadChunk: it is larger than it says or may be, packed in another way, or damaged.
        zstandard.ZstdError: it is damaged.
    """
    size = chunk.uncompressed_size
    if size > LARGEST_BYTES:
        raise BadChunk(f"a chunk of {size / 1e6:.0f} MB")
    if chunk.compression == "zstd":
        data = _from_zstd(chunk.data, size)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise BadChunk("a chunk packed by another program")
    if len(data) != size:
        raise BadChunk("a chunk of another size than it says")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise BadChunk("a chunk with a wrong check sum")
    return data


def _from_zstd(packed: bytes, size: int) -> bytes:
    """Unpack at most one byte more than said: a few bytes can stand for gigabytes."""
    decompressor = zstandard.ZstdDecompressor(max_window_size=LARGEST_BYTES)
    with decompressor.stream_reader(BytesIO(packed), read_across_frames=True) as reader:
        found: bytes = reader.read(size + 1)
    return found

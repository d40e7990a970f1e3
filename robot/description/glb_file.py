"""Binary glTF files: their two parts in one file (glTF 2.0, 4.4)."""

import struct


def join_glb(tree: bytes, binary: bytes) -> bytes:
    """Return a binary file of its two parts.

    Args:
        tree: JSON text.
        binary: Data of its buffer.
    """
    tree += b" " * (-len(tree) % 4)
    binary += b"\0" * (-len(binary) % 4)
    body = struct.pack("<I4s", len(tree), b"JSON") + tree
    body += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body

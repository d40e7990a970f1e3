"""Parts of glTF 2.0 files: JSON tree, binary data, accessors. Only what animations need.

Source: Khronos, glTF 2.0 specification (ISO/IEC 12113:2022), 3.6 binary data, 4.4 GLB layout.
"""

import struct
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET, Raw, Struct, UnsetType

from gazerig.drivers.errors import SetupError
from gazerig.features.animation.animation import decode

_JSON, _BIN = b"JSON", b"BIN\0"
_FLOAT32 = 5126
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Node(Struct):
    """Node of the scene."""

    name: str = ""


class AnimationTarget(Struct):
    """What a channel moves."""

    path: str
    node: int | None = None


class AnimationChannel(Struct):
    """Motion of one property of one node."""

    sampler: int
    target: AnimationTarget


class Sampler(Struct):
    """Accessors of times and values."""

    input: int
    output: int
    interpolation: str = "LINEAR"


class Clip(Struct):
    """An animation of the file."""

    channels: list[AnimationChannel]
    samplers: list[Sampler]
    name: str = ""


class Accessor(Struct, rename="camel"):
    """Numbers in a buffer view."""

    component_type: int
    count: int
    type: str
    buffer_view: int | None = None
    byte_offset: int = 0
    sparse: Raw | UnsetType = UNSET


class BufferView(Struct, rename="camel"):
    """Part of a buffer."""

    byte_offset: int = 0
    byte_stride: int | None = None
    extensions: dict[str, Raw] = {}


class Tree(Struct, rename="camel"):
    """JSON tree of a file."""

    nodes: list[Node] = []
    animations: list[Clip] = []
    accessors: list[Accessor] = []
    buffer_views: list[BufferView] = []


def split_glb(path: Path, data: bytes) -> tuple[bytes, bytes]:
    """Return the JSON and the binary part of a binary file.

    Raises:
        SetupError: it is truncated or of another version.
    """
    truncated = SetupError(f"{path} is truncated: {len(data)} bytes; export it again")
    parts: dict[bytes, bytes] = {}
    at = 12
    try:
        version, length = struct.unpack_from("<II", data, 4)
        if version != 2:
            raise SetupError(f"{path} is glTF {version}: export it as glTF 2.0")
        while at < length:
            size, kind = struct.unpack_from("<I4s", data, at)
            parts.setdefault(kind, data[at + 8 : at + 8 + size])
            at += 8 + size
    except struct.error:
        raise truncated from None
    if at > len(data) or _JSON not in parts:
        raise truncated
    return parts[_JSON], parts.get(_BIN, b"")


class GltfFile:
    """A file with checked structure.

    Args:
        path: path of the file, for messages.
        data: its content.

    Raises:
        SetupError: it is truncated or not glTF 2.0.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self.path = path
        text, self._binary = split_glb(path, data)
        self.tree = decode(path, text, Tree, "glTF")

    def item(self, key: str, index: int) -> Any:
        """Return an item of a list of the tree.

        Raises:
            SetupError: there is no such item.
        """
        items = getattr(self.tree, key)
        if not 0 <= index < len(items):
            raise SetupError(
                f"{self.path}: {key}[{index}] is used, but there are {len(items)}: export it again"
            )
        return items[index]

    def values(self, index: int) -> np.ndarray[Any, Any]:
        """Return the (count, width) numbers of an accessor, single precision in the file.

        Raises:
            SetupError: it is invalid, compressed, or beyond the end of its data.
        """
        accessor: Accessor = self.item("accessors", index)
        where = f"{self.path}: accessors[{index}]"
        width, plain = _WIDTHS.get(accessor.type), accessor.component_type == _FLOAT32
        if accessor.buffer_view is None or accessor.sparse is not UNSET or not (plain and width):
            raise SetupError(f"{where}: sparse or no plain numbers; export without compression")
        view: BufferView = self.item("buffer_views", accessor.buffer_view)
        if any("meshopt" in name for name in view.extensions):
            raise SetupError(f"{where}: compressed by meshopt; export without compression")
        row = 4 * width
        stride = view.byte_stride or row
        first = view.byte_offset + accessor.byte_offset
        end = first + stride * (accessor.count - 1) + row if accessor.count else first
        if min(first, accessor.count) < 0 or stride < row or end > len(self._binary):
            raise SetupError(
                f"{where}: ends at byte {end} of {len(self._binary)}: the file is truncated; export it again"
            )
        raw = np.ndarray((accessor.count, width), "<f4", self._binary, first, (stride, 4))
        return raw.astype(np.float64)

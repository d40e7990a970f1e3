"""Parts of glTF 2.0 files: JSON tree, binary data, accessors. Only what animations need.

Source: Khronos, glTF 2.0 specification (ISO/IEC 12113:2022), 3.6 binary data, 4.4 GLB layout.
"""

import struct
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET, Raw, Struct, UnsetType

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.features.animation.animation import LARGEST, decode

_JSON, _BIN = b"JSON", b"BIN\0"
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Asset(Struct):
    """Version of the format."""

    version: str


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
    normalized: bool = False
    sparse: Raw | UnsetType = UNSET


class BufferView(Struct, rename="camel"):
    """Part of a buffer."""

    buffer: int
    byte_length: int
    byte_offset: int = 0
    byte_stride: int | None = None
    extensions: dict[str, Raw] = {}


class Buffer(Struct):
    """Data in the file, in the text or beside it."""

    uri: str | None = None


class Tree(Struct, rename="camel"):
    """JSON tree of a file."""

    asset: Asset
    nodes: list[Node] = []
    animations: list[Clip] = []
    accessors: list[Accessor] = []
    buffer_views: list[BufferView] = []
    buffers: list[Buffer] = []


def split_glb(path: Path, data: bytes) -> tuple[bytes, bytes]:
    """Return the JSON and the binary part of a binary file.

    Raises:
        SetupError: it is truncated or of another version.
    """
    if len(data) < 20:
        raise SetupError(f"{path} is truncated: {len(data)} bytes; export it again")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise SetupError(f"{path} is glTF {version}: export it as glTF 2.0")
    if length > len(data):
        raise SetupError(
            f"{path} is truncated: its header states {length} bytes, it has {len(data)}; export it again"
        )
    parts: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, at)
        parts.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if at > length or _JSON not in parts:
        raise SetupError(f"{path}: its parts do not fit its length at byte {at}: export it again")
    return parts[_JSON], parts.get(_BIN, b"")


class GltfFile:
    """A file with checked structure.

    Args:
        path: path of the file; buffers of a .gltf file are beside it.
        data: its content.

    Raises:
        SetupError: it is truncated or not glTF 2.0.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self.path = path
        text, self._binary = split_glb(path, data) if data[:4] == b"glTF" else (data, b"")
        self.tree = decode(path, text, Tree, "glTF")
        if self.tree.asset.version.partition(".")[0] != "2":
            raise SetupError(f"{path} is glTF {self.tree.asset.version:.20}: export it as glTF 2.0")
        self._buffers: dict[int, bytes] = {}

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
        """Return the (count, width) numbers of an accessor, normalized ones as -1..1 or 0..1.

        Raises:
            SetupError: it is invalid, compressed, or beyond the end of its data.
        """
        accessor: Accessor = self.item("accessors", index)
        where = f"{self.path}: accessors[{index}]"
        kind, width = _TYPES.get(accessor.component_type), _WIDTHS.get(accessor.type)
        if accessor.buffer_view is None or accessor.sparse is not UNSET or not (kind and width):
            raise SetupError(f"{where}: sparse or of an unknown type; export without compression")
        view: BufferView = self.item("buffer_views", accessor.buffer_view)
        if any("meshopt" in name for name in view.extensions):
            raise SetupError(f"{where}: compressed by meshopt; export without compression")
        dtype = np.dtype(kind)
        row = dtype.itemsize * width
        stride = view.byte_stride or row
        first = view.byte_offset + accessor.byte_offset
        buffer = self._buffer(view.buffer)
        end = first + stride * (accessor.count - 1) + row if accessor.count else first
        if min(first, accessor.count) < 0 or stride < row or end > len(buffer):
            raise SetupError(
                f"{where}: ends at byte {end} of {len(buffer)}: the file is truncated; export it again"
            )
        raw = np.ndarray((accessor.count, width), dtype, buffer, first, (stride, dtype.itemsize))
        if dtype.kind == "f" or not accessor.normalized:
            return raw.astype(np.float64)
        return np.maximum(raw / np.iinfo(dtype).max, -1.0)

    def _buffer(self, index: int) -> bytes:
        """Return the data of a buffer: of the file, inside the text, or in a file beside it."""
        if index not in self._buffers:
            uri = self.item("buffers", index).uri
            self._buffers[index] = self._binary if uri is None else self._read(uri)
        return self._buffers[index]

    def _read(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            try:
                return b64decode(uri.partition(",")[2], validate=True)
            except ValueError as error:
                raise SetupError(
                    f"{self.path}: its data are damaged: {error}; export it again"
                ) from None
        if Path(uri).name != uri or ":" in uri:
            raise SetupError(
                f"{self.path}: its data are at {uri:.80}: only a file beside it is read; export as .glb"
            )
        try:
            return read_limited(self.path.parent / uri, LARGEST)
        except OSError as error:
            raise SetupError(
                f"{self.path}: its data in {uri} cannot be read: {error.strerror}; export as .glb"
            ) from None

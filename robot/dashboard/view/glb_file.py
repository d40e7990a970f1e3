"""A mesh as a binary glTF file (GLB 2.0): one node, one primitive of triangles, one material.

trimesh writes the same, and takes half a second of a processor to be imported: as long as all else
that the page needs before it opens.
"""

import json
import struct
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Mesh

_UNSIGNED_BYTE: Final = 5121
_UNSIGNED_INT: Final = 5125
_FLOAT: Final = 5126
_TRIANGLES: Final = 4


def glb_file(
    mesh: Mesh, rgba: npt.NDArray[np.uint8], normals: Floats | None, material: dict[str, Any]
) -> bytes:
    """Return the file.

    Args:
        mesh: what is drawn.
        rgba: (n, 4), of the vertices.
        normals: (n, 3) of the vertices, for what the browser lights.
        material: as glTF has it.
    """
    columns: dict[str, tuple[npt.NDArray[Any], int, str]] = {
        "": (mesh.faces.astype("<u4").reshape(-1, 1), _UNSIGNED_INT, "SCALAR"),
        "POSITION": (mesh.vertices.astype("<f4"), _FLOAT, "VEC3"),
        "COLOR_0": (rgba, _UNSIGNED_BYTE, "VEC4"),
    }
    if normals is not None:
        columns["NORMAL"] = (normals.astype("<f4"), _FLOAT, "VEC3")
    accessors, views, data = list[dict[str, Any]](), list[dict[str, int]](), b""
    for number, (values, kind, shape) in enumerate(columns.values()):
        accessor = {"bufferView": number, "componentType": kind, "count": len(values)}
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        normalized = {"normalized": True} if kind == _UNSIGNED_BYTE else {}
        accessors.append({**accessor, "type": shape, **bounds, **normalized})
        part = values.tobytes()  # every column is of whole words of four bytes
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
        data += part
    attributes = {name: number for number, name in enumerate(columns) if name}
    primitive = {"attributes": attributes, "indices": 0, "mode": _TRIANGLES, "material": 0}
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [material],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    if used := sorted(material["extensions"]):
        tree["extensionsUsed"] = used
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<4sII", b"glTF", 2, length)
    return b"".join(
        (head, struct.pack("<I4s", len(text), b"JSON"), text,
         struct.pack("<I4s", len(data), b"BIN\0"), data)
    )  # fmt: skip

"""A painted mesh in common file formats: Wavefront OBJ, its material and a PNG.

Functions that format numbers and angles for text files are also here.
"""

from collections.abc import Iterable
from functools import lru_cache
from math import atan2, cos, hypot, sin
from typing import NamedTuple

import cv2
import numpy as np

from gazerig.gaze.types import Floats, Mat3
from gazerig.robot.description.mesh import Mesh, Painted
from gazerig.robot.description.texture import add_texture


def mesh_files(name: str, painted: Painted) -> dict[str, bytes]:
    """Return the content of ``name``.obj, .mtl and .png by file name; lengths in metres."""
    written = _write_obj(_Content(painted))
    obj = f"mtllib {name}.mtl\no {name}\n{written.points}usemtl {name}\n{written.faces}"
    return {
        f"{name}.obj": obj.encode(),
        f"{name}.mtl": (
            f"newmtl {name}\nKa 1 1 1\nKd 1 1 1\nKs 0.1 0.1 0.1\nNs 20\nillum 2\n"
            f"map_Kd {name}.png\n"
        ).encode(),
        f"{name}.png": written.image,
    }


class _Content:
    """Painted mesh as a key of a cache: equal to another mesh with the same numbers."""

    def __init__(self, painted: Painted) -> None:
        self.painted = painted
        arrays = (*painted.mesh, painted.colours, painted.normals)
        self._numbers = tuple(
            None if one is None else (one.shape, one.dtype.str, one.tobytes()) for one in arrays
        )

    def __hash__(self) -> int:
        return hash(self._numbers)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Content) and self._numbers == other._numbers


class _ObjText(NamedTuple):
    """Mesh in its file formats, without its name: points and faces of the OBJ file, and the PNG."""

    points: str
    faces: str
    image: bytes


# A world is built once for its physics and once for its images, with one or more heads of a rig:
# cache all parts of four rigs.
@lru_cache(maxsize=64)
def _write_obj(content: _Content) -> _ObjText:
    mesh = add_texture(content.painted)
    points, point_of = _unique_rows(mesh.vertices, 6)
    normals, normal_of = _unique_rows(mesh.normals, 3)
    # In this format an image begins at its lower left corner.
    corners, corner_of = _unique_rows(mesh.uv * (1.0, -1.0) + (0.0, 1.0), 5)
    table = np.stack((point_of, corner_of, normal_of), axis=-1)[mesh.faces] + 1
    return _ObjText(
        _rows("v %.6f %.6f %.6f\n", points)
        + _rows("vt %.5f %.5f\n", corners)
        + _rows("vn %.3f %.3f %.3f\n", normals),
        _rows("f %d/%d/%d %d/%d/%d %d/%d/%d\n", table),
        png(mesh.image),
    )


def plain_obj(name: str, mesh: Mesh) -> bytes:
    """Return a mesh without colours as an OBJ file."""
    vertices = _rows("v %.6f %.6f %.6f\n", mesh.vertices)
    faces = _rows("f %d %d %d\n", mesh.faces + 1)
    return f"o {name}\n{vertices}{faces}".encode()


def png(image: np.ndarray) -> bytes:
    """Return an image (rows, columns, 3 or 4), RGB or RGBA, as a PNG file."""
    order = cv2.COLOR_RGB2BGR if image.shape[2] == 3 else cv2.COLOR_RGBA2BGRA
    _, data = cv2.imencode(".png", cv2.cvtColor(image, order), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    return bytes(data)


def _unique_rows(values: Floats, digits: int) -> tuple[Floats, np.ndarray]:
    """Return the unique rows of rounded values, sorted, and the index of each row among them."""
    rounded = np.round(values, digits) + 0.0
    # Column by column: takes a tenth of the time of np.unique, which compares whole rows.
    order = np.lexsort(rounded.T[::-1])
    ordered = rounded[order]
    first = np.ones(len(ordered), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    row_of = np.empty(len(ordered), np.intp)
    row_of[order] = np.cumsum(first) - 1
    return ordered[first], row_of


def _rows(line: str, values: np.ndarray) -> str:
    """Return a line for each row; formatting all together takes a third of the time."""
    return (line * len(values)) % tuple(values.ravel().tolist())


def numbers(values: Iterable[float]) -> str:
    """Return numbers separated by spaces, each the shortest text that is exact."""
    return " ".join(_number(float(value)) for value in values)


def _number(value: float) -> str:
    text = repr(value + 0.0)  # no -0.0
    return text.removesuffix(".0")


def roll_pitch_yaw(R: Mat3) -> tuple[float, float, float]:
    """Return the angles of a rotation about fixed x, y and z axes, in this order (as URDF)."""
    (a, b, c), (d, e, f), (g, _, _) = R
    yaw, pitch = atan2(d, a), atan2(-g, hypot(a, d))
    # From the rotation without yaw, so that it is also valid if pitch is a right angle.
    s, k = sin(yaw), cos(yaw)
    return atan2(s * c - k * f, k * e - s * b), pitch, yaw

"""Shapes as Wavefront OBJ files with a material and a PNG, and numbers as text."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from functools import lru_cache

import cv2
import numpy as np

from gazerig.gaze.types import Floats
from gazerig.robot.description.links import Visual
from gazerig.robot.description.texture import add_texture


def mesh_files(visual: Visual) -> dict[str, bytes]:
    """Return the .obj, .mtl and .png files of a look by their names; lengths in metres."""
    name = visual.name
    text, image = _written(visual.shape, visual.scale)
    return {
        f"{name}.obj": f"mtllib {name}.mtl\no {name}\nusemtl {name}\n{text}".encode(),
        f"{name}.mtl": (
            f"newmtl {name}\nKa 1 1 1\nKd 1 1 1\nKs 0.1 0.1 0.1\nNs 20\nillum 2\n"
            f"map_Kd {name}.png\n"
        ).encode(),
        f"{name}.png": image,
    }


# A world is built once for its physics and once for its images.
@lru_cache(maxsize=64)
def _written(shape: str, scale: float | tuple[float, float, float]) -> tuple[str, bytes]:
    """Return the points and faces of a shape as text, and its colours as a PNG."""
    painted = Visual("", shape, scale=scale).painted()
    (vertices, faces), _, normals = painted
    mesh = add_texture(painted)
    # In this format an image begins at its lower left corner; triangles share points and normals.
    points = (
        _rows("v %.6f %.6f %.6f\n", vertices)
        + _rows("vt %.5f %.5f\n", mesh.uv * (1.0, -1.0) + (0.0, 1.0))
        + _rows("vn %.3f %.3f %.3f\n", normals)
    )
    table = np.dstack((faces, mesh.faces, faces)) + 1
    _, image = cv2.imencode(".png", cv2.cvtColor(mesh.image, cv2.COLOR_RGB2BGR))
    return points + _rows("f %d/%d/%d %d/%d/%d %d/%d/%d\n", table.reshape(-1, 9)), bytes(image)


def _rows(line: str, values: Floats | np.ndarray) -> str:
    """Return a line for each row; formatting all together takes a third of the time."""
    return (line * len(values)) % tuple(values.ravel().tolist())


Text = str | float | Iterable[float] | None


def element(parent: ET.Element, tag: str, **attributes: Text) -> ET.Element:
    """Add an element; numbers are the shortest text that is exact, None adds no attribute."""
    texts = {key: _text(one) for key, one in attributes.items() if one is not None}
    return ET.SubElement(parent, tag, texts)


def _text(value: str | float | Iterable[float]) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return " ".join(map(_text, value))
    return repr(float(value) + 0.0).removesuffix(".0")  # no -0.0

"""Cut a painted mesh along a line on its surface, so that its pieces have smooth edges. Pure."""

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Mesh
from gazerig.robot.description.paint import Painted


def cut(one: Painted, outside: Floats) -> tuple[Painted, Painted]:
    """Return the part of a mesh where values at its vertices are below 0, and the rest.

    Triangles that have both are divided at the line on which the value, linear between their
    corners, is 0; both parts have the new points, with colour and normal in between.

    Args:
        one: with normals.
        outside: (n,) a value a vertex.
    """
    within = outside < 0.0
    faces = one.mesh.faces.astype(np.int64)
    count = within[faces].sum(axis=1)
    whole_in, whole_out = faces[count == 3], faces[count == 0]
    # The corner that is alone on its side comes first; the order of the corners stays.
    mixed = faces[(count == 1) | (count == 2)]
    alone = np.where(within[mixed].sum(axis=1) == 1, True, False)
    first = np.argmax(within[mixed] == alone[:, None], axis=1)
    a, b, c = (mixed[np.arange(len(mixed)), (first + k) % 3] for k in range(3))
    edges = np.sort(np.concatenate((np.stack((a, b), 1), np.stack((a, c), 1))), axis=1)
    ends, number = np.unique(edges, axis=0, return_inverse=True)
    new = number.reshape(-1) + len(outside)
    ab, ac = new[: len(mixed)], new[len(mixed) :]
    tips = np.stack((a, ab, ac), axis=1)
    stumps = np.stack((ab, b, c, ab, c, ac), axis=1)
    pieces = []
    for side, kept in ((True, whole_in), (False, whole_out)):
        rest = stumps[alone != side].reshape(-1, 3)
        pieces.append(_piece(one, ends, outside, np.concatenate((kept, tips[alone == side], rest))))
    return pieces[0], pieces[1]


def _piece(
    one: Painted, ends: NDArray[np.int64], outside: Floats, faces: NDArray[np.int64]
) -> Painted:
    """Return some faces of a mesh that has new points between pairs of its vertices."""
    low, high = outside[ends[:, 0]], outside[ends[:, 1]]
    share = (low / (low - high))[:, None]

    def values(old: Floats) -> Floats:
        between = (1.0 - share) * old[ends[:, 0]] + share * old[ends[:, 1]]
        return np.concatenate((old, between))[kept]

    kept, renumbered = np.unique(faces, return_inverse=True)
    assert one.normals is not None
    normals = values(one.normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    mesh = Mesh(values(one.mesh.vertices), renumbered.reshape(-1, 3).astype(np.uint32))
    return Painted(mesh, values(one.colours), normals)

"""Visitors: a head with hair and a face in two looks, shoulders and a hand; no photographs.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up. Eyes,
nose and mouth are at the positions of the canonical face (robot/model/face_geometry.py).
"""

from functools import cache

import numpy as np

from gazerig.gaze.types import Vec3
from gazerig.robot.description.mesh import (
    Colour,
    Mesh,
    Painted,
    merge_meshes,
    move_mesh,
    stored_shape,
)

LOOKS = 2
"""Number of looks: short hair, long hair."""
SHIRTS: tuple[Colour, ...] = (
    (88, 124, 176), (206, 120, 86), (104, 148, 116), (122, 100, 156),
    (196, 172, 88), (146, 62, 66),
)  # fmt: skip
"""Colours of the shirts of people, by their numbers."""
EYE_FACE_M: Vec3 = (-0.0411635, 0.03095, 0.0349735)
"""Centre of the left eyeball in the face frame."""
MOUTH_FACE_M: Vec3 = (-0.021046, 0.0, -0.03714)
"""Centre of the mouth in the face frame."""


def part_of(look: int, part: str) -> Painted:
    """Return a part of a look.

    Args:
        look: number of the look.
        part: head: skin and hair; face: brows, lower lids and upper lip; mouth: the open mouth, all
            in the face frame; lips: the lower lip, relative to the centre of the mouth; eye, lid:
            an eyeball and an upper lid, relative to its centre; neck; hand: the open right hand.
    """
    return stored_shape(f"person{look % LOOKS}_{part}")


@cache
def features(look: int) -> Painted:
    """Return all that is on the skin of a face at rest, in the face frame."""
    face, lips = part_of(look, "face"), part_of(look, "lips")
    left = [move_mesh(part_of(look, part), EYE_FACE_M) for part in ("eye", "lid")]
    right = [move_mesh(part, scale=(1.0, -1.0, 1.0)) for part in left]
    return merge_meshes([face, move_mesh(lips, MOUTH_FACE_M), *left, *right])


def head(look: int) -> Painted:
    """Return the head of a look as one shape."""
    return merge_meshes([part_of(look, "head"), features(look)])


@cache
def torso(number: int, length_m: float) -> Painted:
    """Return neck, shoulders and chest of a person in the face frame, to a length below it."""
    (vertices, faces), _, normals = stored_shape("shirt")
    vertices = vertices.copy()
    vertices[vertices[:, 2] == vertices[:, 2].min(), 2] = -length_m
    colours = np.tile(np.array(SHIRTS[number % len(SHIRTS)], float), (len(vertices), 1))
    shirt = Painted(Mesh(vertices, faces), colours, normals)
    return merge_meshes([shirt, part_of(number, "neck")])

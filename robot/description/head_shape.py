"""Shape of the head: a smooth solid whose dimensions follow from those of the rig.

All dimensions scale with the distance between the eyes. Head frame: origin midway between the eyes,
x ahead, y left, z up. In this module the unit of length is the distance between the eyes, and left
and right are symmetric; public results are in metres.
"""

from functools import lru_cache
from math import dist, pi, radians
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.face_features import Mouth
from gazerig.robot.description.mesh import grid, smooth_normals
from gazerig.robot.description.solid import (
    Field,
    Solid,
    Surface,
    capsule,
    carve,
    crossings,
    ellipsoid,
    normals,
    union,
)

EYE_RADIUS = 0.335
"""Radius of an eyeball, in distances between the eyes."""
TOP, CHIN = 1.80, -1.62
"""Height of the head's top and of the chin, in distances between the eyes."""
_ROWS, _COLUMNS = 52, 52
_SOLIDS: tuple[tuple[Field, float], ...] = (
    (ellipsoid((-1.10, 0.0, 0.50), (1.30, 1.20, 1.30)), 0.1),  # skull
    (ellipsoid((-0.66, 0.0, -0.30), (0.84, 1.04, 0.96)), 0.45),  # face
    (ellipsoid((-0.44, 0.0, -1.02), (0.60, 0.70, 0.50)), 0.36),  # mouth and the cheeks next to it
    (capsule((-0.98, 0.70, -0.25), (-0.84, 0.55, -0.88), 0.30, 0.26), 0.36),  # jaw, up to the ear
    (capsule((-0.84, 0.55, -0.88), (-0.14, 0.14, -1.32), 0.26, 0.26), 0.36),  # its lower edge
    (ellipsoid((-0.02, 0.0, -1.42), (0.19, 0.26, 0.18)), 0.24),  # chin
    (ellipsoid((-0.20, 0.58, -0.58), (0.38, 0.40, 0.32)), 0.28),  # cheeks
    (ellipsoid((-0.24, 0.55, 0.0), (0.38, 0.50, 0.54)), 0.40),  # round the eyes
    (ellipsoid((-0.03, 0.44, 0.44), (0.22, 0.44, 0.13)), 0.24),  # brow
    (capsule((0.04, 0.0, 0.10), (0.25, 0.0, -0.50), 0.100, 0.120), 0.18),  # bridge of the nose
    (ellipsoid((0.275, 0.0, -0.54), (0.150, 0.145, 0.125)), 0.09),  # its tip
    (ellipsoid((0.190, 0.120, -0.580), (0.10, 0.075, 0.070)), 0.08),  # its wings
)
_LIPS: tuple[tuple[Field, float], ...] = (
    (ellipsoid((0.060, 0.10, -0.965), (0.115, 0.26, 0.056)), 0.09),
    (ellipsoid((0.050, 0.0, -1.095), (0.130, 0.27, 0.070)), 0.09),
)
_SOCKET = ellipsoid((0.33, 0.53, 0.0), (0.30, 0.46, 0.44))
_NECK = capsule((-0.86, 0.0, -0.8), (-0.78, 0.0, -1.36), 0.54, 0.42)
_EYE = np.array((0.0, 0.5, 0.0))
_RIM_ROWS, _RIM_COLUMNS, _RIM_RADIUS = 7, 36, 0.372
_RIM_OFF = 0.014
_RIM_OUT = np.array((0.0, 0.50, 0.49))
_SMILE = 0.85
_MOUTH_Z = -1.030
JAW_HALF = 0.350
"""Half the width of the moving jaw, in distances between the eyes: about that of the lips."""
MOUTH = Mouth(_MOUTH_Z, 0.345, _SMILE, 0.088, 0.110)
"""Position of the lips, in distances between the eyes."""
_NOSE_TIP: Vec3 = (0.425, 0.0, -0.54)
_HINGE: Vec3 = (-0.85, 0.0, -0.55)


def heights_before_smile(y: Floats, z: Floats) -> Floats:
    """Return the heights before the smile that lifted the corners of the mouth."""
    return np.asarray(z - _SMILE * y * y)


class HeadMeasures(NamedTuple):
    """Values of a rig that the shape depends on.

    interocular_m: distance between the eye centres
    pivot_m: a point of the neck's pitch axis in the head frame
    """

    interocular_m: float = 0.0619
    pivot_m: Vec3 = (-0.038, 0.0, -0.055)

    @property
    def eye_radius_m(self) -> float:
        """Return the radius of the eyeballs."""
        return EYE_RADIUS * self.interocular_m

    @property
    def height_m(self) -> float:
        """Return the height of the head from chin to top."""
        return (TOP - CHIN) * self.interocular_m

    def scaled(self, point: Vec3) -> Vec3:
        """Convert a point from this module's unit to metres."""
        x, y, z = point
        return x * self.interocular_m, y * self.interocular_m, z * self.interocular_m

    @property
    def nose_m(self) -> Vec3:
        """Return the tip of the nose."""
        return self.scaled(_NOSE_TIP)

    @property
    def hinge_m(self) -> Vec3:
        """Return the axis of the jaw."""
        return self.scaled(_HINGE)


def measures_of(left_m: Vec3, right_m: Vec3, pivot_m: Vec3 | None = None) -> HeadMeasures:
    """Return the dimensions of a head from the centres of its eyes in any frame, and its pivot."""
    plain = HeadMeasures()
    interocular_m = round(dist(left_m, right_m), 4) or plain.interocular_m
    if pivot_m is None:
        share = interocular_m / plain.interocular_m
        x, y, z = plain.pivot_m
        pivot_m = (share * x, share * y, share * z)
    return HeadMeasures(interocular_m, pivot_m)


def field(points: Floats) -> Floats:
    """Return the distances of points (n, 3) outside the head."""
    folded = points * (1.0, 1.0, 1.0)
    folded[:, 1] = np.abs(folded[:, 1])
    solid = carve(_field_without_mouth(folded), _SOCKET(folded), 0.06)
    folded[:, 2] = heights_before_smile(folded[:, 1], folded[:, 2])
    for part, round_by in _LIPS:
        solid = union(solid, part(folded), round_by)
    return solid


def _field_without_mouth(points: Floats) -> Floats:
    """Return the distances of points (n, 3) of the left half to a head without eyes and lips."""
    solid = _SOLIDS[0][0](points)
    for part, round_by in _SOLIDS[1:]:
        solid = union(solid, part(points), round_by)
    return union(solid, _NECK(points), 0.20)


HEAD = Solid(field, (-0.80, 0.0, -0.02), 2.6)
"""The head, in distances between the eyes."""


@lru_cache(maxsize=1)
def surface() -> Surface:
    """Return the head's surface; it is computed once."""
    return HEAD.all_round(_ROWS, _COLUMNS, radians(-30.0), radians(30.0))


def eye_rim() -> Surface:
    """Return the surroundings of the left eye: from the edge of the lids to the skin around it.

    Rows from the inside outwards, closed columns around the eye.
    """
    around = np.linspace(2.0 * pi, 0.0, _RIM_COLUMNS, endpoint=False)
    aside, up = np.cos(around), np.sin(around)
    # Far enough from the eye's axis to leave lids and iris free: farther at the temple, nearer
    # above.
    off = np.radians(60.0 + 12.0 * np.clip(aside, 0.0, 1.0) ** 2 - 4.0 * np.clip(up, 0.0, 1.0) ** 2)
    out = np.stack((np.zeros_like(around), aside, up), axis=1)
    spherical = np.cos(off)[:, None] * (1.0, 0.0, 0.0) + np.sin(off)[:, None] * out
    edge = _RIM_RADIUS * spherical + _EYE
    targets = _EYE + (0.05, 0.0, 0.0) + _RIM_OUT * out
    rays = targets - np.array(HEAD.centre)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    skin = crossings(field, HEAD.centre, rays, HEAD.farthest)
    outwards = normals(field, skin)
    away = skin - edge
    # It leaves the eye sideways and a little ahead, and meets the skin tangentially.
    begin = 0.45 * np.linalg.norm(away, axis=1, keepdims=True) * out + (0.05, 0.0, 0.0)
    end = away - (away * outwards).sum(axis=1, keepdims=True) * outwards
    share = np.linspace(0.0, 1.0, _RIM_ROWS)[:, None, None]
    points = (
        (1.0 - share) ** 3 * edge
        + 3.0 * (1.0 - share) ** 2 * share * (edge + begin)
        + 3.0 * (1.0 - share) * share**2 * (skin - end / 3.0)
        + share**3 * skin
    )
    # The triangulated skin stays below it.
    flat = points[1:].reshape(-1, 3)
    flat += np.maximum(0.0, _RIM_OFF - _field_without_mouth(flat))[:, None] * normals(
        _field_without_mouth, flat
    )
    points[1:] = flat.reshape(points[1:].shape)
    points[-1] -= 2.0 * _RIM_OFF * outwards
    points = np.concatenate((((edge - _EYE) * 0.90 + _EYE)[None], points))
    found = smooth_normals(grid(points, closed=True)).reshape(points.shape)
    as_skin = np.concatenate(((0.0,), np.linspace(0.0, 1.0, _RIM_ROWS) ** 0.8))[:, None, None]
    skin_normals = normals(_field_without_mouth, points.reshape(-1, 3)).reshape(points.shape)
    found = (1.0 - as_skin) * found + as_skin * skin_normals
    return Surface(points, found / np.linalg.norm(found, axis=-1, keepdims=True))


def _above_mouth(points: Floats) -> Floats:
    """Return heights of points (n, 3) above the line between the lips, extended to the hinge."""
    x, y, z = points.T
    z = heights_before_smile(np.minimum(np.abs(y), JAW_HALF), z)
    return np.asarray(z - _MOUTH_Z - 0.42 * np.maximum(0.0, -0.16 - x))


JAW_BOUNDS: tuple[Field, ...] = (
    lambda points: np.abs(points[:, 1]) - JAW_HALF,
    _above_mouth,
    lambda points: -2.56 - 0.6 * points[:, 0] - points[:, 2],  # top of the throat
    lambda points: -0.45 - points[:, 0],
)
"""A jaw moves the part of the surface where each of these is below 0. Its sides are planes across
its axis: as it opens they slide along the fixed ones, so no gap appears next to the mouth."""

"""Drawing of a simulated scene in a camera's view: people of true size in a room.

The people are those of the page's 3-D view; their eyes, noses and mouths are at the landmarks of
gazerig.robot.model.face_geometry, so that a face detector made for people finds them there.
Shapes are faces in one colour each, the farthest first. Not drawn: arms, also those of raised
hands, expression, blinks; the eyes look straight ahead.
"""

from functools import lru_cache
from math import atan2, pi
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import ImageArray
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Painted, paint, stored_shape
from gazerig.robot.description.people import features, part_of, torso
from gazerig.robot.model.scene import PinholeView
from gazerig.sim_mock.scenes.scene import Scene, ScenePerson

_NEAREST_M = 0.06
"""Nothing nearer is drawn."""
_CHEST_M, _HAND_M = 0.75, 0.1
_SPINE_M, _DARKER = -0.117, 0.85
"""Axis of the chest behind the nose, and brightness of the dark fields of a pattern."""
_TO_LIGHT: Floats = np.array((-0.52, 0.48, 0.71))
_AMBIENT, _DIRECT = 0.66, 0.46
_SMALL_PX2, _OF_SMALL = 2.0, 4
_LAYER_M = 0.02
_SHIFT = 4
"""OpenCV draws polygons with a resolution of 1/16 pixel."""

_ROOM_M, _ROOM_HEIGHT_M, _FLOOR_M = 3.2, 3.2, -0.72
"""Radius of the round wall, its height up and down, and the height of the floor's far edge."""
_PX_PER_M = 100.0
_WALL_BGR, _FLOOR_BGR = (222, 226, 222), (120, 148, 172)
_PATCHES: tuple[tuple[float, float], ...] = ((0.06, 10.0), (0.18, 12.0), (0.6, 16.0))
"""Sizes of the soft patches on the wall in metres, and their contrast in grey values."""
_STEP_PX = 8
"""Distance of the pixels whose places on the wall are computed; between them they change evenly."""


class _Shape(NamedTuple):
    """Quadrangles in one colour each.

    vertices: (n, 3); faces: (m, 4) their numbers; normals, colours: (m, 3), BGR
    """

    vertices: Floats
    faces: NDArray[np.uint32]
    normals: Floats
    colours: Floats


class _Solid(NamedTuple):
    """A shape with its pose in the world; drawn from the farthest to the nearest."""

    shape: _Shape
    R: Floats
    p_m: Floats
    distance_m: float
    scale: float = 1.0


def draw_picture(scene: Scene, seen_by: PinholeView) -> ImageArray:
    """Return the camera's view of a scene, BGR."""
    image, eye_m = _draw_room(seen_by), np.array(seen_by.p_m)
    people = scene.people(seen_by.t_s)
    solids: list[_Solid] = []
    for number, person in enumerate(people):
        solids += _person(person, number, eye_m)
        if person.hand is not None:
            solids.append(_facing(_palm(number), np.array(person.hand), _HAND_M, 0.0, eye_m))
    for thing in scene.things(seen_by.t_s):
        shape = _palm(thing.person or 0) if thing.kind == "hand" else _ball()
        place = np.array(thing.p_world_m)
        solids.append(_facing(shape, place, thing.radius_m, thing.turned_rad, eye_m))
    for solid in sorted(solids, key=lambda solid: -solid.distance_m):
        _draw_solid(image, seen_by, solid)
    return np.asarray(cv2.GaussianBlur(image, (3, 3), 0.6), np.uint8)


def _person(person: ScenePerson, number: int, eye_m: Floats) -> list[_Solid]:
    """Return a person's head and chest."""
    place = np.array(person.p_world_face_m)
    R_head = np.array(rotation((*person.face_yaw_pitch_rad, 0.0)))
    to_eye = eye_m - place
    away_m = float(np.linalg.norm(to_eye))
    solid, features = _head(number)
    # The chest is drawn before the head in any case: the neck is in its collar.
    chest = _Solid(_chest(number), _R_towards(to_eye), place, away_m + 0.01)
    found = [chest, _Solid(solid, R_head, place, away_m)]
    if to_eye @ R_head[:, 0] > 0.1 * away_m:
        found.append(_Solid(features, R_head, place, away_m - 1e-3))
    return found


@lru_cache(maxsize=8)
def _head(number: int) -> tuple[_Shape, _Shape]:
    """Return skin and hair, and the features of the face on them."""
    return _flat(part_of(number, "head")), _flat(features(number))


@lru_cache(maxsize=8)
def _chest(number: int) -> _Shape:
    return _pattern(torso(number, _CHEST_M), _SPINE_M, 7.0, 9.0)


@lru_cache(maxsize=8)
def _palm(number: int) -> _Shape:
    return _pattern(part_of(number, "hand"), 0.0, 5.0, 7.0)


def _pattern(plain: Painted, axis_x_m: float, around: float, along: float) -> _Shape:
    """Return a shape with darker fields around and along an upright axis.

    Motion is visible only where the brightness changes.
    """
    x, y, z = plain.mesh.vertices.T
    field = np.sin(around * np.arctan2(y, x - axis_x_m) + 0.4) * np.cos(along * z)
    colours = plain.colours * np.where(field > 0.0, _DARKER, 1.0)[:, None]
    return _flat(plain._replace(colours=colours))


def _flat(painted: Painted) -> _Shape:
    """Return a painted mesh with one normal and colour for each two triangles of its grids."""
    vertices, triangles = painted.mesh
    first, second = triangles[::2], triangles[1::2]
    # A mirrored mesh has the corners of each triangle in the opposite order.
    last = np.where(second[:, 2] == first[:, 2], second[:, 0], second[:, 2])
    faces = np.column_stack((first, last))
    normals = painted.normals[faces].mean(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return _Shape(vertices, faces, normals, painted.colours[faces].mean(axis=1)[:, ::-1])


def _facing(
    shape: _Shape, p_m: Floats, radius_m: float, turned_rad: float, eye_m: Floats
) -> _Solid:
    """Return a shape of radius 1 whose x axis points to the camera, turned about it."""
    R = _R_towards(eye_m - p_m) @ np.array(rotation((0.0, 0.0, -turned_rad)))
    return _Solid(shape, R, p_m, float(np.linalg.norm(eye_m - p_m)), radius_m)


def _R_towards(way: Floats) -> Floats:
    """Return the rotation of an upright shape that faces along a way."""
    return np.array(rotation((atan2(way[1], way[0]), 0.0, 0.0)))


@lru_cache(maxsize=1)
def _ball() -> _Shape:
    """Return a ball of radius 1 in six coloured sectors about x, so that its turns are visible."""
    ball = paint(stored_shape("ball").mesh, (96, 150, 200))
    _, y, z = ball.mesh.vertices.T
    ball.colours[np.sin(3.0 * np.arctan2(z, y)) > 0.0] = (238, 206, 120)
    return _flat(ball)


def _draw_solid(image: ImageArray, seen_by: PinholeView, solid: _Solid) -> None:
    """Draw a shape face by face, the farthest first, with diffuse shading."""
    shape, lens = solid.shape, seen_by.lens
    world = solid.scale * shape.vertices @ solid.R.T + solid.p_m
    seen = (world - np.array(seen_by.p_m)) @ np.array(seen_by.R)
    if seen[:, 2].min() < _NEAREST_M:
        return
    pixels = seen[:, :2] / seen[:, 2:] * (lens.fx_px, lens.fy_px) + (lens.cx_px, lens.cy_px)
    if (pixels.max(axis=0) < 0.0).any() or (pixels.min(axis=0) > seen_by.size_px).any():
        return
    corners = pixels[shape.faces]
    one, other = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    area = one[:, 1] * other[:, 0] - one[:, 0] * other[:, 1]
    # A face fills at least a pixel: of those that are smaller, some suffice.
    drawn = (area > _SMALL_PX2) | ((area > 0.0) & (np.arange(len(area)) % _OF_SMALL == 0))
    facing = np.flatnonzero(drawn)
    # Of a shape's parts the later ones lie on the earlier ones, such as hair on the skull.
    away_m = seen[shape.faces[facing], 2].mean(axis=1) - _LAYER_M * facing / len(area)
    facing = facing[np.argsort(-away_m)]
    light = _TO_LIGHT @ (solid.R / np.linalg.norm(solid.R, axis=0))
    bright = _AMBIENT + _DIRECT * np.clip(shape.normals[facing] @ light, 0.0, 1.0)
    colours = np.minimum(shape.colours[facing] * bright[:, None], 255.0).tolist()
    fixed = np.rint(corners[facing] * (1 << _SHIFT)).astype(np.int32)
    for face, colour in zip(fixed, colours, strict=True):
        cv2.fillConvexPoly(image, face, colour, cv2.LINE_8, _SHIFT)


def _draw_room(seen_by: PinholeView) -> ImageArray:
    """Return the view of the wall all round and of the floor painted below it."""
    lens, (width, height) = seen_by.lens, seen_by.size_px
    R, wall = np.array(seen_by.R), _wall()
    columns = np.arange(-_STEP_PX, width + 2 * _STEP_PX, _STEP_PX) + 0.5 * (_STEP_PX - 1)
    rows = np.arange(-_STEP_PX, height + 2 * _STEP_PX, _STEP_PX) + 0.5 * (_STEP_PX - 1)
    right, down = np.meshgrid((columns - lens.cx_px) / lens.fx_px, (rows - lens.cy_px) / lens.fy_px)
    x, y, z = np.moveaxis(np.stack((right, down, np.ones_like(right)), axis=-1) @ R.T, -1, 0)
    # Azimuths are relative to the camera's, so that they are continuous in its view.
    ahead = atan2(R[1, 2], R[0, 2])
    c, s = np.cos(ahead), np.sin(ahead)
    azimuth = ahead + np.arctan2(c * y - s * x, c * x + s * y)
    up_m = _ROOM_M * z / np.maximum(np.hypot(x, y), 1e-3)
    size = len(columns) * _STEP_PX, len(rows) * _STEP_PX
    maps = (
        0.5 * wall.shape[1] - azimuth * (wall.shape[1] / (2.0 * pi)),
        np.clip((_ROOM_HEIGHT_M - up_m) * _PX_PER_M, 0.0, wall.shape[0] - 1.0),
    )
    own = slice(_STEP_PX, _STEP_PX + height), slice(_STEP_PX, _STEP_PX + width)
    fine = [cv2.resize(one.astype(np.float32), size)[own] for one in maps]
    seen = cv2.remap(wall, fine[0], fine[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(seen, np.uint8)


@lru_cache(maxsize=1)
def _wall() -> ImageArray:
    """Return the wall all round: columns by azimuth, rows from the top down to the floor."""
    width, height = round(2.0 * pi * _ROOM_M * _PX_PER_M), round(2.0 * _ROOM_HEIGHT_M * _PX_PER_M)
    rng = np.random.default_rng(0)
    grey = np.zeros((height, width))
    for size_m, contrast in _PATCHES:
        cells = round(height / _PX_PER_M / size_m), round(width / _PX_PER_M / size_m)
        noise = rng.uniform(-contrast, contrast, cells)
        grey += cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC)
    edge = round((_ROOM_HEIGHT_M - _FLOOR_M) * _PX_PER_M)
    wall = grey[:, :, None] + np.array(_WALL_BGR)
    wall[edge:] += np.subtract(_FLOOR_BGR, _WALL_BGR)
    image: ImageArray = np.clip(wall, 0.0, 255.0).astype(np.uint8)
    return image

"""A picture of a simulated scene for the page: a calm room with people.

The people are those of the page's 3-D view. No detector uses the picture
(gazerig.sim_mock.cameras.rendered draws for those).
"""

from functools import lru_cache
from math import atan2
from typing import NamedTuple

import cv2
import numpy as np

from gazerig.drivers.types import ImageArray
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.mesh import Painted, lathe, paint
from gazerig.robot.description.person_shape import LOOKS, hand, head_parts, torso
from gazerig.robot.model.scene_view import PinholeView
from gazerig.sim_mock.cameras.canvas import Canvas
from gazerig.sim_mock.cameras.draw_arm import elbow_m, shoulder_m
from gazerig.sim_mock.scenes.scene import Scene, ScenePerson

_FINENESS, _CHEST_M = 0.5, 0.75
_HAND_M = 0.075
_SLEEVE_M, _WRIST_M = 0.052, 0.034
_NEAREST_M = 0.06
_TO_LIGHT: Floats = np.array((-0.52, 0.48, 0.71))
_AMBIENT, _DIRECT = 0.66, 0.46
_SHIFT = 4
_WALL_TOP, _WALL_LOW = (214, 218, 214), (236, 236, 230)  # BGR
_TABLE_FAR, _TABLE_NEAR = (150, 172, 190), (118, 142, 166)
_TABLE_M = -0.55
"""Height of the distant edge between wall and floor."""
_BALL_BGR = (190, 150, 110)


def draw_picture(scene: Scene, seen_by: PinholeView) -> ImageArray:
    """Return the camera's view of a scene, BGR."""
    canvas, p_m = Canvas(seen_by), seen_by.p_m
    _draw_room(canvas)
    people = scene.people(seen_by.t_s)
    solids = [solid for i, one in enumerate(people) for solid in _person(one, i, p_m)]
    for thing in scene.things(seen_by.t_s):
        if thing.person is not None and thing.person < len(people):
            solids += _arm(people[thing.person], thing.person, thing.p_world_m, p_m)
        elif thing.kind == "hand":
            solids.append(_hand(thing.p_world_m, 0, thing.radius_m, p_m))
        else:
            _draw_ball(canvas, thing.p_world_m, thing.radius_m)
    for solid in sorted(solids, key=lambda one: -one.distance_m):
        _draw_solid(canvas, solid)
    return np.asarray(cv2.GaussianBlur(canvas.image, (3, 3), 0.6), np.uint8)


class _PlacedShape(NamedTuple):
    """A painted shape with its pose in the world."""

    shape: Painted
    R: Floats
    p_m: Floats
    scale: float
    distance_m: float


def _place_shape(
    shape: Painted, R: Floats, p_m: Vec3, eye_m: Vec3, scale: float = 1.0
) -> _PlacedShape:
    away = float(np.linalg.norm(np.subtract(p_m, eye_m)))
    return _PlacedShape(shape, R, np.array(p_m), scale, away)


def _person(person: ScenePerson, number: int, eye_m: Vec3) -> list[_PlacedShape]:
    """Return a person's head and chest, and the arm of a raised hand."""
    face = person.p_world_face_m
    yaw, pitch = person.face_yaw_pitch_rad
    R_head = np.array(rotation((yaw, pitch, 0.0)))
    away = np.subtract(face, eye_m)
    R_chest = np.array(rotation((atan2(-away[1], -away[0]), 0.0, 0.0)))
    solid, features = head_parts(number, _FINENESS)
    skull = _place_shape(solid, R_head, face, eye_m)
    solids = [
        skull,
        # The chest is drawn before the head in any case: the neck is in its collar.
        _place_shape(torso(number, _CHEST_M), R_chest, face, eye_m)._replace(
            distance_m=float(np.linalg.norm(away)) + 0.01
        ),
    ]
    if -float(away @ R_head[:, 0]) > 0.1 * float(np.linalg.norm(away)):
        solids.append(skull._replace(shape=features, distance_m=skull.distance_m - 1e-3))
    if person.hand is not None:
        solids += _arm(person, number, person.hand, eye_m)
    return solids


def _arm(person: ScenePerson, number: int, p_hand_m: Vec3, eye_m: Vec3) -> list[_PlacedShape]:
    shoulder = shoulder_m(person.p_world_face_m, p_hand_m, eye_m)
    elbow = elbow_m(shoulder, p_hand_m)
    sleeve, bare = _limb(number, True), _limb(number, False)
    wrist = np.array(p_hand_m) - (0.0, 0.0, 0.8 * _HAND_M)
    return [
        _place_link(sleeve, shoulder, elbow, eye_m),
        _place_link(bare, elbow, (float(wrist[0]), float(wrist[1]), float(wrist[2])), eye_m),
        _hand(p_hand_m, number, _HAND_M, eye_m),
    ]


def _hand(p_m: Vec3, number: int, radius_m: float, eye_m: Vec3) -> _PlacedShape:
    """Return an open hand whose palm faces the camera."""
    to_eye = np.subtract(eye_m, p_m)
    R = np.array(rotation((atan2(to_eye[1], to_eye[0]), 0.0, 0.0)))
    return _place_shape(hand(number), R, p_m, eye_m, radius_m)


@lru_cache(maxsize=8)
def _limb(number: int, sleeve: bool) -> Painted:
    """Return an arm's link of length 1 along z; the radius is already in metres."""
    look = LOOKS[number % len(LOOKS)]
    thick, thin = (_SLEEVE_M, 0.9 * _SLEEVE_M) if sleeve else (0.9 * _SLEEVE_M, _WRIST_M)
    mesh = lathe(
        [(0.0, -0.10), (0.7 * thick, -0.06), (thick, 0.0), (thin, 1.0), (0.0, 1.04)], around=16
    )
    return paint(mesh, look.shirt if sleeve else look.skin)


def _place_link(link: Painted, start: Vec3, end: Vec3, eye_m: Vec3) -> _PlacedShape:
    """Place a link from one point to another."""
    way = np.subtract(end, start)
    length = max(float(np.linalg.norm(way)), 1e-6)
    up = way / length
    aside = np.cross((0.0, 1.0, 0.0) if abs(up[1]) < 0.9 else (1.0, 0.0, 0.0), up)
    aside /= np.linalg.norm(aside)
    R = np.stack((aside, np.cross(up, aside), up * length), axis=1)
    middle = 0.5 * (np.array(start) + np.array(end))
    placed = _place_shape(link, R, start, eye_m)
    return placed._replace(distance_m=float(np.linalg.norm(middle - np.array(eye_m))))


def _draw_solid(canvas: Canvas, solid: _PlacedShape) -> None:
    """Draw a shape face by face, the farthest first, with diffuse shading."""
    mesh = solid.shape.mesh
    seen = canvas.to_camera(solid.scale * mesh.vertices @ solid.R.T + solid.p_m)
    if seen[:, 2].min() < _NEAREST_M:
        return
    lens = canvas.lens
    pixels = seen[:, :2] / seen[:, 2:] * (lens.fx_px, lens.fy_px) + (lens.cx_px, lens.cy_px)
    height, width = canvas.depth_m.shape
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    if high[0] < 0 or high[1] < 0 or low[0] > width or low[1] > height:
        return
    corners = pixels[mesh.faces]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    facing = np.flatnonzero(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] < 0.0)
    depth = seen[mesh.faces[facing], 2].sum(axis=1)
    facing = facing[np.argsort(-depth)]
    fixed = np.rint(corners[facing] * (1 << _SHIFT)).astype(np.int32)
    image, fill = canvas.image, cv2.fillConvexPoly
    # The colours of the faces under the room's light, BGR.
    assert solid.shape.normals is not None
    normals = solid.shape.normals @ solid.R.T
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    bright = _AMBIENT + _DIRECT * np.clip(normals @ _TO_LIGHT, 0.0, 1.0)
    lit = np.clip(solid.shape.colours * bright[:, None], 0.0, 255.0)
    shades = lit[mesh.faces].mean(axis=1)[facing, ::-1]
    for triangle, colour in zip(fixed, shades.tolist(), strict=True):
        fill(image, triangle, colour, cv2.LINE_8, _SHIFT)


def _draw_ball(canvas: Canvas, p_m: Vec3, radius_m: float) -> None:
    seen = canvas.to_camera(p_m)[0]
    if seen[2] < max(_NEAREST_M, radius_m):
        return
    lens = canvas.lens
    u = seen[0] / seen[2] * lens.fx_px + lens.cx_px
    v = seen[1] / seen[2] * lens.fy_px + lens.cy_px
    radius = radius_m / seen[2] * lens.fx_px
    if not (-2e3 < u < 2e4 and -2e3 < v < 2e4):
        return
    for share in (1.0, 0.8, 0.55, 0.3):
        shade = tuple(min(255.0, c * (1.25 - 0.5 * share)) for c in _BALL_BGR)
        at = (round(u - 0.3 * (1.0 - share) * radius), round(v - 0.35 * (1.0 - share) * radius))
        cv2.circle(canvas.image, at, max(1, round(share * radius)), shade, -1, cv2.LINE_AA)


def _draw_room(canvas: Canvas) -> None:
    """Draw a wall and a floor, both with gradients, that turn with the camera."""
    height, width = canvas.depth_m.shape
    lens = canvas.lens
    R = canvas.R_world_camera
    # Height and tilt of the horizon at the image's centre, from the world's up.
    up = R.T @ np.array((0.0, 0.0, 1.0))
    rows = (np.arange(height) - lens.cy_px) / lens.fy_px
    columns = (np.arange(width) - lens.cx_px) / lens.fx_px
    rise = up[0] * columns[None, ::8] + up[1] * rows[:, None] + up[2]
    edge = _TABLE_M / 3.0
    share = np.clip(0.5 + (rise - edge) * 90.0, 0.0, 1.0)[..., None]
    wall = _fade_colours(rise, edge, 0.75, _WALL_LOW, _WALL_TOP)
    floor = _fade_colours(edge - rise, 0.0, 0.6, _TABLE_FAR, _TABLE_NEAR)
    small = (wall * share + floor * (1.0 - share)).astype(np.float32)
    wide = cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)
    canvas.image[:] = np.clip(wide, 0.0, 255.0)
    for y, z, half_y, half_z, colour in (
        (1.15, 0.72, 0.34, 0.26, (206, 178, 150)),
        (-1.25, 0.66, 0.24, 0.32, (150, 176, 206)),
        (-0.35, 0.95, 0.20, 0.15, (172, 196, 168)),
    ):
        frame = [
            (3.0, y + a * half_y, z + b * half_z) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
        ]
        inner = [
            (2.99, y + a * half_y * 0.88, z + b * half_z * 0.86)
            for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
        ]
        canvas.polygon(frame, (250, 250, 248))
        canvas.polygon(inner, colour)


def _fade_colours(
    value: Floats,
    start: float,
    reach: float,
    first: tuple[int, int, int],
    last: tuple[int, int, int],
) -> Floats:
    share = np.clip((value - start) / reach, 0.0, 1.0)[..., None]
    return np.asarray(np.array(first, float) * (1.0 - share) + np.array(last, float) * share)

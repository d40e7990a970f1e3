"""A person in a camera's view: a face of true size and pose, and a body below it.

Eyes, nose and mouth of the face are at the landmarks of gazerig.robot.perception.face_pose, in
three dimensions, so that a face detector made for people finds them there. Arms are drawn if
their hands are raised. Not drawn: arms that hang, expression, blinks; the eyes look straight
ahead.
"""

from functools import lru_cache
from math import cos, pi, sin
from typing import NamedTuple

import cv2
import numpy as np

from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.sim_mock.cameras.canvas import Bytes, Canvas, Colour, Floats, TexturedQuad
from gazerig.sim_mock.cameras.draw_arm import draw_arm
from gazerig.sim_mock.scenes.scene import ScenePerson, Thing

_LOW: Vec3 = (-2.5, -3.0, -0.9)
_HIGH: Vec3 = (4.0, 3.0, 1.6)
_PX_PER_M = 70.0
_CEILING: Colour = (215, 218, 220)
_FLOOR: Colour = (95, 120, 150)
_WALLS: tuple[Colour, ...] = ((190, 200, 196), (196, 190, 178), (182, 196, 204), (200, 196, 190))
# Sizes of the patches, and their contrast with the wall.
_PATCHES_M, _CONTRAST = (0.07, 0.2, 0.6), (26.0, 30.0, 24.0)


def draw_room(canvas: Canvas, seed: int = 0) -> None:
    """Draw the visible walls, floor and ceiling."""
    for quad in _room(seed):
        canvas.draw_quad(quad)


@lru_cache(maxsize=4)
def _room(seed: int) -> tuple[TexturedQuad, ...]:
    """Return the six sides; equal seeds give equal textures."""
    rng = np.random.default_rng(seed)
    (x0, y0, z0), (x1, y1, z1) = _LOW, _HIGH
    wide, long, tall = y1 - y0, x1 - x0, z1 - z0
    sides: tuple[tuple[Vec3, Vec3, Vec3, Colour], ...] = (
        ((x1, y1, z1), (0.0, -wide, 0.0), (0.0, 0.0, -tall), _WALLS[0]),
        ((x0, y0, z1), (0.0, wide, 0.0), (0.0, 0.0, -tall), _WALLS[1]),
        ((x0, y1, z1), (long, 0.0, 0.0), (0.0, 0.0, -tall), _WALLS[2]),
        ((x1, y0, z1), (-long, 0.0, 0.0), (0.0, 0.0, -tall), _WALLS[3]),
        ((x1, y1, z0), (0.0, -wide, 0.0), (-long, 0.0, 0.0), _FLOOR),
        ((x0, y1, z1), (0.0, -wide, 0.0), (long, 0.0, 0.0), _CEILING),
    )
    return tuple(
        TexturedQuad(corner, right, down, _texture(_length(right), _length(down), colour, rng))
        for corner, right, down, colour in sides
    )


def _texture(width_m: float, height_m: float, colour: Colour, rng: np.random.Generator) -> Bytes:
    """Return soft patches of several sizes on a colour."""
    width, height = round(width_m * _PX_PER_M), round(height_m * _PX_PER_M)
    grey = np.zeros((height, width))
    for size_m, contrast in zip(_PATCHES_M, _CONTRAST, strict=True):
        cells = max(2, round(width_m / size_m)), max(2, round(height_m / size_m))
        noise = rng.uniform(-1.0, 1.0, (cells[1], cells[0]))
        grey += contrast * cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC)
    out: Bytes = np.clip(grey[:, :, None] + np.array(colour), 0.0, 255.0).astype(np.uint8)
    return out


def _length(v: Vec3) -> float:
    return float(np.linalg.norm(v))


class PersonColours(NamedTuple):
    """Colours of a person."""

    skin: Colour
    hair: Colour
    shirt: Colour


PERSON_COLOURS = (
    PersonColours((150, 180, 225), (35, 50, 70), (140, 90, 60)),
    PersonColours((135, 165, 210), (25, 30, 35), (70, 80, 160)),
    PersonColours((165, 195, 235), (70, 120, 165), (90, 130, 80)),
)

_RIGHT_EYE, _LEFT_EYE, _, _MOUTH_RIGHT, _MOUTH_LEFT = LANDMARKS_FACE_M
# The head is an ellipsoid: its centre and half axes in the face frame.
HEAD_MIDDLE_M: Vec3 = (-0.103, 0.0, 0.0)
HEAD_HALF_M: Vec3 = (0.088, 0.074, 0.112)
_HAIR_MIDDLE_M: Vec3 = (-0.118, 0.0, 0.018)
_HAIR_HALF_M: Vec3 = (0.098, 0.083, 0.124)
_AROUND = np.linspace(0.0, 2.0 * pi, 40, endpoint=False)
_TORSO_TOP_M, _TORSO_HEIGHT_M, _TORSO_WIDTH_M, _TORSO_BEHIND_M = -0.075, 0.80, 0.46, 0.10


def draw_person(canvas: Canvas, person: ScenePerson, number: int) -> None:
    """Draw a person; people with equal numbers look equal."""
    looks = PERSON_COLOURS[number % len(PERSON_COLOURS)]
    yaw, pitch = person.face_yaw_pitch_rad
    R = np.array(rotation((yaw, pitch, 0.0)))
    draw_body(canvas, person.p_world_face_m, looks, number)
    draw_head(canvas, person.p_world_face_m, R, looks)


def draw_person_arm(canvas: Canvas, person: ScenePerson, number: int, p_world_hand_m: Vec3) -> None:
    """Draw a person's arm to a hand."""
    looks = PERSON_COLOURS[number % len(PERSON_COLOURS)]
    draw_arm(canvas, person.p_world_face_m, p_world_hand_m, looks.shirt, looks.skin)


def draw_head(
    canvas: Canvas, p_world_face_m: Vec3, R_world_face: Floats, looks: PersonColours
) -> None:
    """Draw head and face; the face frame is at the tip of the nose."""

    def world(points_face_m: Floats) -> Floats:
        out: Floats = points_face_m @ R_world_face.T + np.array(p_world_face_m)
        return out

    back = world(_ellipsoid(_HAIR_MIDDLE_M, _HAIR_HALF_M))
    if canvas.to_camera(back)[:, 2].min() < 0.05:
        return
    seen = canvas.to_camera(back)
    flat = (seen[:, :2] / seen[:, 2:]).astype(np.float32)
    order = cv2.convexHull(flat, returnPoints=False)[:, 0]
    canvas.polygon(back[order], looks.hair)
    to_camera = (canvas.p_m - np.array(p_world_face_m)) @ R_world_face
    if to_camera[0] > 0.0:
        for outline, colour in _feature_outlines(looks):
            canvas.polygon(world(outline), colour)
    middle = world(np.array([HEAD_MIDDLE_M]))[0]
    canvas.ellipsoid_depth((middle[0], middle[1], middle[2]), R_world_face, HEAD_HALF_M)


def draw_body(canvas: Canvas, p_world_face_m: Vec3, looks: PersonColours, number: int) -> None:
    """Draw shoulders and trunk, facing the camera."""
    x, y, z = p_world_face_m
    away = np.array((x - canvas.p_m[0], y - canvas.p_m[1]))
    away /= max(1e-6, float(np.linalg.norm(away)))
    aside = np.array((away[1], -away[0], 0.0)) * _TORSO_WIDTH_M
    middle = np.array((x, y, z + _TORSO_TOP_M)) + (*(away * _TORSO_BEHIND_M), 0.0)
    corner = middle - 0.5 * aside
    canvas.draw_quad(
        TexturedQuad(
            _to_vec3(corner), _to_vec3(aside), (0.0, 0.0, -_TORSO_HEIGHT_M), _trunk(looks, number)
        )
    )


def draw_thing(canvas: Canvas, thing: Thing) -> None:
    """Draw a thing as a patterned ball; hands have the colour of skin."""
    way = np.array(thing.p_world_m) - canvas.p_m
    aside = np.cross(way, (0.0, 0.0, 1.0))
    aside /= max(1e-6, float(np.linalg.norm(aside)))
    up = np.cross(aside, way / max(1e-6, float(np.linalg.norm(way))))
    turned, r = thing.turned_rad, thing.radius_m
    aside, up = cos(turned) * aside - sin(turned) * up, cos(turned) * up + sin(turned) * aside
    corner = np.array(thing.p_world_m) - r * aside + r * up
    texture = _round_patch(thing.kind == "hand", thing.id)
    canvas.draw_quad(
        TexturedQuad(_to_vec3(corner), _to_vec3(2 * r * aside), _to_vec3(-2 * r * up), texture)
    )


def _ellipsoid(middle_m: Vec3, half_m: Vec3) -> Floats:
    """Return points spread over an ellipsoid."""
    up = np.linspace(-1.0, 1.0, 13)[:, None]
    level = np.sqrt(1.0 - up * up)
    x, y = level * np.cos(_AROUND), level * np.sin(_AROUND)
    points = np.stack((x, y, np.broadcast_to(up, x.shape)), axis=2).reshape(-1, 3)
    return np.asarray(points * half_m + middle_m, dtype=np.float64)


@lru_cache(maxsize=8)
def _feature_outlines(looks: PersonColours) -> tuple[tuple[Floats, Colour], ...]:
    """Return the outlines of a face's features in drawing order."""
    skin = looks.skin
    shade, deep = _darken(skin, 0.86), _darken(skin, 0.68)
    drawn: list[tuple[Floats, Colour]] = [
        (_points_on_head(0.066 * np.cos(_AROUND), -0.008 + 0.098 * np.sin(_AROUND)), skin),
    ]
    for eye, side in ((_RIGHT_EYE, -1.0), (_LEFT_EYE, 1.0)):
        x, y, z = eye.tolist()
        drawn += [
            (_ellipse((x, y, z + 0.002), 0.019, 0.012), shade),
            (_ellipse((x, y, z), 0.0145, 0.0068), (238, 240, 242)),
            (_ellipse((x, y, z), 0.0062, 0.0062), (40, 50, 60)),
            (_curved_band((x, y, z + 0.0062), 0.016, 0.003, 0.0030), (30, 35, 45)),
            (
                _curved_band((x + 0.006, y + 0.002 * side, z + 0.018), 0.019, 0.005, 0.0055),
                looks.hair,
            ),
        ]
    drawn += [
        (
            np.array(
                [(-0.022, -0.006, 0.028), (-0.004, -0.014, -0.008), (0, 0, -0.010), (0, 0, 0.0)]
            ),
            shade,
        ),
        (
            np.array(
                [(-0.022, 0.006, 0.028), (-0.004, 0.014, -0.008), (0, 0, -0.010), (0, 0, 0.0)]
            ),
            skin,
        ),
        (_ellipse((-0.004, 0.0, -0.010), 0.014, 0.0045), deep),
        (_ellipse((-0.006, -0.0065, -0.011), 0.0035, 0.0025), (45, 50, 70)),
        (_ellipse((-0.006, 0.0065, -0.011), 0.0035, 0.0025), (45, 50, 70)),
        (_mouth(0.0075, 0.0085), (95, 95, 175)),
        (_mouth(0.0012, 0.0012), (55, 50, 95)),
        (_curved_band((-0.020, 0.0, -0.056), 0.012, -0.002, 0.0025), shade),
    ]
    return tuple(drawn)


def _nose_side(side: float) -> Floats:
    """Return the flank of the nose on the person's left (1) or right (-1)."""
    root, wing = (-0.022, 0.006 * side, 0.028), (-0.004, 0.014 * side, -0.008)
    return np.array([root, wing, (0.0, 0.0, -0.010), (0.0, 0.0, 0.0)])


def _mouth(above_m: float, below_m: float) -> Floats:
    """Return lips between the corners of the mouth, with their heights above and below the line."""
    a, b = _MOUTH_RIGHT, _MOUTH_LEFT
    share = np.linspace(0.0, 1.0, 13)[:, None]
    line = a + share * (b - a)
    bulge = np.sin(pi * share[:, 0])
    line[:, 0] += 0.012 * bulge
    upper, lower = line.copy(), line.copy()
    upper[:, 2] += above_m * bulge
    lower[:, 2] -= below_m * bulge
    return np.concatenate((upper, lower[::-1]))


def _ellipse(middle: tuple[float, float, float], half_y: float, half_z: float) -> Floats:
    """Return an upright ellipse at a position."""
    x, y, z = middle
    t = _AROUND[::2]
    return np.stack((np.full(len(t), x), y + half_y * np.cos(t), z + half_z * np.sin(t)), axis=1)


def _curved_band(
    middle: tuple[float, float, float], half_y: float, rise_m: float, thick_m: float
) -> Floats:
    """Return a band that bends down by ``rise_m`` towards its ends and is thinner there."""
    x, y, z = middle
    share = np.linspace(-1.0, 1.0, 9)
    base = z - rise_m * share * share
    half = 0.5 * thick_m * (1.0 - 0.6 * share * share)
    ys, xs = y + half_y * share, np.full(9, x)
    top = np.stack((xs, ys, base + half), axis=1)
    bottom = np.stack((xs, ys, base - half), axis=1)
    return np.concatenate((top, bottom[::-1]))


def _points_on_head(y: Floats, z: Floats) -> Floats:
    """Return points on the front of the head at given positions in the face's plane."""
    cx, cy, cz = HEAD_MIDDLE_M
    a, b, c = HEAD_HALF_M
    inside = np.maximum(0.0, 1.0 - ((y - cy) / b) ** 2 - ((z - cz) / c) ** 2)
    return np.stack((cx + a * np.sqrt(inside), y, z), axis=1)


@lru_cache(maxsize=8)
def _trunk(looks: PersonColours, number: int) -> Bytes:
    """Return a neck, sloping shoulders and a checked shirt: (h, w, 4) with opacity."""
    width, height = 138, 225
    shirt = np.zeros((height, width, 4), np.uint8)
    rng = np.random.default_rng(1000 + number)
    checks = cv2.resize(
        rng.uniform(-45.0, 45.0, (26, 16)), (width, height), interpolation=cv2.INTER_LINEAR
    )
    shirt[:, :, :3] = np.clip(checks[:, :, None] + np.array(looks.shirt), 0.0, 255.0)
    neck = np.zeros((height, width), np.uint8)
    cv2.rectangle(neck, (52, 0), (86, 36), 255, -1)
    cv2.ellipse(neck, (69, 36), (17, 10), 0.0, 0.0, 360.0, 255, -1)
    outline = np.array(
        [(52, 22), (86, 22), (120, 34), (137, 60), (137, 224), (0, 224), (0, 60), (18, 34)]
    )
    body = np.zeros((height, width), np.uint8)
    cv2.fillPoly(body, [outline], 255, cv2.LINE_AA)
    shirt[neck > 0, :3] = _darken(looks.skin, 0.85)
    shirt[:, :, 3] = np.maximum(body, neck)
    return shirt


@lru_cache(maxsize=32)
def _round_patch(hand: bool, number: int) -> Bytes:
    """Return a round patterned patch: (64, 64, 4)."""
    rng = np.random.default_rng(2000 + number)
    spread = 25.0 if hand else 90.0
    colour = np.array(PERSON_COLOURS[0].skin if hand else rng.uniform(60.0, 200.0, 3))
    cells = rng.uniform(-spread, spread, (6, 6))
    pattern = cv2.resize(cells, (64, 64), interpolation=cv2.INTER_CUBIC)
    ball = np.zeros((64, 64, 4), np.uint8)
    ball[:, :, :3] = np.clip(colour + pattern[:, :, None], 0.0, 255.0)
    opaque = np.zeros((64, 64), np.uint8)
    cv2.circle(opaque, (32, 32), 31, 255, -1, cv2.LINE_AA)
    ball[:, :, 3] = opaque
    return ball


def _darken(colour: Colour, share: float) -> Colour:
    b, g, r = colour
    return round(b * share), round(g * share), round(r * share)


def _to_vec3(row: Floats) -> Vec3:
    return float(row[0]), float(row[1]), float(row[2])

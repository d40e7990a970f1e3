"""Shape of a visitor: a head with hair and a face, shoulders, a hand; without photographs.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up. In this
module the unit of length is the distance between the pupils; public results are in metres. Eyes,
nose and mouth are at the positions of the canonical face (robot/model/face_geometry.py).
"""

from functools import lru_cache
from math import cos, pi, radians, sin
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.face_features import Mouth, brow, lips
from gazerig.robot.description.mesh import (
    Colour,
    Mesh,
    Painted,
    cap,
    grid,
    merge_meshes,
    mirror_mesh,
    mix,
    move_mesh,
    paint,
    smooth_step,
    spot_weight,
)
from gazerig.robot.description.mesh import ellipsoid as ellipsoid_mesh
from gazerig.robot.description.solid import Field, Solid, Surface, capsule, carve, ellipsoid, union
from gazerig.robot.model.face_geometry import PUPIL_DISTANCE_M


class PersonLook(NamedTuple):
    """Colours of a person, and whether the hair falls to the shoulders."""

    skin: Colour
    hair: Colour
    shirt: Colour
    iris: Colour
    long_hair: bool
    trousers: Colour = (52, 60, 82)
    shoes: Colour = (58, 50, 46)
    short_sleeves: bool = False


LOOKS = (
    PersonLook((236, 188, 158), (84, 56, 40), (88, 124, 176), (96, 66, 44), False),
    PersonLook((150, 102, 74), (34, 28, 28), (206, 120, 86), (58, 38, 28), True),
    PersonLook((246, 208, 184), (196, 142, 78), (104, 148, 116), (84, 124, 150), True),
    PersonLook((206, 156, 118), (44, 36, 36), (122, 100, 156), (62, 44, 34), False),
)
WORLD_LOOKS = (
    *LOOKS,
    PersonLook(
        (108, 72, 54), (26, 22, 22), (196, 172, 88), (48, 34, 26), False, (74, 74, 78), (40, 36, 36)
    ),
    PersonLook(
        (240, 198, 170), (150, 146, 142), (146, 62, 66), (92, 112, 120), False, (88, 80, 70)
    ),
    PersonLook((220, 172, 138), (120, 60, 34), (68, 132, 140), (92, 110, 66), True, (46, 46, 54)),
    PersonLook(
        (190, 140, 106),
        (30, 26, 26),
        (232, 228, 220),
        (52, 38, 30),
        False,
        (64, 84, 120),
        (210, 206, 198),
    ),
)
"""Looks of the people of a world: the same four, and further ones."""


_EYE_RADIUS = 0.21
_EYE: Vec3 = (-0.665, 0.5, 0.565)
_SMILE = 0.30
_PARTS: tuple[tuple[Field, float], ...] = (
    (ellipsoid((-1.66, 0.0, 0.55), (1.36, 1.16, 1.45)), 0.1),  # skull
    (ellipsoid((-1.22, 0.0, -0.25), (0.84, 0.92, 1.00)), 0.40),  # face
    (ellipsoid((-1.00, 0.0, -0.80), (0.64, 0.74, 0.50)), 0.35),  # jaw
    (ellipsoid((-0.50, 0.0, -1.14), (0.20, 0.26, 0.18)), 0.26),  # chin
    (ellipsoid((-0.74, 0.52, 0.02), (0.34, 0.34, 0.30)), 0.26),  # cheeks
    (ellipsoid((-0.56, 0.42, 0.92), (0.16, 0.42, 0.11)), 0.24),  # brow
    (capsule((-0.42, 0.0, 0.52), (-0.17, 0.0, 0.04), 0.095, 0.125), 0.16),  # nose
    (ellipsoid((-0.155, 0.0, 0.0), (0.155, 0.145, 0.125)), 0.08),
    (ellipsoid((-0.235, 0.120, -0.03), (0.10, 0.080, 0.070)), 0.08),
    (ellipsoid((-1.62, 1.10, 0.20), (0.22, 0.13, 0.32)), 0.10),  # ears
)
_LIPS: tuple[tuple[Field, float], ...] = (
    (ellipsoid((-0.335, 0.09, -0.53), (0.11, 0.24, 0.055)), 0.09),
    (ellipsoid((-0.345, 0.0, -0.665), (0.12, 0.24, 0.070)), 0.09),
)
_DISH = ellipsoid((-0.26, 0.5, 0.56), (0.24, 0.36, 0.26))
_MOUTH = Mouth(-0.600, 0.34, 0.30, 0.085, 0.105)


def _field(points: Floats) -> Floats:
    folded = points * (1.0, 1.0, 1.0)
    folded[:, 1] = np.abs(folded[:, 1])
    solid = _PARTS[0][0](folded)
    for part, round_by in _PARTS[1:]:
        solid = union(solid, part(folded), round_by)
    solid = carve(solid, _DISH(folded), 0.24)
    folded[:, 2] -= _SMILE * folded[:, 1] ** 2
    for part, round_by in _LIPS:
        solid = union(solid, part(folded), round_by)
    return solid


_HEAD = Solid(_field, (-1.45, 0.0, 0.25), 3.4)


class HeadParts(NamedTuple):
    """A head in two layers: skin and hair; eyes and lips on them."""

    solid: Painted
    features: Painted


@lru_cache(maxsize=8)
def head_parts(number: int, fineness: float = 1.0) -> HeadParts:
    """Return the head of a person; the same number looks the same.

    fineness: 1 for close views, less for fewer triangles
    """
    look = LOOKS[number % len(LOOKS)]
    solid = _head_solid(look, fineness)
    red, dark = (
        _mix_colours(look.skin, (186, 62, 66), 0.55),
        _mix_colours(look.skin, (70, 24, 24), 0.8),
    )
    # Both eyes with their lids' edges, and the brows.
    eye, glint, lid, still = _eye_parts(look, fineness)
    left = [*(move_mesh(part, _EYE) for part in (*eye, glint, lid)), *still]
    face = merge_meshes([*left, *map(mirror_mesh, left), *lips(_HEAD, _MOUTH, red, dark)])
    return HeadParts(solid, move_mesh(face, (0.0, 0.0, 0.0), PUPIL_DISTANCE_M))


def _head_solid(look: PersonLook, fineness: float) -> Painted:
    """Return skin and hair of a head."""
    skin = _skin(fineness)
    mesh = grid(skin.points, closed=True)
    plain = Painted(
        mesh, _complexion(skin.points, look).reshape(-1, 3), skin.normals.reshape(-1, 3)
    )
    return move_mesh(
        merge_meshes([plain, *_hair(look, fineness)]), (0.0, 0.0, 0.0), PUPIL_DISTANCE_M
    )


class HeadSegments(NamedTuple):
    """Head in parts that move relative to each other, each in its own frame.

    head: skin, hair, brows, lower lids and upper lip, in the face frame
    lips: the lower lip, relative to the centre of the mouth
    eye, lid: an eyeball and an upper lid, relative to the eyeball's centre; both eyes are equal
    """

    head: Painted
    lips: Painted
    eye: Painted
    lid: Painted


EYE_FACE_M: Vec3 = tuple(PUPIL_DISTANCE_M * one for one in _EYE)  # type: ignore[assignment]
"""Centre of the left eyeball in the face frame."""
MOUTH_FACE_M: Vec3 = (-0.34 * PUPIL_DISTANCE_M, 0.0, _MOUTH.z * PUPIL_DISTANCE_M)
"""Centre of the mouth in the face frame."""


@lru_cache(maxsize=8)
def head_segments(look: PersonLook, fineness: float = 1.0) -> HeadSegments:
    """Return the head of a person in parts."""
    red, dark = (
        _mix_colours(look.skin, (186, 62, 66), 0.55),
        _mix_colours(look.skin, (40, 12, 14), 0.92),
    )
    mouth = lips(_HEAD, _MOUTH, red, dark)
    inside = _MOUTH._replace(upper=0.03, lower=_MOUTH.lower + 0.045, half_width=0.30)
    open_mouth = move_mesh(lips(_HEAD, inside, dark, dark).lower, (-0.004, 0.0, 0.0))
    eye, glint, lid, still = _eye_parts(look, fineness)
    # The glint is flat on the eyeball, so that the lid covers it.
    flat = move_mesh(glint, (-0.52 * _EYE_RADIUS, 0.022, 0.024), 0.52)
    solid = _head_solid(look, fineness)
    features = [*still, *(mirror_mesh(part) for part in still), mouth.upper, mouth.line, open_mouth]
    back = tuple(-one / PUPIL_DISTANCE_M for one in MOUTH_FACE_M)
    size, here = PUPIL_DISTANCE_M, (0.0, 0.0, 0.0)
    # The lower lip is in front of the open mouth and covers it while raised.
    lower = move_mesh(mouth.lower, (back[0] + 0.035, back[1], back[2]))
    return HeadSegments(
        merge_meshes([solid, move_mesh(merge_meshes(features), here, size)]),
        move_mesh(lower, here, size),
        move_mesh(merge_meshes([*eye, flat]), here, size),
        move_mesh(lid, here, size),
    )


def head(number: int, fineness: float = 1.0) -> Painted:
    """Return the head of a person as one shape."""
    return merge_meshes(head_parts(number, fineness))


def _complexion(points: Floats, look: PersonLook) -> Floats:
    folded = points * (1.0, 1.0, 1.0)
    folded[..., 1] = np.abs(folded[..., 1])
    x, y, z = np.moveaxis(folded, -1, 0)
    shade, blush = (_mix_colours(look.skin, to) for to in ((120, 60, 44), (236, 110, 96)))
    colours = np.broadcast_to(np.array(look.skin, float), points.shape)
    colours = mix(colours, blush, 0.55 * spot_weight(folded, (-0.50, 0.58, -0.02), 0.32))
    colours = mix(colours, blush, 0.35 * spot_weight(folded, (0.0, 0.0, -0.02), 0.16))
    colours = mix(colours, shade, 0.55 * spot_weight(folded, (-0.50, 0.5, 0.57), 0.30))
    colours = mix(colours, shade, 0.80 * spot_weight(folded, (-0.14, 0.07, -0.10), 0.055))
    return mix(colours, shade, 0.6 * smooth_step(-z - 1.25, 0.3))


class _EyeParts(NamedTuple):
    """Layers of an eyeball, its glint and upper lid, about its centre; lower lid and brow."""

    eye: list[Painted]
    glint: Painted
    lid: Painted
    fixed_mesh: list[Painted]


def _eye_parts(look: PersonLook, fineness: float) -> _EyeParts:
    """Return the parts of a left eye."""
    rings = 3 if fineness < 0.3 else 5 if fineness < 1.0 else 9
    around = 12 if fineness < 0.3 else 18 if fineness < 0.5 else 48
    balls = (
        (1.0, 66.0, (250, 249, 247)),
        (1.02, 31.0, look.iris),
        (1.04, 14.0, (14, 12, 14)),
    )
    parts = [
        paint(cap(size * _EYE_RADIUS, radians(deg), rings, around), colour)
        for size, deg, colour in balls
    ]
    glint = paint(cap(0.035, pi, 4, around), (255, 255, 255))
    glint = move_mesh(glint, (1.02 * _EYE_RADIUS, 0.045, 0.05))
    tone = _mix_colours(look.skin, (120, 60, 44), 0.12)
    lids = []
    for edge_deg, end_deg, dark in ((20.0, 118.0, 1.0), (-25.0, -84.0, 0.35)):
        lid = paint(_shell(1.09 * _EYE_RADIUS, edge_deg, end_deg), tone)
        x, _, up = lid.mesh.vertices.T
        swept = np.arctan2(up, x)  # about the y axis, from straight ahead
        edge = smooth_step(0.05 - np.abs(swept - radians(edge_deg)), 0.05)
        lids.append(lid._replace(colours=mix(lid.colours, (40, 28, 26), dark * edge)))
    share = np.linspace(0.0, 1.0, 12)
    y, z = 0.20 + 0.62 * share, 0.90 + 0.13 * np.sin(pi * (0.2 + 0.6 * share))
    hair = brow(_HEAD, y, z, 0.052, look.hair, 8)
    return _EyeParts(parts, glint, lids[0], [move_mesh(lids[1], _EYE), hair])


def _shell(radius: float, edge_deg: float, end_deg: float) -> Mesh:
    """Return a lid: the part of a sphere between two heights above its equator."""
    sweep = np.radians((edge_deg, edge_deg + 0.14 * (end_deg - edge_deg), end_deg))
    sweep = np.concatenate((sweep[:2], np.linspace(sweep[1], sweep[2], 6)[1:]))
    across = np.linspace(0.94 * pi, 0.06 * pi, 14)
    points = np.stack(
        (
            np.cos(sweep)[:, None] * np.sin(across),
            np.broadcast_to(np.cos(across), (len(sweep), 14)),
            np.sin(sweep)[:, None] * np.sin(across),
        ),
        axis=-1,
    )
    return grid(radius * (points if end_deg > edge_deg else points[:, ::-1]), closed=False)


@lru_cache(maxsize=4)
def _skin(fineness: float) -> Surface:
    """Return the surface of a head, the same for all people."""
    rows = round(84 * fineness)
    return _HEAD.all_round(rows, rows, radians(-4.0), radians(34.0))


@lru_cache(maxsize=4)
def _crown(fineness: float, around: int) -> Surface:
    """Return the surface of the hair: it ends behind the ears, outside the skull."""
    return _HEAD.beyond((-1.0, 0.0, 0.62), 1.42, round(22 * fineness), around, 0.10)


def _hair(look: PersonLook, fineness: float) -> list[Painted]:
    """Return a cap of hair and, if the hair is long, two strands next to the neck."""
    around = round(56 * fineness)
    found = _crown(fineness, around)
    points = found.points.copy()
    rim = found.points[0] - 0.22 * found.normals[0]
    wave = 0.02 * np.sin(9.0 * np.linspace(0.0, 2.0 * pi, around))
    points[1:] += wave[:, None] * found.normals[1:]
    mesh = grid(np.concatenate((rim[None], points)), closed=True)
    shine = np.clip(mesh.vertices[:, 2] - 0.9, 0.0, 1.0) * 0.22
    hair = paint(mesh, look.hair)
    parts = [
        hair._replace(colours=mix(hair.colours, _mix_colours(look.hair, (255, 230, 200)), shine))
    ]
    if look.long_hair:
        rows = 8 if fineness < 0.5 else 13
        fall = paint(ellipsoid_mesh((0.42, 0.30, 1.35), 0.9, rows), look.hair)
        left = move_mesh(fall, (-1.95, 1.02, -0.55))
        back = move_mesh(
            paint(ellipsoid_mesh((0.45, 1.05, 1.35), 0.9, rows), look.hair), (-2.35, 0.0, -0.55)
        )
        parts += [left, mirror_mesh(left), back]
    return parts


@lru_cache(maxsize=8)
def torso(number: int, length_m: float, columns: int = 40) -> Painted:
    """Return neck hole, shoulders and chest in the face frame, for an upright person."""
    look = LOOKS[number % len(LOOKS)]
    bottom = -length_m / PUPIL_DISTANCE_M
    # Height, half depth, half width.
    rows = [
        (-1.60, 0.62, 0.70), (-1.75, 0.74, 0.86), (-1.95, 0.84, 1.30), (-2.15, 0.98, 2.00),
        (-2.40, 1.12, 2.62), (-2.75, 1.22, 3.02), (-3.20, 1.30, 3.20), (-3.90, 1.38, 3.18),
        (-4.60, 1.40, 2.96), (min(-4.61, bottom), 1.36, 2.84),
    ]  # fmt: skip
    around = np.linspace(0.0, 2.0 * pi, columns, endpoint=False)
    points = np.array(
        [[(-1.85 + x * cos(a), y * sin(a), z) for a in around.tolist()] for z, x, y in rows[::-1]]
    )
    mesh = grid(points, closed=True)
    collar = smooth_step(mesh.vertices[:, 2] + 1.80, 0.06)
    shirt = paint(mesh, look.shirt)
    shirt = shirt._replace(
        colours=mix(shirt.colours, _mix_colours(look.shirt, (255, 255, 255)), collar)
    )
    neck_rows = ((-1.70, 0.60, 0.60), (-1.55, 0.60, 0.60), (-1.0, 0.62, 0.64), (-0.4, 0.60, 0.62))
    tube = [
        [(-1.75 + x * cos(a), y * sin(a), z) for a in around[::2].tolist()] for z, x, y in neck_rows
    ]
    neck = paint(grid(np.array(tube), closed=True), _mix_colours(look.skin, (120, 60, 44), 0.22))
    return move_mesh(merge_meshes([shirt, neck]), (0.0, 0.0, 0.0), PUPIL_DISTANCE_M)


def hand(number: int) -> Painted:
    """Return an open right hand of radius 1 m: x out of the palm, z along the fingers."""
    return open_right_hand(LOOKS[number % len(LOOKS)])


@lru_cache(maxsize=8)
def open_right_hand(look: PersonLook, rows: int = 34) -> Painted:
    """Return the open right hand of a look; fewer rows give fewer triangles."""
    mitten = Solid(_mitten_field, (0.0, 0.0, -0.1), 2.2)
    found = mitten.all_round(rows, rows)
    points, normals = found.points.reshape(-1, 3), found.normals.reshape(-1, 3)
    colours = np.broadcast_to(np.array(look.skin, float), points.shape)
    y, z = points[:, 1], points[:, 2]
    gaps = np.exp(-((np.abs(np.abs(y) - 0.20) / 0.03) ** 2)) + np.exp(-((y / 0.03) ** 2))
    colours = mix(
        colours, _mix_colours(look.skin, (120, 60, 44)), 0.8 * gaps * smooth_step(z - 0.28, 0.1)
    )
    return Painted(grid(found.points, closed=True), colours, normals)


def _mitten_field(points: Floats) -> Floats:
    palm = ellipsoid((0.0, 0.0, -0.22), (0.17, 0.46, 0.52))(points)
    fingers = ellipsoid((0.02, 0.0, 0.45), (0.13, 0.38, 0.55))(points)
    thumb = capsule((0.04, 0.34, -0.30), (0.12, 0.66, 0.10), 0.13, 0.10)(points)
    wrist = capsule((0.0, 0.0, -0.5), (0.0, 0.0, -0.95), 0.24, 0.24)(points)
    solid = union(union(palm, fingers, 0.16), thumb, 0.12)
    return union(solid, wrist, 0.2)


def _mix_colours(colour: Colour, other: Colour, share: float = 0.5) -> Colour:
    """Return a colour between two."""
    r, g, b = (round(a + share * (o - a)) for a, o in zip(colour, other, strict=True))
    return r, g, b

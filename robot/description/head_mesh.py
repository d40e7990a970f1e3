"""Painted meshes of the rig's head: skin, cap, brows, eyes, lids, ears, neck and bust."""

from functools import lru_cache
from math import cos, pi, radians, sin
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats
from gazerig.robot.description.face_features import brow as bow
from gazerig.robot.description.face_features import lips
from gazerig.robot.description.head_shape import HEAD, JAW_BOUNDS, JAW_HALF, MOUTH, eye_rim, surface
from gazerig.robot.description.mesh import (
    Colour,
    Mesh,
    Painted,
    ellipsoid,
    grid,
    lathe,
    merge_meshes,
    mirror_mesh,
    mix,
    paint,
    smooth_normals,
    smooth_step,
    spot_weight,
    uniform_colours,
)
from gazerig.robot.description.solid import cut_mesh

SKIN: Colour = (247, 206, 178)
LID: Colour = (243, 198, 170)
_BLUSH: Colour = (240, 160, 140)
_LIPS: Colour = (206, 106, 98)
_MOUTH_LINE: Colour = (128, 58, 56)
_MOUTH: Colour = (72, 26, 28)
_SHADE: Colour = (222, 160, 130)
_HOLLOW: Colour = (110, 66, 56)
CAP: Colour = (58, 62, 74)
_CAP_EDGE: Colour = (92, 98, 112)
_HAIR: Colour = (70, 52, 44)
_LASH: Colour = (52, 36, 32)
_SCLERA: Colour = (255, 254, 251)
_SCLERA_FAR: Colour = (238, 214, 204)
_PUPIL: Colour = (6, 7, 10)
_LIMBUS: Colour = (8, 34, 82)
_IRIS: Colour = (24, 122, 226)
_IRIS_INNER: Colour = (150, 216, 250)
LIMBUS_RAD, _PUPIL_RAD = radians(31.0), radians(12.5)
_CORNEA = 0.05
"""Height of the cornea above the eyeball, in radii of the eyeball."""
_CAP_NORMAL, _CAP_LINE, _CAP_OUT = (-1.0, 0.0, 0.55), 0.70, 0.035
"""Plane at which the cap begins, and its distance from the skin, in distances between the eyes."""

_JAW_MIDDLE = (-0.42, -1.10)
"""Forward position and height of a point within the jaw from which its sides are triangle fans."""


class HeadSkin(NamedTuple):
    """The surface of the head in two pieces; a jaw moves the second.

    cheeks: fixed walls on both sides of the jaw that face it
    """

    head: Painted
    jaw: Painted
    cheeks: Painted


@lru_cache(maxsize=1)
def skin() -> HeadSkin:
    """Return the painted skin, in distances between the eyes."""
    points, normals = surface()
    colours = _complexion(points, normals)
    whole = grid(points, closed=True)
    jaw = Painted(whole, colours.reshape(-1, 3), normals.reshape(-1, 3))
    stays = []
    for bound in JAW_BOUNDS:
        jaw, beyond = cut_mesh(jaw, bound(jaw.mesh.vertices))
        stays.append(beyond)
    upper, lower, line = lips(HEAD, MOUTH, _LIPS, _MOUTH_LINE)
    sides = [_jaw_side(jaw, sign, 0.8, SKIN) for sign in (1.0, -1.0)]
    cheeks = []  # with their normals reversed
    for sign in (1.0, -1.0):
        side = _jaw_side(jaw, sign, 0.4, _MOUTH)
        mesh = Mesh(side.mesh.vertices, side.mesh.faces[:, ::-1])
        cheeks.append(Painted(mesh, side.colours, smooth_normals(mesh)))
    return HeadSkin(
        merge_meshes([*stays, *_eye_rims(), upper, line]),
        merge_meshes([jaw, *sides, lower]),
        merge_meshes(cheeks),
    )


def _eye_rims() -> tuple[Painted, Painted]:
    """Return the skin around the left and the right eye."""
    points, normals = eye_rim()
    # Lit as if it were a little flatter and higher, because bags below the eyes look tired.
    normals = normals + np.linspace(1.0, 0.0, len(points))[:, None, None] * (0.3, 0.0, 0.25)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    mesh = grid(points, closed=True)
    colours = _complexion(points, normals)
    colours[0] = colours[1] = colours[1] * 0.82
    left = Painted(mesh, colours.reshape(-1, 3), normals.reshape(-1, 3))
    return left, mirror_mesh(left)


def _jaw_side(jaw: Painted, sign: float, deep: float, within: Colour) -> Painted:
    """Return the wall on one side of a jaw, which is visible while the jaw is below the head.

    Args:
        jaw: skin of the jaw.
        sign: 1: the left side.
        deep: depth as a fraction of the distance from the edge to the jaw's centre.
        within: colour of the inner end.
    """
    rim = jaw.mesh.vertices[np.isclose(jaw.mesh.vertices[:, 1], sign * JAW_HALF)]
    middle = np.array((_JAW_MIDDLE[0], sign * JAW_HALF, _JAW_MIDDLE[1]))
    rim = rim[np.argsort(-sign * np.arctan2(*(rim - middle)[:, (2, 0)].T))]
    points = np.stack((rim, rim + deep * (middle - rim)))
    colours = np.broadcast_to(np.array((SKIN, within), float)[:, None], points.shape)
    mesh = grid(points, closed=False)
    return Painted(mesh, colours.reshape(-1, 3), smooth_normals(mesh))


@lru_cache(maxsize=1)
def cap() -> Painted:
    """Return the cap over the back of the head, in distances between the eyes."""
    points, normals = HEAD.beyond(_CAP_NORMAL, _CAP_LINE, 15, 48, _CAP_OUT)
    # Its edge is rounded down to the skin and a little below it.
    rim = [points[0] - out * normals[0] for out in (0.10, 0.03, 0.012)]
    lifted = np.concatenate((np.stack(rim), points[1:]))
    mesh = grid(lifted, closed=True)
    near = np.concatenate(((1.0, 1.0, 1.0, 0.7), np.zeros(len(lifted) - 4)))
    colours = np.broadcast_to(np.array(CAP, float), lifted.shape)
    colours = mix(colours, _CAP_EDGE, np.broadcast_to(near[:, None], lifted.shape[:2]))
    return Painted(mesh, colours.reshape(-1, 3), smooth_normals(mesh))


def _complexion(points: Floats, normals: Floats) -> Floats:
    """Return the skin's colours: cheeks, lips, hollows of the eyes and the nose."""
    x, y, z = np.moveaxis(points, -1, 0)
    y = np.abs(y)
    folded = np.stack((x, y, z), axis=-1)
    colours = np.broadcast_to(np.array(SKIN, float), points.shape).copy()
    below = np.clip(-normals[..., 2], 0.0, 1.0)
    colours = mix(colours, _SHADE, 0.45 * below)
    colours = mix(colours, _BLUSH, 0.50 * spot_weight(folded, (0.10, 0.62, -0.52), 0.30))
    colours = mix(colours, _BLUSH, 0.30 * spot_weight(folded, (0.42, 0.0, -0.55), 0.14))
    colours = mix(colours, _SHADE, 0.22 * spot_weight(folded, (0.10, 0.5, 0.0), 0.46))
    colours = mix(colours, _HOLLOW, 0.8 * spot_weight(folded, (0.33, 0.075, -0.655), 0.042))
    return colours


@lru_cache(maxsize=1)
def mouth() -> Painted:
    """Return the dark interior of an open mouth, in distances between the eyes.

    It is a body that hides the neck, the inside of the skin, and the cheeks next to the jaw.
    """
    ball = ellipsoid((0.52, 0.55, 0.62), 0.7)
    body = Mesh(ball.vertices + (-0.62, 0.0, -0.92), ball.faces)
    mesh, _, normals = skin().head
    inside = Mesh(mesh.vertices - 0.03 * np.asarray(normals), mesh.faces[:, ::-1])
    return merge_meshes([paint(body, _MOUTH), paint(inside, _MOUTH), skin().cheeks])


@lru_cache(maxsize=1)
def brow() -> Painted:
    """Return the left brow, in distances between the eyes: a tapering arc on the forehead."""
    share = np.linspace(0.0, 1.0, 20)
    y = 0.20 + 0.68 * share
    z = 0.50 + 0.20 * np.sin(pi * (0.16 + 0.66 * share)) - 0.06 * share
    return bow(HEAD, y, z, 0.052, _HAIR, 9)


@lru_cache(maxsize=1)
def eye() -> Painted:
    """Return an eyeball of radius 1 that looks along x: white, iris, pupil under the cornea."""
    # Rows are dense at the edges of colours: the white, the limbus and the pupil.
    angles = np.radians(
        (110, 80, 60, 46, 37, 33, 31.6, 30.6, 29.6, 28.4, 27, 24.5, 21.5, 18.5, 16, 14, 13, 12, 10, 5, 0)
    )  # fmt: skip
    inside = np.clip(1.0 - (angles / LIMBUS_RAD) ** 2, 0.0, 1.0)
    radius = 1.0 + _CORNEA * inside**1.25
    profile = list(zip(radius * np.sin(angles), radius * np.cos(angles), strict=True))
    columns = 48
    dome = lathe([(r, h) for r, h in profile], around=columns)
    mesh = Mesh(dome.vertices[:, (2, 0, 1)], dome.faces)
    colours = np.repeat(_eye_colours(angles, columns).reshape(-1, 3), 1, axis=0)
    return Painted(mesh, colours, smooth_normals(mesh))


def _eye_colours(angles: Floats, columns: int) -> Floats:
    """Return the eye's colours (rows, columns, 3) by the angle from its axis."""
    rng = np.random.default_rng(7)
    fibres = np.sin(
        np.outer(np.arange(4, 24, 2), np.linspace(0.0, 2.0 * pi, columns, endpoint=False))
        + rng.uniform(0.0, 2.0 * pi, 10)[:, None]
    ).mean(axis=0) * 2.2  # fmt: skip
    a = np.degrees(angles)[:, None] + 0.0 * fibres
    share = np.clip((a - 12.5) / 17.0, 0.0, 1.0)
    colours = np.broadcast_to(np.array(_IRIS, float), (*a.shape, 3)).copy()
    colours = mix(colours, _IRIS_INNER, np.exp(-(((share - 0.18) / 0.20) ** 2)) * 0.75)
    colours = mix(colours, _IRIS_INNER, np.clip(fibres, 0.0, 1.0) * np.sin(pi * share) * 0.55)
    colours = mix(colours, _LIMBUS, np.clip(-fibres, 0.0, 1.0) * np.sin(pi * share) * 0.40)
    colours = mix(colours, _LIMBUS, smooth_step(a - 27.4, 1.6) * 0.95)
    white = np.broadcast_to(np.array(_SCLERA, float), colours.shape)
    white = mix(white, _SCLERA_FAR, np.clip((a - 48.0) / 40.0, 0.0, 1.0))
    outside = smooth_step(a - 30.6, 0.8)[..., None]
    colours = colours * (1.0 - outside) + white * outside
    return mix(colours, _PUPIL, smooth_step(np.degrees(_PUPIL_RAD) - a, 0.7))


@lru_cache(maxsize=2)
def eyelid(upper: bool) -> Painted:
    """Return a lid of radius 1: a slice of a sphere from its edge at +x up (or down) and back.

    The edge is dark and has a lip that resembles lashes.
    """
    side = 1.0 if upper else -1.0
    sweep = np.concatenate(((0.0, 0.0), np.radians((1.6, 3.2, 4.0)), np.linspace(0.09, 2.1, 11)))
    reach = np.concatenate(((0.955, 1.028 if upper else 1.01), (1.022, 1.006, 1.0), np.ones(11)))
    across = np.linspace(pi, 0.0, 25)
    ring = reach[:, None] * np.sin(across)
    points = np.stack(
        (
            np.cos(sweep)[:, None] * ring,
            reach[:, None] * np.cos(across),
            side * np.sin(sweep)[:, None] * ring,
        ),
        axis=-1,
    )
    mesh = grid(points if upper else points[:, ::-1], closed=False)
    lash = np.array((1.0, 1.0, 1.0, 0.85, 0.25, *np.zeros(11))) * (1.0 if upper else 0.62)
    colours = np.broadcast_to(np.array(LID, float), points.shape)
    fold = np.exp(-(((sweep - 0.62) / 0.10) ** 2)) * 0.30 + np.clip(sweep - 0.9, 0.0, 0.2)
    colours = mix(colours, _SHADE, np.broadcast_to(fold[:, None], points.shape[:2]))
    colours = mix(colours, _LASH, np.broadcast_to(lash[:, None], points.shape[:2]))
    normals = smooth_normals(mesh)
    if not upper:
        # Lit as if it faced further up, like the skin below it.
        normals = normals + (0.3, 0.0, 0.5)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Painted(mesh, colours.reshape(-1, 3), normals)


@lru_cache(maxsize=1)
def ear() -> Painted:
    """Return a round ear of radius 1 that faces z."""
    profile = [(1.0, -0.6), (1.0, 0.18), (0.93, 0.30), (0.80, 0.34), (0.70, 0.30), (0.62, 0.16)]
    mesh = lathe([*profile, (0.30, 0.13), (0.0, 0.13)])
    radius = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
    accent = np.exp(-(((radius - 0.62) / 0.10) ** 2))
    return Painted(
        mesh, mix(uniform_colours(mesh, CAP), (64, 190, 220), accent), smooth_normals(mesh)
    )


@lru_cache(maxsize=1)
def neck() -> Painted:
    """Return a neck of bellows with length 1 along z and radius 1."""
    height = np.linspace(0.0, 1.0, 55)
    profile = [(1.0 + 0.05 * cos(18.0 * pi * h), h) for h in height]
    mesh = lathe(profile, around=28)
    groove = np.repeat(0.5 - 0.5 * np.cos(18.0 * pi * height), len(mesh.vertices) // 55)
    return Painted(mesh, mix(uniform_colours(mesh, (104, 110, 124)), (44, 47, 56), groove * 0.8),
                   smooth_normals(mesh))  # fmt: skip


@lru_cache(maxsize=1)
def bust() -> Painted:
    """Return shoulders of height 1 below z = 0, with a collar, in units of their height."""
    share = np.linspace(0.0, 1.0, 24)
    slope = 1.0 / (1.0 + np.exp(-(share - 0.42) / 0.085))
    half_x = 0.42 + 0.44 * slope - 0.10 * np.clip(share - 0.75, 0.0, 1.0)
    half_y = 0.46 + 1.20 * slope
    rows = [(0.0, 0.0, -0.12), (0.40, 0.44, -0.12), (0.40, 0.44, -0.02), (0.46, 0.50, 0.0)]
    rows += [(float(x), float(y), -float(s)) for x, y, s in zip(half_x, half_y, share, strict=True)]
    around = np.linspace(0.0, 2.0 * pi, 44, endpoint=False)
    points = np.array(
        [
            [(x * _superellipse(cos(a)), y * _superellipse(sin(a)), z) for a in around.tolist()]
            for x, y, z in rows[::-1]
        ]
    )
    mesh = grid(points, closed=True)
    ring = np.exp(-(((mesh.vertices[:, 2] + 0.02) / 0.035) ** 2))
    colours = mix(uniform_colours(mesh, (74, 84, 108)), (150, 160, 182), ring * 0.7)
    return Painted(mesh, colours, smooth_normals(mesh))


def _superellipse(value: float) -> float:
    """Push a circle's sine or cosine outwards, so that an ellipse becomes slightly box-shaped."""
    return float(np.sign(value) * abs(value) ** 0.82)

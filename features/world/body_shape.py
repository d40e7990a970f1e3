"""Meshes of bodies below the head: clothes, hands, shoes and gloves, one per segment.

Each mesh is in the frame of its segment (gazerig.features.world.figure) and follows from the
dimensions of its body. Sections are ellipses that a skin connects.
"""

from collections.abc import Mapping, Sequence
from math import cos, pi, radians, sin

import numpy as np

from gazerig.features.world.measures import ADULT_M, Measures
from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import (
    Colour,
    Mesh,
    Painted,
    merge_meshes,
    move_mesh,
    paint,
    stored_shape,
)
from gazerig.robot.description.people import SHIRTS, part_of

_AROUND = 18
_TROUSERS: Colour = (52, 60, 82)
_SHOES: Colour = (58, 50, 46)
_HAND_SCALE = 0.104
_WRIST = 0.74
_SHOE_M = 0.262
"""Length of the foot in the stored shoe."""

Row = tuple[float, float, float, float]
"""Height of a section, forward position of its centre, half its depth, half its width."""


def grid(points: Floats, *, closed: bool) -> Mesh:
    """Return the surface through points (rows, columns, 3); ``closed`` joins a row's ends."""
    rows, columns = points.shape[:2]
    row, column = np.mgrid[0 : rows - 1, 0 : columns if closed else columns - 1]
    right = (column + 1) % columns
    a, b = row * columns + column, row * columns + right
    c, d = (row + 1) * columns + right, (row + 1) * columns + column
    triangles = np.stack((a, b, c, a, c, d), axis=-1)
    return Mesh(points.reshape(-1, 3), triangles.reshape(-1, 3).astype(np.uint32))


def loft_surface(rows: Sequence[Row], around: int = _AROUND) -> Mesh:
    """Return a skin through sections from bottom to top, closed at both ends."""
    first, last = rows[0], rows[-1]
    closed = [(first[0], first[1], 1e-4, 1e-4), *rows, (last[0], last[1], 1e-4, 1e-4)]
    turn = np.linspace(0.0, 2.0 * pi, around, endpoint=False).tolist()
    points = [[(x + a * cos(w), b * sin(w), z) for w in turn] for z, x, a, b in closed]
    return grid(np.array(points), closed=True)


def _limb(
    rows: Sequence[tuple[float, float]], scale: float, length: float, high: float = 1.0
) -> Mesh:
    """Return a limb of round sections (share of its length below its joint, radius), rounded.

    Args:
        rows: sections from top to bottom.
        scale: factor of the radii.
        length: length from joint to joint, m.
        high: height of the rounding at the top as a multiple of a sphere's.
    """
    z0, r0 = rows[0]
    z1, r1 = rows[-1]
    ball = ((0.95, 0.3), (0.7, 0.7))
    top = [(high * r0 * scale * s - z0 * length, r0 * scale * c) for s, c in ball]
    low = [(-z1 * length - r1 * scale * s, r1 * scale * c) for s, c in ball]
    middle = [(-z * length, r * scale) for z, r in rows][::-1]
    return loft_surface([(z, 0.0, r, r) for z, r in (*low, *middle, *top[::-1])], 12)


def body_segments(body: Measures, look: int, number: int, gloves: bool) -> Mapping[str, Painted]:
    """Return the painted segments of a body, without those of the head.

    Args:
        body: its dimensions.
        look: its look, which determines the skin.
        number: number of the person, which determines the shirt.
        gloves: whether it wears boxing gloves.
    """
    k = body.stature_m / ADULT_M
    hand, shirt = part_of(look, "hand"), SHIRTS[number % len(SHIRTS)]
    r, g, b = hand.colours[0].tolist()
    skin = round(r), round(g), round(b)
    sleeve = skin if gloves else shirt
    upper = _limb(
        ((0.03, 0.046), (0.2, 0.049), (0.45, 0.045), (0.75, 0.041), (1.0, 0.040)),
        k,
        body.upper_arm_m,
        0.42,
    )
    fore = _limb(((0.0, 0.040), (0.25, 0.041), (0.7, 0.034), (0.96, 0.031)), k, body.forearm_m)
    thigh = _limb(((0.0, 0.086), (0.3, 0.082), (0.7, 0.067), (1.0, 0.058)), k, body.thigh_m)
    shank = _limb(((0.0, 0.058), (0.3, 0.060), (0.7, 0.048), (1.0, 0.044)), k, body.shank_m)
    pelvis = loft_surface([(z * k, x * k, a * k, b * k) for z, x, a, b in _PELVIS])
    found = {
        "pelvis": paint(pelvis, _TROUSERS),
        "torso": _shirt(shirt, k),
        "neck": paint(_neck(body.neck_m, k), _mix_colours(skin, (120, 60, 44), 0.18)),
    }
    right = move_mesh(stored_shape("glove"), scale=k) if gloves else _hand(hand, k)
    shoe = move_mesh(stored_shape("shoe"), scale=body.foot_m / _SHOE_M)
    for side in ("left", "right"):
        found[f"{side}_upper_arm"] = paint(upper, shirt)
        found[f"{side}_forearm"] = paint(fore, sleeve)
        found[f"{side}_hand"] = (
            right if side == "right" else move_mesh(right, scale=(1.0, -1.0, 1.0))
        )
        found[f"{side}_thigh"] = paint(thigh, _TROUSERS)
        found[f"{side}_shank"] = paint(shank, _TROUSERS)
        found[f"{side}_foot"] = paint(shoe.mesh, _SHOES)
    return found


_PELVIS: tuple[Row, ...] = (
    (-0.100, 0.0, 0.030, 0.050),
    (-0.085, 0.0, 0.056, 0.090),
    (-0.045, -0.006, 0.080, 0.150),
    (0.000, -0.010, 0.094, 0.164),
    (0.050, -0.004, 0.092, 0.158),
    (0.100, 0.0, 0.088, 0.144),
    (0.140, 0.0, 0.080, 0.130),
    (0.160, 0.0, 0.060, 0.100),
)
_TORSO: tuple[Row, ...] = (
    (-0.115, -0.014, 0.126, 0.182),
    (-0.055, -0.006, 0.114, 0.165),
    (0.040, 0.004, 0.106, 0.143),
    (0.130, 0.010, 0.114, 0.150),
    (0.210, 0.010, 0.118, 0.163),
    (0.275, 0.004, 0.110, 0.172),
    (0.325, -0.002, 0.098, 0.185),
    (0.350, -0.008, 0.088, 0.182),
    (0.364, -0.012, 0.078, 0.158),
    (0.375, -0.014, 0.070, 0.120),
    (0.384, -0.015, 0.064, 0.084),
    (0.390, -0.015, 0.061, 0.069),
)
_LEANS_M, _LEAN = 0.27, 0.52
"""Height from which the sections of a torso lean forward, and slope of the collar: the neck leaves
the body lower in front than behind."""


def _shirt(colour: Colour, k: float) -> Painted:
    from scipy.interpolate import PchipInterpolator  # imports SciPy only to build a mesh

    at = np.linspace(0.0, len(_TORSO) - 1.0, 3 * (len(_TORSO) - 1) + 1)
    smooth = PchipInterpolator(np.arange(len(_TORSO)), np.array(_TORSO))(at)
    mesh = loft_surface([(z, x, a, b) for z, x, a, b in smooth.tolist()], 28)
    points = mesh.vertices.copy()
    height = points[:, 2].copy()
    top = _TORSO[-1][0]
    share = np.clip((height - _LEANS_M) / (top - _LEANS_M), 0.0, 1.0)
    points[:, 2] -= _LEAN * share * share * (points[:, 0] + 0.015)
    shirt = paint(Mesh(points * k, mesh.faces), colour)
    pale = _mix_colours(colour, (255, 255, 255), 0.40)
    dark = _mix_colours(colour, (20, 20, 30), 0.35)
    colours = mix(shirt.colours, pale, _smooth_step(height - 0.3845, 0.002))
    return shirt._replace(colours=mix(colours, dark, 0.5 * _smooth_step(-height - 0.108, 0.004)))


def _neck(neck_m: float, k: float) -> Mesh:
    rows = [
        (-0.075, 0.000, 0.058), (-0.045, 0.000, 0.059), (-0.020, 0.0, 0.057),
        (0.35 * neck_m, 0.002, 0.054), (0.75 * neck_m, 0.003, 0.054), (neck_m + 0.03, 0.002, 0.056),
    ]  # fmt: skip
    return loft_surface([(z, x, r * k, 1.04 * r * k) for z, x, r in rows], 18)


def _hand(hand: Painted, k: float) -> Painted:
    """Return a right hand: hanging, its fingers down."""
    mesh, colours, normals = hand
    size, turn = _HAND_SCALE * k, np.array((1.0, -1.0, -1.0))
    # Fingers end bluntly, not in the point of an ellipsoid.
    u = np.clip((mesh.vertices[:, 2] - 0.45) / 0.55, 0.0, 0.99)
    blunt = np.minimum((1.0 - u**4) ** 0.25 / np.sqrt(1.0 - u**2), 1.9)[:, None]
    round_off = mesh.vertices * np.hstack([blunt, blunt, np.ones_like(blunt)])
    points = (round_off + (0.0, 0.0, _WRIST)) * size * turn
    return Painted(Mesh(points, mesh.faces), colours, normals * turn)


def _smooth_step(value: Floats, width: float) -> Floats:
    """Return 0 below and 1 above zero, with a smooth transition."""
    share = np.clip(0.5 + value / (2.0 * width), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def cup_shape() -> Painted:
    """Return a mug, relative to the middle of its height, z up."""
    rows = [(-0.048, 0.0, 0.030, 0.030), (0.048, 0.0, 0.040, 0.040)]
    mug = paint(loft_surface(rows, 24), (236, 232, 222))
    stripe = _smooth_step(0.014 - np.abs(mug.mesh.vertices[:, 2] + 0.048), 0.004)
    turn = np.linspace(-0.5 * pi, 0.5 * pi, 8)
    handle = np.stack([0.038 + 0.026 * np.cos(turn), 0 * turn, 0.028 * np.sin(turn)], axis=1)
    ring = [(0.006 * cos(w), 0.006 * sin(w)) for w in np.linspace(0, 2 * pi, 8, endpoint=False)]
    tube = [[(x, y + b, z + a) for a, b in ring] for x, y, z in handle.tolist()]
    grip = paint(grid(np.array(tube), closed=True), (196, 84, 60))
    return merge_meshes([mug._replace(colours=mix(mug.colours, (196, 84, 60), stripe)), grip])


def ball_shape() -> Painted:
    """Return a ball with stripes."""
    angles = [radians(d) for d in range(-90, 91, 12)]
    mesh = loft_surface([(0.06 * sin(a), 0.0, 0.06 * cos(a), 0.06 * cos(a)) for a in angles], 24)
    plain = paint(mesh, (220, 150, 40))
    stripe = _smooth_step(np.sin(5.0 * np.arctan2(mesh.vertices[:, 1], mesh.vertices[:, 0])), 0.3)
    return plain._replace(colours=mix(plain.colours, (60, 90, 170), stripe))


def _mix_colours(colour: Colour, other: Colour, share: float) -> Colour:
    r, g, b = (round(a + share * (o - a)) for a, o in zip(colour, other, strict=True))
    return r, g, b


def mix(colours: Floats, colour: Colour, share: Floats) -> Floats:
    """Blend colours (..., 3) towards one colour by fractions (...), clipped to 0..1."""
    part = np.clip(share, 0.0, 1.0)[..., None]
    return np.asarray(colours * (1.0 - part) + np.array(colour, float) * part)

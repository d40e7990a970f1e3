"""Rooms of a world as geoms of a MuJoCo model: walls, furniture, light."""

from math import cos, pi, sin
from typing import Any

import mujoco
import numpy as np

from gazerig.features.world.room import LIVING_ROOM, SEAT_M, SOFA_M, Place
from gazerig.features.world.room_paint import texture
from gazerig.gaze.types import Vec3
from gazerig.robot.description.mesh import Colour
from gazerig.robot.description.parts import FLOOR_M
from gazerig.sim_mock.scenes.script import SceneScript

_BOX, _CYLINDER = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
_ELLIPSOID, _CAPSULE = mujoco.mjtGeom.mjGEOM_ELLIPSOID, mujoco.mjtGeom.mjGEOM_CAPSULE
_CEILING: Colour = (238, 236, 230)
_GLOWS: dict[Colour | str, float] = {"window": 0.7, _CEILING: 0.42, (250, 232, 196): 0.18}
"""Pictures and colours that emit light; no lamp lights the ceiling."""
_TABLE_BELOW_M = 0.20
"""Height of the neck base on its plinth above the table's top."""

_AMBIENT, _WINDOW, _LAMP = 0.5, 0.44, 0.30
"""Levels of the light; none casts shadows, which cost time."""


def add_room(spec: Any, script: SceneScript) -> None:
    """Add the room of a script to a specification, with its light and the stand of the rig."""
    room = _Room(spec, -script.neck_height_m)
    {"living-room": _living_room, "gym": _gym, "hall": _hall}[script.room](room)
    _stand(room, script.room)
    _light(spec)


class _Room:
    """Adds geoms to the world; heights are above the floor."""

    def __init__(self, spec: Any, floor_m: float) -> None:
        self.spec, self.floor_m = spec, floor_m
        self.body = spec.worldbody.add_body(name="room")

    def box(
        self,
        middle: Vec3,
        size: Vec3,
        colour: Colour | str,
        yaw: float = 0.0,
        shine: float = 0.05,
        solid: bool = False,
        repeat: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """Add a box by its centre and full sizes, with a colour or the name of a picture."""
        quat = [cos(0.5 * yaw), 0.0, 0.0, sin(0.5 * yaw)]
        half = [0.5 * one for one in size]
        self._add(_BOX, middle, half, colour, shine, repeat, solid, quat=quat)

    def panel(
        self,
        middle: Vec3,
        facing: float,
        size: tuple[float, float],
        picture: Colour | str,
        thick: float = 0.02,
        shine: float = 0.02,
        repeat: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """Add an upright panel, width and height, that shows its picture on its front."""
        c, s = cos(facing), sin(facing)
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, np.array([-s, 0.0, c, c, 0.0, s, 0.0, 1.0, 0.0]))
        half = [0.5 * size[0], 0.5 * size[1], 0.5 * thick]
        self._add(_BOX, middle, half, picture, shine, repeat, quat=quat)

    def cylinder(
        self, foot: Vec3, radius: float, height: float, colour: Colour | str, shine: float = 0.1
    ) -> None:
        """Add an upright cylinder by the centre of its bottom."""
        x, y, z = foot
        self._add(_CYLINDER, (x, y, z + 0.5 * height), [radius, 0.5 * height, 0.0], colour, shine)

    def bush(self, middle: Vec3, size: Vec3, colour: Colour) -> None:
        """Add an ellipsoid by its centre and full sizes."""
        self._add(_ELLIPSOID, middle, [0.5 * one for one in size], colour, 0.02)

    def rod(self, start: Vec3, end: Vec3, radius: float, colour: Colour) -> None:
        """Add a rope or rail between two points."""
        fromto = [*start[:2], start[2] + self.floor_m, *end[:2], end[2] + self.floor_m]
        self._add(_CAPSULE, None, [radius, 0.0, 0.0], colour, 0.1, fromto=fromto)

    def _add(
        self, kind: Any, middle: Vec3 | None, size: list[float], colour: Colour | str, shine: float,
        repeat: tuple[float, float] = (1.0, 1.0), solid: bool = False, **pose: Any,
    ) -> None:  # fmt: skip
        """Add a geom with a material; only a solid one collides."""
        if middle is not None:
            pose["pos"] = [*middle[:2], middle[2] + self.floor_m]
        geom = self.body.add_geom(
            type=kind, size=size, contype=int(solid), conaffinity=int(solid), **pose
        )
        if isinstance(colour, str):
            name = f"room/{colour}-{repeat[0]:g}-{repeat[1]:g}"
        else:
            name = f"room/{colour[0]}-{colour[1]}-{colour[2]}-{shine:g}"
        geom.material = name
        if self.spec.material(name) is not None:
            return
        material = self.spec.add_material(name=name, specular=shine, shininess=0.3)
        material.emission = _GLOWS.get(colour, 0.0)
        if isinstance(colour, str):
            if self.spec.texture(f"room/{colour}") is None:
                image, flat = texture(colour), mujoco.mjtTexture.mjTEXTURE_2D
                made = self.spec.add_texture(name=f"room/{colour}", type=flat)
                made.height, made.width, made.nchannel = (*image.shape[:2], 3)
                made.data = image.tobytes()
            material.texrepeat = list(repeat)
            textures = list(material.textures)
            textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = f"room/{colour}"
            material.textures = textures
        else:
            material.rgba = [*(c / 255.0 for c in colour), 1.0]


_WOOD: Colour = (128, 92, 62)
_DARK_WOOD: Colour = (84, 58, 42)
_WHITE: Colour = (236, 234, 228)
_SOFA: Colour = (74, 100, 112)


def _living_room(room: _Room) -> None:
    """Build a room of 5.4 x 5.2 m with a door, a window, two chairs, a sofa and shelves."""
    high, back, left, right, rear = 2.55, 3.7, 2.6, -2.6, -1.7
    middle, deep = 0.5 * (back + rear), back - rear
    room.box((middle, 0.0, -0.02), (deep, left - right, 0.04), "planks", repeat=(4.0, 4.0))
    room.box((middle, 0.0, high + 0.02), (deep, left - right, 0.04), _CEILING)
    room.panel((back, 0.0, 0.5 * high), pi, (left - right, high), "wallpaper", repeat=(9.0, 5.0))
    room.panel((rear, 0.0, 0.5 * high), 0.0, (left - right, high), "plaster", repeat=(3.0, 2.0))
    room.panel((middle, right, 0.5 * high), 0.5 * pi, (deep, high), "plaster", repeat=(3.0, 2.0))
    # The left wall has a door of 0.95 m at x = 1.55, and a hallway behind it.
    for start, end in ((rear, 1.07), (2.03, back)):
        size = (end - start, high)
        room.panel((0.5 * (start + end), left, 0.5 * high), -0.5 * pi, size, "plaster")
    room.panel((1.55, left, 2.32), -0.5 * pi, (0.96, 0.47), "plaster")
    room.panel((1.55, 4.3, 1.9), -0.5 * pi, (4.0, 3.8), (196, 184, 164))
    room.box((1.55, 3.45, -0.02), (4.0, 1.7, 0.04), _DARK_WOOD)
    for x in (1.05, 2.05):
        room.box((x, left - 0.02, 1.04), (0.07, 0.06, 2.08), _WHITE)
    room.box((2.28, 3.02, 1.0), (0.05, 0.86, 2.0), (206, 196, 178), yaw=-0.5)
    # Pictures on the walls, and the window on the right.
    room.panel((1.35, right + 0.02, 1.45), 0.5 * pi, (1.5, 1.25), "window", shine=0.3)
    for x in (0.58, 1.35, 2.12):
        room.box((x, right + 0.045, 1.45), (0.05, 0.03, 1.35), _WHITE)
    room.box((1.35, right + 0.07, 0.79), (1.72, 0.16, 0.04), _WHITE)
    for x in (0.36, 2.34):
        room.box((x, right + 0.08, 1.32), (0.34, 0.08, 2.2), (178, 150, 112))
    room.panel((back - 0.03, 0.15, 1.62), pi, (0.95, 0.68), "landscape")
    room.panel((back - 0.03, 1.05, 1.55), pi, (0.50, 0.64), "shapes")
    room.panel((0.1, left - 0.03, 1.55), -0.5 * pi, (0.8, 0.58), "landscape")
    # Behind the head: visible to a person who looks at its face.
    room.panel((rear + 0.03, -0.8, 1.5), 0.0, (0.6, 0.78), "shapes")
    room.panel((rear + 0.03, 0.22, 1.42), 0.0, (1.0, 1.1), "window", shine=0.3)
    room.box((rear + 0.01, 0.22, 1.42), (0.03, 1.14, 1.24), _WHITE)
    _shelf(room, rear + 0.17, 1.95, 1.0)
    _shelf(room, back - 0.17, -1.65)
    room.box((2.62, 0.0, SOFA_M - 0.11), (0.86, 1.44, 0.20), "cloth", repeat=(4.0, 6.0))
    room.box((2.66, 0.0, 0.15), (0.80, 1.60, 0.22), _SOFA)
    room.box((2.98, 0.0, 0.52), (0.20, 1.70, 0.66), "cloth", repeat=(1.0, 6.0))
    for side in (0.80, -0.80):
        room.box((2.62, side, 0.32), (0.86, 0.16, 0.56), _SOFA)
    for name in ("chair_left", "chair_right"):
        _chair(room, LIVING_ROOM[name])
    room.box((2.05, 0.0, 0.003), (1.9, 2.5, 0.012), "rug")
    room.cylinder((3.3, -0.88, 0.0), 0.14, 0.02, _DARK_WOOD)
    room.cylinder((3.3, -0.88, 0.0), 0.014, 1.45, _DARK_WOOD)
    room.cylinder((3.3, -0.88, 1.40), 0.19, 0.26, (250, 232, 196))
    room.cylinder((3.2, 2.05, 0.0), 0.17, 0.34, (176, 106, 78))
    room.bush((3.2, 2.05, 0.62), (0.50, 0.56, 0.60), (70, 108, 62))
    room.bush((3.16, 1.97, 0.98), (0.36, 0.34, 0.46), (88, 128, 76))


def _shelf(room: _Room, x: float, y: float, ahead: float = -1.0) -> None:
    """Build shelves that face in the direction of the x axis, or the opposite direction."""
    room.box((x, y, 0.95), (0.32, 1.16, 1.9), _WOOD)
    room.panel((x + 0.17 * ahead, y, 0.96), 0.5 * pi * (1.0 - ahead), (1.08, 1.8), "books")


def _chair(room: _Room, place: Place) -> None:
    """Build a chair that faces in the direction of a person on it."""
    yaw, (x, y) = place.facing_rad, (place.x_m, place.y_m)
    c, s = cos(yaw), sin(yaw)

    def at(ahead: float, aside: float, z: float) -> Vec3:
        return x + ahead * c - aside * s, y + ahead * s + aside * c, z

    room.box(at(0.03, 0.0, SEAT_M - 0.03), (0.46, 0.46, 0.05), (186, 150, 96), yaw)
    room.box(at(-0.215, 0.0, 0.74), (0.03, 0.42, 0.26), _WOOD, yaw)
    for ahead in (0.22, -0.20):
        for aside in (0.20, -0.20):
            tall = SEAT_M - 0.05 if ahead > 0 else 0.87
            room.box(at(ahead, aside, 0.5 * tall), (0.04, 0.04, tall), _WOOD, yaw)


def _stand(room: _Room, name: str) -> None:
    """Build the base of the rig: a table and a plinth, in the gym a post."""
    above = -room.floor_m
    if name == "gym":
        room.cylinder((-0.05, 0.0, 0.0), 0.09, above + FLOOR_M, (60, 62, 70))
        room.box((-0.05, 0.0, 0.03), (0.5, 0.5, 0.06), (46, 48, 54))
        return
    top = above - _TABLE_BELOW_M
    room.cylinder((-0.02, 0.0, top), 0.07, _TABLE_BELOW_M + FLOOR_M, (72, 74, 80), 0.3)
    room.box((-0.10, 0.0, top - 0.02), (0.72, 1.30, 0.04), (150, 112, 76), 0.0, 0.15, True)
    for ahead in (-0.42, 0.22):
        for aside in (-0.60, 0.60):
            room.box((ahead, aside, 0.5 * (top - 0.04)), (0.05, 0.05, top - 0.04), _WOOD)


def _gym(room: _Room) -> None:
    """Build a ring of 3.6 m with ropes in a gym with brick walls."""
    high, back, half = 3.2, 4.2, 3.2
    room.box((1.2, 0.0, -0.12), (7.0, 2 * half, 0.04), (92, 90, 88))
    room.box((1.2, 0.0, high + 0.02), (7.0, 2 * half, 0.04), (120, 118, 114))
    tall, middle = high + 0.16, 0.5 * high - 0.08
    room.panel((back, 0.0, middle), pi, (2 * half, tall), "bricks", repeat=(4.0, 2.5))
    for side in (1.0, -1.0):
        facing = -side * 0.5 * pi
        room.panel((1.1, side * half, middle), facing, (6.3, tall), "bricks", repeat=(4.0, 2.5))
    room.panel((-2.0, 0.0, middle), 0.0, (2 * half, tall), "plaster", repeat=(3.0, 2.0))
    room.box((1.4, 0.0, -0.03), (3.7, 3.7, 0.06), "canvas")
    corners = ((3.1, 1.7), (3.1, -1.7), (-0.35, 1.7), (-0.35, -1.7))
    for k, (x, y) in enumerate(corners):
        tone: Colour = (186, 40, 44) if k % 2 else (44, 74, 150)
        room.cylinder((x, y, 0.0), 0.06, 1.35, tone)
    for z, tone in ((0.45, (228, 226, 220)), (0.85, (44, 74, 150)), (1.25, (186, 40, 44))):
        room.rod((3.1, 1.7, z), (3.1, -1.7, z), 0.018, tone)
        for side in (1.7, -1.7):
            room.rod((-0.35, side, z), (3.1, side, z), 0.018, tone)
    for y in (1.75, -0.35, -1.9):
        room.panel((back - 0.03, y, 1.9), pi, (0.85, 1.15), "poster")
    room.panel((back - 0.03, 0.75, 1.75), pi, (0.9, 0.66), "landscape")
    room.cylinder((3.75, 2.4, 0.75), 0.19, 1.05, (112, 60, 40))
    room.rod((3.75, 2.4, 1.8), (3.75, 2.4, 3.1), 0.012, (60, 60, 64))
    room.cylinder((3.6, -2.5, 0.0), 0.16, 0.9, (52, 84, 120))


def _hall(room: _Room) -> None:
    """Build an open hall with pillars and posters."""
    high, back, half = 3.4, 5.6, 5.0
    room.box((2.2, 0.0, -0.02), (9.6, 2 * half, 0.04), "tiles", repeat=(7.0, 8.0))
    room.box((2.2, 0.0, high + 0.02), (9.6, 2 * half, 0.04), _CEILING)
    room.panel((back, 0.0, 0.5 * high), pi, (2 * half, high), "plaster", repeat=(5.0, 2.0))
    room.panel((-2.4, 0.0, 0.5 * high), 0.0, (2 * half, high), "plaster", repeat=(5.0, 2.0))
    for side in (1.0, -1.0):
        facing = -side * 0.5 * pi
        for x, wide in ((0.15, 5.1), (4.95, 1.5)):
            room.panel((x, side * half * 0.7, 0.5 * high), facing, (wide, high), "plaster")
        room.panel((2.6, side * half, 0.5 * high), facing, (8.4, high), (190, 184, 172))
    for y, name in ((-2.3, "poster"), (-0.9, "shapes"), (0.5, "landscape"), (1.9, "poster")):
        room.panel((back - 0.03, y, 1.75), pi, (0.95, 1.15), name)
    for y in (-1.7, 1.7):
        room.cylinder((3.9, y, 0.0), 0.17, high, (204, 200, 192))
    room.box((4.9, 0.1, 0.23), (0.42, 1.6, 0.08), _WOOD)
    room.box((4.9, 0.1, 0.10), (0.30, 1.3, 0.18), _DARK_WOOD)
    room.cylinder((4.9, -2.9, 0.0), 0.22, 0.5, (150, 88, 66))
    room.bush((4.9, -2.9, 0.85), (0.80, 0.80, 0.80), (70, 108, 62))
    room.bush((4.85, -2.8, 1.35), (0.55, 0.50, 0.70), (88, 128, 76))
    for side in (1.0, -1.0):
        room.panel((1.0, side * (half * 0.7 - 0.03), 1.7), -side * 0.5 * pi, (0.9, 1.1), "shapes")


def _light(spec: Any) -> None:
    """Light the room: ambient light, and light from the window and the ceiling."""
    spec.visual.headlight.active = 1
    spec.visual.headlight.ambient = [_AMBIENT] * 3
    spec.visual.headlight.diffuse = [0.0] * 3
    spec.visual.headlight.specular = [0.0] * 3
    lights = [
        # name, position, direction, level of red, green and blue, specular
        ("window", [-0.6, -2.2, 1.3], [0.62, 0.62, -0.48], _WINDOW, 0.98, 0.93, 0.15),
        ("lamp", [0.5, 0.8, 1.5], [0.35, -0.45, -0.82], _LAMP, 0.97, 0.90, 0.05),
    ]  # fmt: skip
    for name, pos, direction, level, green, blue, specular in lights:
        spec.worldbody.add_light(
            name=f"room/{name}", type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, pos=pos,
            dir=direction, ambient=[0.0] * 3, diffuse=[level, green * level, blue * level],
            specular=[specular] * 3, castshadow=False,
        )  # fmt: skip

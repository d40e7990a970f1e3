"""People as bodies of a MuJoCo model: a mocap body per segment, with mesh and collision shapes."""

from typing import Any

import mujoco
import numpy as np

from gazerig.features.world.body_motion import SEGMENTS
from gazerig.features.world.figure import Figures
from gazerig.features.world.measures import ADULT_M, Measures
from gazerig.gaze.angles import scale
from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import (
    Painted,
    add_texture,
    merge_meshes,
    move_mesh,
    stored_shape,
)
from gazerig.robot.description.people import SHIRTS, part_of

SOLID_GROUP = 3
"""Group of the collision shapes, which pictures do not show."""
_GREY = 128.0
"""Colour of stored shapes that are dyed."""
_SPECULAR, _SHININESS = 0.12, 0.2


def add_people(spec: Any, figures: Figures) -> None:
    """Add the people of a script and their things to a specification.

    Bodies are mocap bodies with the names of ``figures.names``: their poses are set at every time.
    """
    gloves = {name: person.gloves for name, person in figures.script.people.items()}
    for name, shape in figure_shapes(figures).items():
        body = spec.worldbody.add_body(name=name, mocap=True)
        add_mesh(spec, body, name, shape)
        owner, _, segment = name.partition("/")
        if owner in gloves:
            _add_solid(body, segment, figures.measures[owner], gloves[owner])


def figure_shapes(figures: Figures) -> dict[str, Painted]:
    """Return the shape of every segment and thing in its own frame, in the order of the names."""
    found: dict[str, Painted] = {}
    for number, (name, person) in enumerate(figures.script.people.items()):
        body, shirt = figures.measures[name], np.array(SHIRTS[number % len(SHIRTS)], float)
        head = merge_meshes([part_of(person.look, part) for part in ("head", "face", "mouth")])
        parts = {"head": move_mesh(head, scale(body.skull_m, -1.0), body.head_scale)}
        for part in ("lips", "eye", "lid"):
            parts[part] = move_mesh(part_of(person.look, part), scale=body.head_scale)
        parts |= _below_the_head(person.look, shirt, body.stature_m / ADULT_M, person.gloves)
        for segment in SEGMENTS:
            either = segment.removeprefix("left_").removeprefix("right_")
            found[f"{name}/{segment}"] = parts[segment if segment in parts else either]
    for name, thing in figures.script.things.items():
        found[f"thing/{name}"] = stored_shape("cup" if thing.kind == "cup" else "striped_ball")
    return found


def _below_the_head(look: int, shirt: Floats, k: float, gloves: bool) -> dict[str, Painted]:
    """Return the segments of a body by their names, those without a side for both.

    Args:
        look: its look.
        shirt: colour of its shirt.
        k: its size relative to an adult's.
        gloves: whether it wears boxing gloves.
    """
    hand = part_of(look, "hanging_hand")
    colours = {"torso": shirt, "upper_arm": shirt, "throat": part_of(look, "neck").colours[0]}
    colours["forearm"] = hand.colours[0] if gloves else shirt
    parts = {
        name: move_mesh(stored_shape(name), scale=k)
        for name in ("torso", "throat", "pelvis", "upper_arm", "forearm", "thigh", "shank", "shoe")
    }
    for name, colour in colours.items():
        shades = parts[name].colours + (colour - _GREY)
        parts[name] = parts[name]._replace(colours=np.clip(shades, 0.0, 255.0))
    parts["neck"], parts["foot"] = parts["throat"], parts["shoe"]
    right = move_mesh(stored_shape("glove") if gloves else hand, scale=k)
    parts["right_hand"] = right
    parts["left_hand"] = move_mesh(right, scale=(1.0, -1.0, 1.0))
    return parts


class PeoplePlacer:
    """Sets the poses of people and things: the mocap poses of MuJoCo's data."""

    def __init__(self, model: Any, figures: Figures) -> None:
        self._figures = figures
        rows = [int(model.body_mocapid[model.body(name).id]) for name in figures.names]
        self._rows = np.array(rows, np.intp)

    def place(self, data: Any, t_s: float) -> None:
        """Set all poses for a time of the script."""
        found = self._figures.segments(t_s)
        data.mocap_pos[self._rows], data.mocap_quat[self._rows] = found.p_m, found.quat


def add_mesh(spec: Any, body: Any, name: str, shape: Painted) -> None:
    """Add a painted mesh without collisions to a body."""
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    material = spec.add_material(name=name, specular=_SPECULAR, shininess=_SHININESS)
    if np.ptp(shape.colours, axis=0).max() < 1.0:
        mesh.uservert = shape.mesh.vertices.ravel()
        mesh.userface = shape.mesh.faces.ravel()
        material.rgba = [*(shape.colours[0, :3] / 255.0), 1.0]
    else:
        skin = add_texture(shape)
        mesh.uservert, mesh.usernormal = skin.vertices.ravel(), skin.normals.ravel()
        mesh.userface, mesh.usertexcoord = skin.faces.ravel(), skin.uv.ravel()
        rows, columns = skin.image.shape[:2]
        texture = spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D)
        texture.width, texture.height, texture.nchannel = columns, rows, 3
        texture.data = skin.image[:, :, :3].tobytes()
        textures = list(material.textures)
        textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = name
        material.textures = textures
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=name,
        contype=0,
        conaffinity=0,
        group=1,
    )


def _add_solid(node: Any, segment: str, body: Measures, gloves: bool) -> None:
    """Add the collision shape of a segment; small segments have none."""
    k = body.stature_m / ADULT_M
    part = segment.split("_", 1)[-1]
    capsules = {
        "upper_arm": (body.upper_arm_m, 0.045 * k),
        "forearm": (body.forearm_m, 0.036 * k),
        "hand": (0.13 * k, 0.036 * k),
        "thigh": (body.thigh_m, 0.075 * k),
        "shank": (body.shank_m, 0.05 * k),
        "torso": (-0.30 * k, 0.125 * k),
    }
    kind, size, start = mujoco.mjtGeom.mjGEOM_CAPSULE, [0.0, 0.0, 0.0], None
    pos = [0.0, 0.0, 0.0]
    if segment == "head":
        kind, size, pos = mujoco.mjtGeom.mjGEOM_ELLIPSOID, [0.098, 0.078, 0.118], [-0.005, 0, 0.05]
    elif part == "hand" and gloves:
        kind, size, pos = mujoco.mjtGeom.mjGEOM_ELLIPSOID, [0.066, 0.074, 0.086], [0, 0, -0.09]
    elif part in capsules:
        length, radius = capsules[part]
        start, size = [0.0, 0.0, 0.0, 0.0, 0.0, -length], [radius, 0.0, 0.0]
    else:
        return
    shape = node.add_geom(type=kind, size=size, pos=pos, group=SOLID_GROUP, rgba=[1, 0, 0, 0.3])
    if start is not None:
        shape.fromto = start

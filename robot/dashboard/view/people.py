"""Draw the rig's detections: faces with their eight parts, moving bodies, the target."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import viser

from gazerig.gaze.types import PARTS, Face, Floats, Percept, Vec3
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_text import head_activity
from gazerig.robot.dashboard.view.glb import CLOTH, FLAT, SKIN, glow_disc, painted_glb
from gazerig.robot.dashboard.view.scene_node import rotation_to, set_pose, set_rotation
from gazerig.robot.description.mesh import Colour, stored_shape
from gazerig.robot.description.parts import FLOOR_M
from gazerig.robot.description.people import SHIRTS, head, part_of, torso
from gazerig.robot.model.face_geometry import PUPIL_DISTANCE_M
from gazerig.robot.model.frames import quaternion

FIXATED_WITHIN_M = 0.02
"""Largest distance of the target from its face part, m (parts are 3 cm apart or more)."""

_BODY: Colour = (118, 146, 190)
_TARGET: Colour = (255, 120, 40)
_CHEST_M = 0.34
_LABEL_ABOVE_M, _BEHIND_M, _HALO_M = 0.155, 0.11, 0.019
_LEFT_EYE, _RIGHT_EYE, _NOSE = (PARTS.index(part) for part in ("LE", "RE", "N"))


@lru_cache(maxsize=len(SHIRTS))
def _person_glb(number: int) -> tuple[bytes, bytes]:
    """Return the head and chest of a person as files for browsers."""
    return painted_glb(head(number), SKIN), painted_glb(torso(number, _CHEST_M), CLOTH)


class SeenBody(NamedTuple):
    """A moving body, world frame."""

    id: int
    kind: str
    p_world_m: Vec3
    radius_m: float


class _Shadow:
    """Dark spot on the floor below an object."""

    def __init__(self, scene: viser.SceneApi, name: str, radius_m: float) -> None:
        self._spot = scene.add_glb(
            name,
            painted_glb(glow_disc((20, 24, 34, 96)), FLAT),
            scale=radius_m,
            cast_shadow=False,
            receive_shadow=False,
        )

    def move_below(self, p_world_m: Vec3) -> None:
        set_pose(self._spot, (p_world_m[0], p_world_m[1], FLOOR_M + 0.002))

    def remove(self) -> None:
        self._spot.remove()


class _Person:
    """Person of a face: a head in the face's frame, and an upright chest."""

    def __init__(self, scene: viser.SceneApi, frame: str, face: Face) -> None:
        self._shade = _Shadow(scene, f"/shades/{face.id}", 0.3)
        shown, chest = _person_glb((face.id - 1) % len(SHIRTS))
        self._head = scene.add_glb(f"{frame}/head", shown, cast_shadow=False, receive_shadow=False)
        self._chest = scene.add_glb(
            f"/chests/{face.id}", chest, cast_shadow=False, receive_shadow=False
        )

    def show(self, face: Face, nose_m: Floats) -> None:
        """Move the person so that the nose is at its detected position."""
        (ahead, _, _), (aside, _, _), _ = face.R_world_face
        x, y, z = face.p_world_m
        self._shade.move_below((x - _BEHIND_M * ahead, y - _BEHIND_M * aside, z))
        set_pose(self._head, nose_m.tolist())
        set_pose(self._chest, face.p_world_m)
        set_rotation(self._chest, rotation_to((ahead, aside, 0.0)))

    def fit(self, size: float) -> None:
        """Scale the person by a factor relative to the usual size."""
        self._head.scale = self._chest.scale = size

    def remove(self) -> None:
        self._chest.remove()
        self._shade.remove()


class _FaceView:
    """Person in the scene, with a name and the parts of the face."""

    def __init__(self, scene: viser.SceneApi, face: Face) -> None:
        self._scene = scene
        self._name = f"/faces/{face.id}"
        self._frame = scene.add_frame(self._name, show_axes=False)
        self._shape = _Person(scene, self._name, face)
        self._size = 0.0
        self._parts: list[viser.FrameHandle] = []
        halo, faces = stored_shape("ring").mesh
        self._halo = scene.add_mesh_simple(
            f"{self._name}/halo", _HALO_M * halo, faces, color=_TARGET, side="double"
        )
        self._label = scene.add_label(
            f"{self._name}/label", face_label(face), anchor="bottom-center"
        )

    def show(self, face: Face, p_world_target_m: Vec3, parts: bool) -> None:
        """Move the person; ``parts``: mark the face's parts, with a halo at the fixated one."""
        set_pose(self._frame, face.p_world_m, quaternion(face.R_world_face))
        self._label.text = face_label(face)
        from_centre_m = np.array(face.parts_world_m) - face.p_world_m
        parts_m: Floats = (from_centre_m @ np.array(face.R_world_face)).round(3)
        size = float(np.linalg.norm(parts_m[_LEFT_EYE] - parts_m[_RIGHT_EYE])) / PUPIL_DISTANCE_M
        self._shape.show(face, parts_m[_NOSE])
        size = round(size, 2)
        if self._size != size:
            self._size = size
            self._shape.fit(size)
            self._label.position = (-0.09, 0.0, _LABEL_ABOVE_M * size)
        looked_at = fixated_part(face, p_world_target_m) if parts else None
        if parts and not self._parts:
            for part in PARTS:
                path = f"{self._name}/{part}"
                self._parts.append(self._scene.add_frame(path, show_axes=False))
                self._scene.add_icosphere(f"{path}/mark", radius=0.0042, color=_TARGET)
        for handle, p_m in zip(self._parts, parts_m.tolist(), strict=False):
            handle.visible = parts
            set_pose(handle, p_m)
        self._halo.visible = looked_at is not None
        if looked_at is not None:
            set_pose(self._halo, parts_m[looked_at] + (0.006, 0.0, 0.0))

    def remove(self) -> None:
        self._shape.remove()
        self._frame.remove()


class _BodyView:
    """Moving body in the scene: a hand or a ball, and its kind."""

    def __init__(self, scene: viser.SceneApi, body: SeenBody) -> None:
        name = f"/bodies/{body.id}"
        self._frame = scene.add_frame(name, show_axes=False)
        self.kind = body.kind
        self._shape: viser.GlbHandle | viser.IcosphereHandle
        if body.kind == "hand":
            data = painted_glb(part_of(0, "hand"), SKIN)
            self._shape = scene.add_glb(
                f"{name}/hand", data, cast_shadow=False, receive_shadow=False
            )
        else:
            self._shape = scene.add_icosphere(
                f"{name}/ball", radius=1.0, color=_BODY, opacity=0.85, cast_shadow=False
            )
        self._label = scene.add_label(f"{name}/label", body.kind, anchor="bottom-center")
        self._shade = _Shadow(scene, f"/shades/{body.id}", 2.0 * body.radius_m)

    def show(self, body: SeenBody) -> None:
        """Move the body; the palm of a hand faces the rig."""
        x, y, z = body.p_world_m
        set_pose(self._frame, body.p_world_m)
        set_rotation(self._frame, rotation_to((-x, -y, 0.0)))
        self._shade.move_below((x, y, z))
        self._shape.scale = round(body.radius_m, 3)
        set_pose(self._label, (0.0, 0.0, 1.1 * body.radius_m + 0.02))
        self._label.text = body.kind

    def remove(self) -> None:
        self._frame.remove()
        self._shade.remove()


class PeopleView:
    """All detections, and the target."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._faces: dict[int, _FaceView] = {}
        self._bodies: dict[int, _BodyView] = {}
        self._target = scene.add_frame("/target", show_axes=False)
        scene.add_icosphere("/target/point", radius=0.0055, color=_TARGET)
        self._label = scene.add_label(
            "/target/label", "", position=(0.0, 0.0, -0.03), anchor="top-center"
        )

    def show(self, tick: Tick, *, parts: bool = False, people: bool = True) -> None:
        """Draw the present detections, with parts of faces if selected; remove the others.

        Args:
            tick: tick of the rig.
            parts: whether to mark the parts of faces.
            people: whether to draw people and things, or only the target.
        """
        target_m, percept = tick.gaze.gaze_point_world_m, tick.percept if people else None
        faces = {face.id: face for face in (percept.faces if percept is not None else ())}
        bodies = {body.id: body for body in (seen_bodies(percept) if percept is not None else ())}
        for gone in self._faces.keys() - faces.keys():
            self._faces.pop(gone).remove()
        for gone in self._bodies.keys() - bodies.keys():
            self._bodies.pop(gone).remove()
        for face in faces.values():
            if face.id not in self._faces:
                self._faces[face.id] = _FaceView(self._scene, face)
            self._faces[face.id].show(face, target_m, parts)
        for body in bodies.values():
            shown = self._bodies.get(body.id)
            if shown is None or shown.kind != body.kind:
                if shown is not None:
                    shown.remove()
                self._bodies[body.id] = _BodyView(self._scene, body)
            self._bodies[body.id].show(body)
        set_pose(self._target, target_m)
        self._label.text = head_activity(tick).target


def seen_bodies(percept: Percept) -> tuple[SeenBody, ...]:
    """Return targets without a visible face: moving objects and people who are turned away."""
    bodies = percept.bodies
    faces = {face.id for face in percept.faces}
    return tuple(
        SeenBody(
            bodies.ids[i],
            "person" if kind == "face" else kind,
            tuple(bodies.p_world_m[i].tolist()),
            float(bodies.radius_m[i]),
        )
        for i, kind in enumerate(bodies.kinds)
        if bodies.ids[i] not in faces
    )


def face_label(face: Face) -> str:
    """Return the label of a face, e.g. "face 3, looks at the head, speaks"."""
    looks = ", looks at the head" if face.looks_at_head else ""
    speaks = ", speaks" if face.speaks else ""
    return f"face {face.id}{looks}{speaks}"


def fixated_part(face: Face, p_world_target_m: Vec3) -> int | None:
    """Return the row of the target's face part, None if the target is on no part."""
    away_m = np.linalg.norm(np.array(face.parts_world_m) - p_world_target_m, axis=1)
    nearest = int(away_m.argmin())
    return nearest if away_m[nearest] < FIXATED_WITHIN_M else None

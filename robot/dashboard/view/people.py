"""Draw what the rig has detected: people, moving bodies, and the target."""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import viser

from gazerig.gaze.types import PARTS, Face, Percept, Vec3
from gazerig.robot.dashboard.view.glb import CLOTH, FLAT, SKIN, glow_disc, painted_glb
from gazerig.robot.dashboard.view.scene_node import rotation_to, set_pose
from gazerig.robot.description.links import FLOOR_M
from gazerig.robot.description.mesh import Colour
from gazerig.robot.description.people import SHIRTS, head, part_of, torso
from gazerig.robot.loop.head_state import head_state
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.face_geometry import PUPIL_DISTANCE_M
from gazerig.robot.model.frames import quaternion

_BODY: Colour = (118, 146, 190)
_TARGET: Colour = (255, 120, 40)
_CHEST_M = 0.34
_LABEL_ABOVE_M, _BEHIND_M = 0.155, 0.11
_LEFT_EYE, _RIGHT_EYE, _NOSE = (PARTS.index(part) for part in ("LE", "RE", "N"))


@lru_cache(maxsize=len(SHIRTS))
def _person_glb(number: int) -> tuple[bytes, bytes]:
    return painted_glb(head(number), SKIN), painted_glb(torso(number, _CHEST_M), CLOTH)


def _add(scene: viser.SceneApi, name: str, data: bytes) -> viser.GlbHandle:
    return scene.add_glb(name, data, cast_shadow=False, receive_shadow=False)


class SeenBody(NamedTuple):
    """A moving body, world frame."""

    id: int
    kind: str
    p_world_m: Vec3
    radius_m: float


_SHADOW_M = FLOOR_M + 0.002
"""Height of shadows, a little above the floor."""


def _add_shadow(scene: viser.SceneApi, id: int, radius_m: float) -> viser.GlbHandle:
    """Add a dark spot on the floor."""
    spot = _add(scene, f"/shades/{id}", painted_glb(glow_disc((20, 24, 34, 96)), FLAT))
    spot.scale = radius_m
    return spot


class _PersonView:
    """Person in the scene: a head in the face's frame, an upright chest, and a name."""

    def __init__(self, scene: viser.SceneApi, face: Face) -> None:
        name = f"/faces/{face.id}"
        self._frame = scene.add_frame(name, show_axes=False)
        self._shade = _add_shadow(scene, face.id, 0.3)
        shown, chest = _person_glb((face.id - 1) % len(SHIRTS))
        self._head = _add(scene, f"{name}/head", shown)
        self._chest = _add(scene, f"/chests/{face.id}", chest)
        self._size = 0.0
        self._label = scene.add_label(f"{name}/label", face_label(face), anchor="bottom-center")

    def show(self, face: Face) -> None:
        """Move the person so that the nose is at its detected position."""
        set_pose(self._frame, face.p_world_m, quaternion(face.R_world_face))
        self._label.text = face_label(face)
        from_centre_m = np.array(face.parts_world_m) - face.p_world_m
        parts_m = (from_centre_m @ np.array(face.R_world_face)).round(3)
        (ahead, _, _), (aside, _, _), _ = face.R_world_face
        x, y, _ = face.p_world_m
        set_pose(self._shade, (x - _BEHIND_M * ahead, y - _BEHIND_M * aside, _SHADOW_M))
        set_pose(self._head, parts_m[_NOSE].tolist())
        set_pose(self._chest, face.p_world_m, rotation_to((ahead, aside, 0.0)))
        apart_m = float(np.linalg.norm(parts_m[_LEFT_EYE] - parts_m[_RIGHT_EYE]))
        size = round(apart_m / PUPIL_DISTANCE_M, 2)
        if self._size != size:
            self._size = self._head.scale = self._chest.scale = size
            self._label.position = (-0.09, 0.0, _LABEL_ABOVE_M * size)

    def remove(self) -> None:
        for part in (self._chest, self._shade, self._frame):
            part.remove()


class _BodyView:
    """Moving body in the scene: a hand or a ball, and its kind."""

    def __init__(self, scene: viser.SceneApi, body: SeenBody) -> None:
        name = f"/bodies/{body.id}"
        self._frame = scene.add_frame(name, show_axes=False)
        self._shape: viser.GlbHandle | viser.IcosphereHandle
        if body.kind == "hand":
            self._shape = _add(scene, f"{name}/hand", painted_glb(part_of(0, "hand"), SKIN))
        else:
            self._shape = scene.add_icosphere(
                f"{name}/ball", radius=1.0, color=_BODY, opacity=0.85, cast_shadow=False
            )
        self._label = scene.add_label(f"{name}/label", body.kind, anchor="bottom-center")
        self._shade = _add_shadow(scene, body.id, 2.0 * body.radius_m)

    def show(self, body: SeenBody) -> None:
        """Move the body; the palm of a hand faces the rig."""
        x, y, _ = body.p_world_m
        set_pose(self._frame, body.p_world_m, rotation_to((-x, -y, 0.0)))
        set_pose(self._shade, (x, y, _SHADOW_M))
        self._shape.scale = round(body.radius_m, 3)
        set_pose(self._label, (0.0, 0.0, 1.1 * body.radius_m + 0.02))

    def remove(self) -> None:
        self._frame.remove()
        self._shade.remove()


class PeopleView:
    """All detections, and the target."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._views: dict[tuple[str, int], Any] = {}  # kind and number -> view
        self._target = scene.add_frame("/target", show_axes=False)
        scene.add_icosphere("/target/point", radius=0.0055, color=_TARGET)
        self._label = scene.add_label(
            "/target/label", "", position=(0.0, 0.0, -0.03), anchor="top-center"
        )

    def show(self, tick: Tick, *, people: bool = True) -> None:
        """Draw the present detections and remove the others; ``people``: not only the target."""
        target_m, percept = tick.gaze.gaze_point_world_m, tick.percept if people else None
        found: dict[tuple[str, int], Face | SeenBody] = {}
        if percept is not None:
            found = {("face", face.id): face for face in percept.faces}
            found |= {(body.kind, body.id): body for body in seen_bodies(percept)}
        for gone in self._views.keys() - found.keys():
            self._views.pop(gone).remove()
        for key, one in found.items():
            if key not in self._views:
                kind: Any = _PersonView if isinstance(one, Face) else _BodyView
                self._views[key] = kind(self._scene, one)
            self._views[key].show(one)
        set_pose(self._target, target_m)
        self._label.text = head_state(tick).gaze.target


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

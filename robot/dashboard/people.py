"""Draw who and what the rig has seen: faces with their eight parts, moving bodies, the target."""

import numpy as np
import viser

from gazerig.gaze.types import PARTS, Floats, Vec3
from gazerig.robot.dashboard.head_view import FLOOR_M, Colour
from gazerig.robot.dashboard.mesh import Mesh, cap, disc, ellipsoid, ring
from gazerig.robot.dashboard.scene_node import put, quaternion
from gazerig.robot.model.types import SeenBody, SeenFace, Snapshot

FIXATED_WITHIN_M = 0.02
"""A face part this close to the target is the one looked at (parts are 3 cm apart or more)."""

_SKIN: Colour = (224, 172, 140)
_BODY: Colour = (86, 130, 230)
_TARGET: Colour = (255, 120, 40)
_OVAL_DEPTH_M = 0.085
_OVAL_WIDER = 1.25

# What stands for each part: half axes in m (out of the face, across, up) and colour.
_EYE = ((0.006, 0.0135, 0.0085), (255, 255, 255))
_DOT = ((0.004, 0.004, 0.004), (130, 84, 62))
_SHAPES: dict[str, tuple[Vec3, Colour]] = {
    "LE": _EYE,
    "RE": _EYE,
    "M": ((0.006, 0.023, 0.0065), (176, 66, 66)),
    "N": ((0.012, 0.009, 0.014), (206, 146, 112)),
}


class _Shade:
    """A dark spot on the floor, which tells where above it something is."""

    def __init__(self, scene: viser.SceneApi, name: str, radius_m: float) -> None:
        mesh = disc(radius_m)
        self._spot = scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=(40, 50, 70), opacity=0.16, side="double"
        )

    def below(self, p_world_m: Vec3) -> None:
        put(self._spot, (p_world_m[0], p_world_m[1], FLOOR_M + 0.001))

    def remove(self) -> None:
        self._spot.remove()


class _FaceView:
    """One face in the scene, in its own frame: x out of the face, y to its left, z up."""

    def __init__(self, scene: viser.SceneApi, face: SeenFace) -> None:
        self._scene = scene
        self._name = f"/faces/{face.id}"
        self._frame = scene.add_frame(self._name, show_axes=False)
        self._shade = _Shade(scene, f"/shades/{face.id}", 0.075)
        parts_m = _parts_in_face(face)
        self._add_oval(parts_m)
        self._parts = [self._add_part(part) for part in PARTS]
        self._halo = self._add("halo", ring(0.019, 0.0022), _TARGET)
        top_m = (0.0, 0.0, float(parts_m[:, 2].max()) + 0.035)
        self._label = scene.add_label(
            f"{self._name}/label", face_label(face), position=top_m, anchor="bottom-center"
        )

    def _add(self, name: str, mesh: Mesh, colour: Colour) -> viser.MeshHandle:
        return self._scene.add_mesh_simple(
            f"{self._name}/{name}", mesh.vertices, mesh.faces, color=colour, side="double"
        )

    def _add_oval(self, parts_m: Floats) -> None:
        """Fit an oval around the parts that passes behind the front ones; the sides lie in it."""
        highest, lowest = parts_m.max(axis=0), parts_m.min(axis=0)
        _, y, z = (highest + lowest) / 2
        _, half_y, half_z = (highest - lowest) / 2 * _OVAL_WIDER
        out = ((parts_m[:, 1] - y) / half_y) ** 2 + ((parts_m[:, 2] - z) / half_z) ** 2
        rise = np.sqrt(np.maximum(0.0, 1.0 - out))
        behind = parts_m[:, 0] - _OVAL_DEPTH_M * rise
        x = float(min(behind[i] for i, part in enumerate(PARTS) if part not in ("FL", "FR")))
        oval = self._add("oval", ellipsoid((_OVAL_DEPTH_M, half_y, half_z), rings=25), _SKIN)
        oval.position = (x, y, z)

    def _add_part(self, part: str) -> viser.FrameHandle:
        frame = self._scene.add_frame(f"{self._name}/{part}", show_axes=False)
        half_axes_m, colour = _SHAPES.get(part, _DOT)
        self._add(f"{part}/shape", ellipsoid(half_axes_m), colour)
        if part in ("LE", "RE"):
            pupil = self._add(f"{part}/pupil", cap(0.0052, np.pi), (40, 26, 20))
            pupil.position = (0.0035, 0.0, 0.0)
        return frame

    def show(self, face: SeenFace, p_world_target_m: Vec3) -> None:
        """Move the face and put the halo around the part that is looked at."""
        put(self._frame, face.p_world_m, quaternion(face.R_world_face))
        self._shade.below(face.p_world_m)
        self._label.text = face_label(face)
        parts_m = _parts_in_face(face)
        for handle, p_m in zip(self._parts, parts_m.tolist(), strict=True):
            put(handle, p_m)
        looked_at = fixated_part(face, p_world_target_m)
        self._halo.visible = looked_at is not None
        if looked_at is not None:
            put(self._halo, parts_m[looked_at] + (0.006, 0.0, 0.0))

    def remove(self) -> None:
        self._frame.remove()
        self._shade.remove()


class _BodyView:
    """One moving body in the scene: a ball and its kind."""

    def __init__(self, scene: viser.SceneApi, body: SeenBody) -> None:
        name = f"/bodies/{body.id}"
        self._frame = scene.add_frame(name, show_axes=False)
        self._ball = scene.add_icosphere(f"{name}/ball", radius=1.0, color=_BODY, opacity=0.75)
        self._label = scene.add_label(f"{name}/label", body.kind, anchor="bottom-center")
        self._shade = _Shade(scene, f"/shades/{body.id}", body.radius_m)

    def show(self, body: SeenBody) -> None:
        """Move the ball."""
        put(self._frame, body.p_world_m)
        self._shade.below(body.p_world_m)
        self._ball.scale = round(body.radius_m, 3)
        put(self._label, (0.0, 0.0, body.radius_m + 0.02))
        self._label.text = body.kind

    def remove(self) -> None:
        self._frame.remove()
        self._shade.remove()


class PeopleView:
    """Everything seen, and the target."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._faces: dict[int, _FaceView] = {}
        self._bodies: dict[int, _BodyView] = {}
        self._target = scene.add_frame("/target", show_axes=False)
        scene.add_icosphere("/target/point", radius=0.0055, color=_TARGET)
        self._label = scene.add_label(
            "/target/label", "", position=(0.0, 0.0, -0.03), anchor="top-center"
        )

    def show(self, snapshot: Snapshot) -> None:
        """Draw what is there now; what has gone is taken away."""
        faces = {face.id: face for face in snapshot.faces}
        # A face is drawn as a face, not once more as a ball.
        bodies = {body.id: body for body in snapshot.bodies if body.id not in faces}
        for gone in self._faces.keys() - faces.keys():
            self._faces.pop(gone).remove()
        for gone in self._bodies.keys() - bodies.keys():
            self._bodies.pop(gone).remove()
        for face in faces.values():
            if face.id not in self._faces:
                self._faces[face.id] = _FaceView(self._scene, face)
            self._faces[face.id].show(face, snapshot.p_world_target_m)
        for body in bodies.values():
            if body.id not in self._bodies:
                self._bodies[body.id] = _BodyView(self._scene, body)
            self._bodies[body.id].show(body)
        put(self._target, snapshot.p_world_target_m)
        self._label.text = snapshot.target_name


def face_label(face: SeenFace) -> str:
    """Return what stands above a face, e.g. "face 3, looks at the head, speaks"."""
    looks = ", looks at the head" if face.looks_at_head else ""
    speaks = ", speaks" if face.speaks else ""
    return f"face {face.id}{looks}{speaks}"


def fixated_part(face: SeenFace, p_world_target_m: Vec3) -> int | None:
    """Return the row of the part that the target lies on, or None where it lies on none."""
    away_m = np.linalg.norm(np.array(face.parts_world_m) - p_world_target_m, axis=1)
    nearest = int(away_m.argmin())
    return nearest if away_m[nearest] < FIXATED_WITHIN_M else None


def _parts_in_face(face: SeenFace) -> Floats:
    """Return the parts (8, 3) in the face's frame, to the millimetre."""
    from_centre_m = np.array(face.parts_world_m) - face.p_world_m
    in_face_m: Floats = from_centre_m @ np.array(face.R_world_face)
    return in_face_m.round(3)

"""Layers of the page's scene around the rig: desired pose, camera, fields of the eyes."""

from math import atan, radians, tan
from typing import NamedTuple

import numpy as np
import viser

from gazerig.gaze.angles import rotate_back, sub
from gazerig.gaze.field_of_view import FIELD_DEG
from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.feed.live_feed import OverlayChoices
from gazerig.robot.dashboard.view.head_view import LidEdges
from gazerig.robot.dashboard.view.scene_node import pitch_up, rotation_to, set_pose
from gazerig.robot.description.mesh import Colour, Mesh, stored_shape
from gazerig.robot.description.parts import EYE_RADIUS, SIDES, measures_of
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import CommandedPose, Snapshot


class OverlayPanel:
    """Layers of the scene."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._commanded_pose = CommandedPoseView(scene)
        self._camera = CameraField(scene)
        self._eyes = EyeFields(scene)

    def show(self, snapshot: Snapshot, layers: OverlayChoices, edges: LidEdges) -> None:
        """Draw the selected layers and remove the others."""
        self._commanded_pose.show(snapshot if layers.ghost else None, edges)
        self._camera.show(snapshot if layers.camera else None)
        self._eyes.show(snapshot if layers.eyes else None)


_CAMERA: Colour = (120, 128, 140)
_FIELD: dict[str, Colour] = {"left": (20, 150, 120), "right": (190, 90, 30)}
_DEPTH_M = 0.12
"""Distance of the drawn frame from the camera, m."""
_RADIUS_M = 0.22
"""Distance of the drawn edge of the field from the eye, m."""
_AROUND = 72


class CameraField:
    """Camera as a pyramid with the angles of its image."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._shape: tuple[float, float] | None = None
        self._frustum: viser.CameraFrustumHandle | None = None

    def show(self, snapshot: Snapshot | None) -> None:
        """Move it to the camera; hide it without a snapshot or a camera."""
        camera = snapshot.camera if snapshot is not None else None
        if camera is None:
            if self._frustum is not None:
                self._frustum.visible = False
            return
        shape = (round(camera.horizontal_rad, 4), round(camera.aspect, 4))
        if self._frustum is None or shape != self._shape:
            horizontal_rad, aspect = self._shape = shape
            self._frustum = self._scene.add_camera_frustum(  # replaces one of another shape
                "/camera",
                fov=2.0 * atan(tan(horizontal_rad / 2.0) / aspect),
                aspect=aspect,
                scale=_DEPTH_M,
                thickness=1.0,
                thickness_units="screen",
                color=_CAMERA,
                cast_shadow=False,
                receive_shadow=False,
            )
        self._frustum.visible = True
        set_pose(self._frustum, camera.p_world_camera_m, quaternion(camera.R_world_camera))


class EyeFields:
    """Edge of each eye's field of attention, which rotates with the eye."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._frames = tuple(
            scene.add_frame(f"/field_{side}", show_axes=False, visible=False) for side in _FIELD
        )
        for side, colour in _FIELD.items():
            edge = field_edge(left=side == "left")
            around = np.stack((edge, np.roll(edge, -1, axis=0)), axis=1)
            spokes = np.stack((np.zeros((4, 3)), edge[:: _AROUND // 4]), axis=1)
            scene.add_line_segments(
                f"/field_{side}/edge",
                np.concatenate((around, spokes)),
                colour,
                thickness=1.2,
                thickness_units="screen",
            )

    def show(self, snapshot: Snapshot | None) -> None:
        """Rotate the fields with the eyes; hide them without a snapshot."""
        for frame in self._frames:
            frame.visible = snapshot is not None
        if snapshot is None:
            return
        sides = zip(self._frames, snapshot.p_world_eyes_m, snapshot.gaze_world, strict=True)
        for frame, p_world_m, gaze_world in sides:
            set_pose(frame, p_world_m, rotation_to(gaze_world))


def field_edge(*, left: bool) -> Floats:
    """Return points (72, 3) on the edge of an eye's field in the eye's frame, x ahead, in metres.

    Between two of its limits the edge is a quarter of an ellipse (gazerig.gaze.field_of_view).
    """
    temporal, nasal, up, down = np.radians(FIELD_DEG)
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND  # from the left, towards above
    side, high = np.cos(turn), np.sin(turn)
    to_side = np.where((side > 0.0) == left, temporal, nasal)
    away = 1.0 / np.hypot(side / to_side, high / np.where(high > 0.0, up, down))
    return _RADIUS_M * np.column_stack((np.cos(away), np.sin(away) * side, np.sin(away) * high))


_GHOST: Colour = (70, 110, 255)
_SIGHT = 5.6  # length of its lines of sight, in distances between the eyes
_IRIS_RAD = radians(29.0)
_APART = radians(1.5)  # of the head's axes: less would only tint the rig's own shell


class _CommandedEye(NamedTuple):
    side: str
    ball: viser.FrameHandle
    upper: viser.FrameHandle
    lower: viser.FrameHandle


class CommandedPoseView:
    """Ghost of the desired pose in the scene."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        # Elements with a size, and their distance ahead in their frame, in eye distances.
        self._sized: list[tuple[viser.MeshHandle | viser.LineSegmentsHandle, float]] = []
        self._frame = scene.add_frame("/ghost", show_axes=False, visible=False)
        self._shell = self._add("/ghost/shell", stored_shape("shell").mesh, 0.2)
        self._eyes = [self._add_eye(side) for side in SIDES]
        self._joints: tuple[str, ...] = ()
        self._unit = 0.0

    def _add(self, name: str, mesh: Mesh, opacity: float, x: float = 0.0) -> viser.MeshHandle:
        handle = self._scene.add_mesh_simple(
            name,
            mesh.vertices,
            mesh.faces,
            color=_GHOST,
            opacity=opacity,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._sized.append((handle, x))
        return handle

    def _add_eye(self, side: str) -> _CommandedEye:
        """Add a ring for the iris with a line of sight, and the edges of the lids."""
        name = f"/ghost/eye_{side}"
        ball = self._scene.add_frame(name, show_axes=False)
        iris, faces = stored_shape("ring").mesh
        iris = iris * (1.12 * EYE_RADIUS * float(np.sin(_IRIS_RAD)))
        ahead = 1.12 * EYE_RADIUS * float(np.cos(_IRIS_RAD))
        self._add(f"{name}/iris", Mesh(iris, faces), 0.8, ahead)
        line = np.array((((EYE_RADIUS, 0.0, 0.0), (_SIGHT, 0.0, 0.0)),))
        sight = self._scene.add_line_segments(
            f"{name}/sight", line, _GHOST, thickness=1.0, thickness_units="screen"
        )
        self._sized.append((sight, 0.0))
        upper, lower = (
            self._scene.add_frame(f"/ghost/{name}_{side}", show_axes=False)
            for name in ("lid", "lower_lid")
        )
        for frame, which in ((upper, "upper"), (lower, "lower")):
            self._add(f"{frame.name}/edge", stored_shape(f"{which}_lid_edge").mesh, 0.45)
        return _CommandedEye(side, ball, upper, lower)

    def show(self, snapshot: Snapshot | None, edges: LidEdges) -> None:
        """Move the drawing to the desired pose; hide it if there is no snapshot or no such pose."""
        ghost = snapshot.commanded_pose if snapshot is not None else None
        self._frame.visible = ghost is not None
        if snapshot is not None and ghost is not None:
            if snapshot.joints != self._joints:
                self._joints = snapshot.joints
                for eye in self._eyes:  # only lids that a joint moves
                    eye.upper.visible = f"{eye.side}_upper_lid" in self._joints
                    eye.lower.visible = f"{eye.side}_lower_lid" in self._joints
            turned = np.array(ghost.R_world_head) - np.array(snapshot.R_world_head)
            self._shell.visible = float(np.abs(turned).max()) > _APART
            self._move(ghost, edges)

    def _move(self, ghost: CommandedPose, edges: LidEdges) -> None:
        R, p_world_head_m = ghost.R_world_head, ghost.p_world_head_m
        set_pose(self._frame, p_world_head_m, quaternion(R))
        sides = zip(
            self._eyes,
            ghost.p_world_eyes_m,
            ghost.gaze_world,
            ghost.lids,
            ghost.lower_lids or (1.0, 1.0),
            strict=True,
        )
        unit = measures_of(*ghost.p_world_eyes_m).interocular_m
        if unit != self._unit:
            self._unit = unit
            for part, x in self._sized:
                part.scale = unit
                part.position = (x * unit, 0.0, 0.0)
        for eye, p_world_m, gaze_world, opening, lower in sides:
            p_head_m = rotate_back(R, sub(p_world_m, p_world_head_m))
            set_pose(eye.ball, p_head_m, rotation_to(rotate_back(R, gaze_world)))
            for frame, which, so_far in (
                (eye.upper, "upper", opening),
                (eye.lower, "lower", lower),
            ):
                edge_rad = edges.elevation_rad(f"{eye.side}_{which}_lid", so_far)
                set_pose(frame, p_head_m, pitch_up(edge_rad))

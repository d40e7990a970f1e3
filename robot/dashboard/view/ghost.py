"""Ghost of the desired pose in the page's scene."""

from math import radians

import numpy as np
import viser

from gazerig.gaze.angles import rotate_back, sub
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.robot.dashboard.feed.rig_feed import ShownHead
from gazerig.robot.dashboard.view.scene_node import rotation_to, set_pose
from gazerig.robot.description.mesh import Colour, Mesh, stored_shape
from gazerig.robot.description.parts import EYE_RADIUS, SIDES, measures_of
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import JointState

_GHOST: Colour = (70, 110, 255)
_SIGHT = 5.6  # length of its lines of sight, in distances between the eyes
_IRIS_RAD = radians(29.0)
_APART = radians(1.5)  # of the head's axes: less would only tint the rig's own shell


class CommandedPoseView:
    """Ghost of the desired pose in the scene."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        # Elements with a size, and their distance ahead in their frame, in eye distances.
        self._sized: list[tuple[viser.MeshHandle | viser.LineSegmentsHandle, float]] = []
        self._frame = scene.add_frame("/ghost", show_axes=False, visible=False)
        self._shell = self._add("/ghost/shell", stored_shape("shell").mesh, 0.2)
        self._eyes = [self._add_eye(side) for side in SIDES]
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

    def _add_eye(self, side: str) -> viser.FrameHandle:
        """Add a ring for the iris with a line of sight; return their frame."""
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
        return ball

    def show(self, head: ShownHead | None) -> None:
        """Move the drawing to the desired pose; hide it without a head."""
        self._frame.visible = head is not None
        if head is None:
            return
        desired_rad = head.tick.desired_rad
        at_rest = (0.0,) * len(desired_rad)
        ghost = head.rig.kinematics.forward(JointState(desired_rad, at_rest, at_rest, ()))
        R, p_world_head_m = ghost.R_world_head, ghost.p_world_head_m
        turned = np.array(R) - np.array(head.tick.pose.R_world_head)
        self._shell.visible = float(np.abs(turned).max()) > _APART
        set_pose(self._frame, p_world_head_m, quaternion(R))
        eyes = ghost.p_world_eye_left_m, ghost.p_world_eye_right_m
        unit = measures_of(*eyes).interocular_m
        if unit != self._unit:
            self._unit = unit
            for part, x in self._sized:
                part.scale = unit
                part.position = (x * unit, 0.0, 0.0)
        for ball, p_world_m, left in zip(self._eyes, eyes, (True, False), strict=True):
            p_head_m = rotate_back(R, sub(p_world_m, p_world_head_m))
            set_pose(ball, p_head_m, rotation_to(rotate_back(R, line_of_sight(ghost, left))))

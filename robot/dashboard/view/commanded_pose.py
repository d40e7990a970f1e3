"""Draw head and eyes at the desired angles, translucent, over the measured pose."""

from math import radians
from typing import NamedTuple

import numpy as np
import viser

from gazerig.gaze.angles import rotate_back, sub
from gazerig.robot.dashboard.view.lid_edges import LidEdges
from gazerig.robot.dashboard.view.scene_node import along, put, turned_up
from gazerig.robot.description.build import SIDES
from gazerig.robot.description.head_shape import EYE_RADIUS, measures_of, surface
from gazerig.robot.description.mesh import Mesh, grid, lid, ring
from gazerig.robot.description.paint import Colour
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import CommandedPose, Snapshot

_GHOST: Colour = (70, 110, 255)
_SIGHT = 5.6  # length of its lines of sight, in distances between the eyes
_SWELL = 0.04  # in distances between the eyes: the ghost's skin is outside the rig's, or both would flicker
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
        points, normals = (array[::3, ::3] for array in surface())
        shell = grid(points + _SWELL * normals, closed=True)
        self._shell = self._add("/ghost/shell", shell, 0.2)
        self._eyes = tuple(self._add_eye(side) for side in SIDES)
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
        iris = ring(1.12 * EYE_RADIUS * float(np.sin(_IRIS_RAD)), 0.012)
        ahead = 1.12 * EYE_RADIUS * float(np.cos(_IRIS_RAD))
        self._add(f"{name}/iris", iris, 0.8, ahead)
        line = np.array((((EYE_RADIUS, 0.0, 0.0), (_SIGHT, 0.0, 0.0)),))
        sight = self._scene.add_line_segments(
            f"{name}/sight", line, _GHOST, thickness=1.0, thickness_units="screen"
        )
        self._sized.append((sight, 0.0))
        upper, lower = (
            self._scene.add_frame(f"/ghost/{name}_{side}", show_axes=False)
            for name in ("lid", "lower_lid")
        )
        for frame, sweep_deg in ((upper, 14.0), (lower, -9.0)):
            edge = lid(1.14 * EYE_RADIUS, radians(sweep_deg))
            self._add(f"{frame.name}/edge", edge, 0.45)
        return _CommandedEye(side, ball, upper, lower)

    def show(self, snapshot: Snapshot | None, edges: LidEdges) -> None:
        """Move the drawing to the desired pose; hide it if there is no snapshot or no such pose.

        Args:
            snapshot: of the rig.
            edges: of its lids.
        """
        ghost = snapshot.commanded_pose if snapshot is not None else None
        self._frame.visible = ghost is not None
        if snapshot is not None and ghost is not None:
            if snapshot.joints != self._joints:
                self._have(snapshot.joints)
            self._shell.visible = _apart(ghost, snapshot)
            self._move(ghost, edges)

    def _have(self, joints: tuple[str, ...]) -> None:
        """Draw the edges of the lids that a joint moves."""
        self._joints = joints
        for eye in self._eyes:
            eye.upper.visible = f"{eye.side}_upper_lid" in joints
            eye.lower.visible = f"{eye.side}_lower_lid" in joints

    def _move(self, ghost: CommandedPose, edges: LidEdges) -> None:
        R, p_world_head_m = ghost.R_world_head, ghost.p_world_head_m
        put(self._frame, p_world_head_m, quaternion(R))
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
            put(eye.ball, p_head_m, along(rotate_back(R, gaze_world)))
            for frame, which, so_far in (
                (eye.upper, "upper", opening),
                (eye.lower, "lower", lower),
            ):
                edge_rad = edges.elevation_rad(f"{eye.side}_{which}_lid", so_far)
                put(frame, p_head_m, turned_up(edge_rad))


def _apart(ghost: CommandedPose, snapshot: Snapshot) -> bool:
    """Return whether the desired and the measured head are far enough apart to show both."""
    turned = np.array(ghost.R_world_head) - np.array(snapshot.R_world_head)
    return float(np.abs(turned).max()) > _APART

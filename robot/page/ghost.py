"""Draw where the wish would have head and eyes, as a translucent ghost over the rig itself."""

from math import radians

import numpy as np
import viser

from gaze.angles import rotate_back, sub
from robot.page.head import (
    EYE_RADIUS_M,
    SHELL_HALF_AXES_M,
    SHELL_MIDDLE_M,
    Colour,
    lid_turn,
)
from robot.page.mesh import Mesh, ellipsoid, lid, ring
from robot.page.place import along, put, quaternion
from robot.types import Ghost, Snapshot

_GHOST: Colour = (70, 110, 255)
_SIGHT_M = 0.35
_SWELL = 1.03  # the ghost's skin lies outside the rig's, or both would flicker
_IRIS_RAD = radians(29.0)
_APART = radians(1.5)  # of the head's axes: less would only tint the rig's own shell


class GhostView:
    """The ghost in the scene."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Put it into the scene, unseen."""
        self._scene = scene
        self._frame = scene.add_frame("/ghost", show_axes=False, visible=False)
        x, y, z = SHELL_HALF_AXES_M
        shell = ellipsoid((_SWELL * x, _SWELL * y, _SWELL * z), 0.86, 25)
        self._shell = self._add("/ghost/shell", shell, 0.2)
        self._shell.position = SHELL_MIDDLE_M
        self._eyes = (self._add_eye("left"), self._add_eye("right"))

    def _add(self, name: str, mesh: Mesh, opacity: float) -> viser.MeshHandle:
        return self._scene.add_mesh_simple(
            name,
            mesh.vertices,
            mesh.faces,
            color=_GHOST,
            opacity=opacity,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add_eye(self, side: str) -> tuple[viser.FrameHandle, viser.FrameHandle]:
        """Add an iris as a ring with a line of sight, and the lid's edge."""
        name = f"/ghost/eye_{side}"
        ball = self._scene.add_frame(name, show_axes=False)
        iris = ring(1.05 * EYE_RADIUS_M * float(np.sin(_IRIS_RAD)), 0.0007)
        at_m = 1.05 * EYE_RADIUS_M * float(np.cos(_IRIS_RAD))
        self._add(f"{name}/iris", iris, 0.8).position = (at_m, 0.0, 0.0)
        ahead = np.array((((EYE_RADIUS_M, 0.0, 0.0), (_SIGHT_M, 0.0, 0.0)),))
        self._scene.add_line_segments(
            f"{name}/sight", ahead, _GHOST, thickness=1.0, thickness_units="screen"
        )
        upper = self._scene.add_frame(f"/ghost/lid_{side}", show_axes=False)
        edge = lid(1.12 * EYE_RADIUS_M, radians(14.0))
        self._add(f"/ghost/lid_{side}/edge", edge, 0.45)
        return ball, upper

    def show(self, snapshot: Snapshot | None) -> None:
        """Move the ghost to where the wish is; without a snapshot or a wish it is not seen."""
        ghost = snapshot.ghost if snapshot is not None else None
        self._frame.visible = ghost is not None
        if snapshot is not None and ghost is not None:
            self._shell.visible = _apart(ghost, snapshot)
            self._move(ghost)

    def _move(self, ghost: Ghost) -> None:
        R, p_world_head_m = ghost.R_world_head, ghost.p_world_head_m
        put(self._frame, p_world_head_m, quaternion(R))
        sides = zip(self._eyes, ghost.p_world_eyes_m, ghost.gaze_world, ghost.lids, strict=True)
        for (ball, upper), p_world_m, gaze_world, opening in sides:
            p_head_m = rotate_back(R, sub(p_world_m, p_world_head_m))
            put(ball, p_head_m, along(rotate_back(R, gaze_world)))
            put(upper, p_head_m, lid_turn(opening))


def _apart(ghost: Ghost, snapshot: Snapshot) -> bool:
    """Tell whether the wished head is so far off the measured one that both can be seen."""
    turned = np.array(ghost.R_world_head) - np.array(snapshot.R_world_head)
    return float(np.abs(turned).max()) > _APART

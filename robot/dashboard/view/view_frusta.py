"""Draw the fields of view of the camera and the eyes."""

from math import atan, cos, hypot, pi, sin, tan

import numpy as np
import viser

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.dashboard.view.scene_node import along, put
from gazerig.robot.description.paint import Colour
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import Snapshot

_CAMERA: Colour = (120, 128, 140)
_FIELD: dict[str, Colour] = {"left": (20, 150, 120), "right": (190, 90, 30)}
_DEPTH_M = 0.12
"""Distance of the drawn frame from the camera, m."""
_RADIUS_M = 0.22
"""Distance of the drawn edge of its field from the eye, m."""
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
            self._shape, self._frustum = shape, self._add(*shape)
        self._frustum.visible = True
        put(self._frustum, camera.p_world_camera_m, quaternion(camera.R_world_camera))

    def _add(self, horizontal_rad: float, aspect: float) -> viser.CameraFrustumHandle:
        """Add the pyramid; one of another shape replaces the previous one."""
        vertical_rad = 2.0 * atan(tan(horizontal_rad / 2.0) / aspect)
        return self._scene.add_camera_frustum(
            "/camera",
            fov=vertical_rad,
            aspect=aspect,
            scale=_DEPTH_M,
            thickness=1.0,
            thickness_units="screen",
            color=_CAMERA,
            cast_shadow=False,
            receive_shadow=False,
        )


class EyeFields:
    """Edge of each eye's field of attention, which rotates with the eye."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._field_deg: tuple[float, float, float, float] | None = None
        self._frames = tuple(
            scene.add_frame(f"/field_{side}", show_axes=False, visible=False) for side in _FIELD
        )

    def show(self, snapshot: Snapshot | None) -> None:
        """Rotate the fields with the eyes; hide them without a snapshot."""
        field_deg = snapshot.field_deg if snapshot is not None else None
        for frame in self._frames:
            frame.visible = field_deg is not None
        if snapshot is None or field_deg is None:
            return
        if field_deg != self._field_deg:
            self._field_deg = field_deg
            self._add_edges(field_deg)
        sides = zip(self._frames, snapshot.p_world_eyes_m, snapshot.gaze_world, strict=True)
        for frame, p_world_m, gaze_world in sides:
            put(frame, p_world_m, along(gaze_world))

    def _add_edges(self, field_deg: tuple[float, float, float, float]) -> None:
        for side, colour in _FIELD.items():
            edge = field_edge(field_deg, left=side == "left")
            around = np.stack((edge, np.roll(edge, -1, axis=0)), axis=1)
            spokes = np.stack((np.zeros((4, 3)), edge[:: _AROUND // 4]), axis=1)
            self._scene.add_line_segments(
                f"/field_{side}/edge",
                np.concatenate((around, spokes)),
                colour,
                thickness=1.2,
                thickness_units="screen",
            )


def field_edge(field_deg: tuple[float, float, float, float], *, left: bool) -> Floats:
    """Return points (72, 3) on the edge of an eye's field in the eye's frame, x ahead, in metres.

    field_deg: limits towards temple, nose, above and below; between two of them the edge is
    a quarter of an ellipse (gaze.field_of_view)
    """
    return np.array([_edge_point(field_deg, 2.0 * pi * i / _AROUND, left) for i in range(_AROUND)])


def _edge_point(field_deg: tuple[float, float, float, float], turn: float, left: bool) -> Vec3:
    """Return the point on the edge in the direction ``turn`` from the left, towards above."""
    temporal, nasal, up, down = np.radians(field_deg).tolist()
    side, high = cos(turn), sin(turn)
    to_side = temporal if (side > 0.0) == left else nasal
    away = 1.0 / hypot(side / to_side, high / (up if high > 0.0 else down))
    return (
        _RADIUS_M * cos(away), _RADIUS_M * sin(away) * side, _RADIUS_M * sin(away) * high,
    )  # fmt: skip

"""Past poses of the head and the pose of the camera.

A frame shows the moment of its exposure. If the head's present pose were used to locate it,
targets would be off by the head's motion since then. Therefore past poses are stored.

Viewers and files get rotations as unit quaternions.
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import copysign, degrees, hypot, radians
from typing import Annotated, Literal

from gazerig.drivers.camera.params import ASSUMED_FIELD_DEG
from gazerig.gaze.angles import (
    add,
    angles_of,
    compose,
    rotate,
    rotation,
    scale,
    sub,
    transpose,
    yaw_pitch,
)
from gazerig.gaze.types import Angles3, HeadGeometry, Mat3, Vec3
from gazerig.params import Bounds

OPTICAL: Mat3 = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
"""Maps camera optical axes (x right, y down, z forward) to x forward, y left, z up."""


MountedOn = Literal["head", "base"]


_Pixels = Annotated[int, Bounds(16, 16384)]
_Focal = Annotated[float, Bounds(10, 100_000)]
_Centre = Annotated[float, Bounds(-10_000, 20_000)]
_Bend = Annotated[float, Bounds(-100, 100)]
_Millimetres = Annotated[float, Bounds(-2000, 2000)]
_Degrees = Annotated[float, Bounds(-180, 180)]


@dataclass(frozen=True)
class LensParams:
    """A calibrated lens, for images of one size."""

    # fmt: off
    size_px: Annotated[tuple[_Pixels, _Pixels], "width and height of the images with which the lens was calibrated"]
    focal_px: Annotated[tuple[_Focal, _Focal], "focal length, in units of the pixel width and of the pixel height"]
    centre_px: Annotated[tuple[_Centre, _Centre], "principal point, from the left and from the top edge of the image"]
    distortion: Annotated[tuple[_Bend, _Bend, _Bend, _Bend, _Bend],
        "distortion coefficients k1 k2 p1 p2 k3 of the OpenCV model; zeros: no distortion"] = (0.0, 0.0, 0.0, 0.0, 0.0)
    # fmt: on


@dataclass(frozen=True)
class CameraParams:
    """The camera's pose and field of view."""

    # fmt: off
    mount: Annotated[MountedOn, "head: the camera turns with the head; base: it is fixed"] = "head"
    position_mm: Annotated[tuple[_Millimetres, _Millimetres, _Millimetres],
        "position of the lens in front of, left of and above the point between the eyes (mount head) or the neck base "
        "(mount base)"] = (20.0, 0.0, 45.0)
    yaw_deg: Annotated[float, Bounds(-180, 180), "rotation of the camera to the left"] = 0.0
    pitch_deg: Annotated[float, Bounds(-90, 90), "rotation of the camera upwards"] = 0.0
    horizontal_field_deg: Annotated[float, Bounds(10, 150), "field of view along the longer side of the picture"] = ASSUMED_FIELD_DEG
    roll_deg: Annotated[float, Bounds(-180, 180), "rotation of the camera about its optical axis, right side down"] = 0.0
    rotation: Annotated[Literal[0, 90, 180, 270],
        "degrees clockwise by which the camera's frames are turned upright; all other values here refer to upright frames"] = 0
    mirrored: Annotated[bool, "the camera delivers mirror images: left and right are exchanged before the rotation"] = False
    lens: Annotated[LensParams | None, "measured lens; without it, the field of view is used"] = None
    ignore_deg: Annotated[tuple[tuple[_Degrees, _Degrees, _Degrees, _Degrees], ...],
        "directions from the camera in which nothing is looked at, such as a television: least and largest yaw (to the "
        "left), least and largest pitch (upwards), where 0, 0 is straight ahead of the neck base"] = ()
    # fmt: on


_TICKS = 600
"""Number of stored poses."""


class PoseHistory:
    """A history of the head's angles over the last seconds, with its pose at any time in it."""

    def __init__(
        self,
        geometry: HeadGeometry,
        tell: Callable[[float, Mat3], None] | None = None,
    ) -> None:
        """Create an empty history.

        Args:
            geometry: Geometry of the head.
            tell: Called with the time and R_world_head of each entry.
        """
        self._geometry = geometry
        self._tell = tell
        self._times: deque[float] = deque(maxlen=_TICKS)
        self._angles: deque[Angles3] = deque(maxlen=_TICKS)

    def remember(
        self,
        t_s: float,
        head_rad: Angles3,
        R_world_head: Mat3 | None = None,
    ) -> None:
        """Record the measured angles of the neck; times must increase.

        Args:
            t_s: Time of the measurement.
            head_rad: (yaw, pitch, roll) of the neck.
            R_world_head: Orientation at these angles, if already computed.
        """
        self._times.append(t_s)
        self._angles.append(head_rad)
        if self._tell is not None:
            self._tell(t_s, R_world_head or self._geometry.head_pose(head_rad)[0])

    def head_pose(self, t_s: float) -> tuple[Mat3, Vec3]:
        """Return R_world_head and p_world_head_m at a time, from ``angles``.

        Raises:
            LookupError: The history is empty.
        """
        return self._geometry.head_pose(self.angles(t_s))

    def angles(self, t_s: float) -> Angles3:
        """Return the angles at a time, interpolated between ticks.

        Before the oldest and after the newest entry that entry's angles are returned.

        Raises:
            LookupError: The history is empty.
        """
        times, angles = self._times, self._angles
        if not times:
            raise LookupError("no pose has been recorded yet")
        if t_s > times[-1]:
            return angles[-1]
        after = bisect_left(times, t_s)
        if after == 0:
            return angles[0]
        t0, t1 = times[after - 1], times[after]
        share = (t_s - t0) / (t1 - t0)
        a, b = angles[after - 1], angles[after]
        return add(a, scale(sub(b, a), share))


class CameraMount:
    """The mount of the camera, which gives its pose in the world."""

    def __init__(self, params: CameraParams) -> None:
        self.retune(params)

    def retune(self, params: CameraParams) -> None:
        """Change the camera's mount."""
        self.on_head = params.mount == "head"
        x, y, z = params.position_mm
        self._p: Vec3 = (x / 1e3, y / 1e3, z / 1e3)
        turn = rotation(
            (radians(params.yaw_deg), radians(params.pitch_deg), radians(params.roll_deg))
        )
        self._R = compose(turn, OPTICAL)
        self._ignore_rad = [tuple(map(radians, window)) for window in params.ignore_deg]

    def is_ignored(self, way: Vec3) -> bool:
        """Return whether the rig ignores what is in a direction from the camera."""
        if not self._ignore_rad:
            return False
        yaw, pitch = yaw_pitch(way)
        return any(
            right <= yaw <= left and low <= pitch <= high
            for right, left, low, high in self._ignore_rad
        )

    def rotation(self, R_world_head: Mat3) -> Mat3:
        """Return R_world_camera for an orientation of the head."""
        return compose(R_world_head, self._R) if self.on_head else self._R

    def pose(self, R_world_head: Mat3, p_world_head_m: Vec3) -> tuple[Mat3, Vec3]:
        """Return R_world_camera and p_world_camera_m for a pose of the head."""
        if not self.on_head:
            return self._R, self._p
        return compose(R_world_head, self._R), add(p_world_head_m, rotate(R_world_head, self._p))


def camera_at_pose(
    params: CameraParams, R_parent_camera: Mat3, p_parent_camera_m: Vec3
) -> CameraParams:
    """Return the parameters of a camera at another pose: the inverse of ``CameraMount``.

    Args:
        params: Present parameters.
        R_parent_camera: Orientation in the head, or in the world for a base mount.
        p_parent_camera_m: Position in the same frame.
    """
    yaw, pitch, roll = map(degrees, angles_of(compose(R_parent_camera, transpose(OPTICAL))))
    return replace(
        params,
        position_mm=scale(p_parent_camera_m, 1e3),
        yaw_deg=yaw,
        pitch_deg=pitch,
        roll_deg=roll,
    )


def fixed_mount(params: CameraParams, geometry: HeadGeometry) -> CameraParams:
    """Return a base mount at the pose of a head camera while the head looks straight ahead.

    Films, and webcams next to an emulated head, do not turn with the head.
    """
    if params.mount == "base":
        return params
    _, p_m = geometry.head_pose((0.0, 0.0, 0.0))
    return replace(params, mount="base", position_mm=add(scale(p_m, 1e3), params.position_mm))


Quaternion = tuple[float, float, float, float]
"""w, x, y, z."""


def quaternion(R: Mat3) -> Quaternion:
    """Return a rotation matrix as a unit quaternion with w >= 0."""
    (a, b, c), (d, e, f), (g, h, i) = R
    # Each row is four times a component, times the quaternion; the largest is the most exact.
    rows = (
        (1.0 + a + e + i, h - f, c - g, d - b),
        (h - f, 1.0 + a - e - i, b + d, c + g),
        (c - g, b + d, 1.0 - a + e - i, f + h),
        (d - b, c + g, f + h, 1.0 - a - e + i),
    )
    row = max(rows, key=lambda row: hypot(*row))
    size = copysign(hypot(*row), row[0])
    w, x, y, z = (value / size for value in row)
    return w, x, y, z

"""Draw the rig's head on the page as measured: neck, shell, eyes, lids and lines of sight.

Every pose comes from the snapshot; the sizes of shell, eyeballs and stand are for looks only.
"""

from math import dist, pi, radians
from typing import NamedTuple

import numpy as np
import viser
from viser import transforms

from gazerig.gaze.angles import add, norm, rotate, rotate_back, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.dashboard.mesh import Mesh, cap, ellipsoid, lid, ring, turned
from gazerig.robot.dashboard.scene_node import (
    Turn,
    along,
    put,
    quaternion,
    turn_to,
    turned_up,
    upright_along,
)
from gazerig.robot.model.types import Snapshot

FLOOR_M = -0.14
"""Height of the table the rig stands on, below the neck base."""

Colour = tuple[int, int, int]

_SHELL: Colour = (236, 232, 222)
_TRIM: Colour = (92, 100, 112)
_METAL: Colour = (150, 158, 170)
_LID: Colour = (226, 164, 128)
_SCLERA: Colour = (255, 255, 255)
_IRIS: Colour = (44, 122, 190)
_IRIS_RIM: Colour = (16, 46, 84)
_PUPIL: Colour = (6, 6, 10)
_SIGHT: dict[str, Colour] = {
    "fixate": (48, 190, 120),
    "saccade": (255, 120, 40),
    "pursue": (60, 150, 255),
}

EYE_RADIUS_M = 0.019
_AHEAD = np.array((((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),))
SHELL_MIDDLE_M = (-0.078, 0.0, 0.004)
SHELL_HALF_AXES_M = (0.084, 0.074, 0.098)
_FOOT = (
    *((0.0, 0.0), (0.085, 0.0), (0.085, 0.0), (0.080, 0.014), (0.080, 0.014)),
    *((0.034, 0.022), (0.0, 0.022)),
)
_NECK_TOP_M = (-0.062, 0.0, -0.075)
# Edges of the lids above the eye's equator: where they meet, and each wide open. A lower lid
# that no servo moves stands where they meet.
_SHUT_RAD = radians(-24.0)
_OPEN_RAD = radians(48.0)
_LOWER_OPEN_RAD = radians(-46.0)

SIDES = ("left", "right")
JAW = "jaw"
"""A joint of this name is drawn as a chin that opens downwards."""
_JAW_HINGE_M: Vec3 = (-0.05, 0.0, -0.03)
"""Below the ears."""
_CHIN_M: Vec3 = (-0.018, 0.0, -0.078)
_CHIN_HALF_AXES_M: Vec3 = (0.026, 0.032, 0.014)


class _EyeModel(NamedTuple):
    side: str
    ball: viser.FrameHandle
    sight: viser.LineSegmentsHandle
    lids: viser.FrameHandle
    upper: viser.FrameHandle
    lower: viser.MeshHandle


class HeadView:
    """The rig in the scene, with those parts that its joints move."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._joints: tuple[str, ...] = ()
        self._foot = self._add("/foot", turned(_FOOT), _METAL, (0.0, 0.0, FLOOR_M))
        self._stand = self._add_stand()
        self._post = self._add("/post", turned([(0.022, 0.0), (0.022, 1.0)]), _METAL)
        self._post.visible = False
        self._neck = self._add("/neck", turned([(0.024, 0.0), (0.020, 1.0)]), _TRIM)
        self._head = scene.add_frame("/head", show_axes=False)
        self._add_shell()
        self._eyes = tuple(self._add_eye(side) for side in SIDES)
        self._colour = _SIGHT["fixate"]
        self._neck_m = self._post_m = 1.0
        self._necked = True

    def _add(
        self, name: str, mesh: Mesh, colour: Colour, at_m: Vec3 = (0.0, 0.0, 0.0)
    ) -> viser.MeshHandle:
        return self._scene.add_mesh_simple(
            name,
            mesh.vertices,
            mesh.faces,
            color=colour,
            side="double",
            receive_shadow=False,
            position=at_m,
        )

    def _add_stand(self) -> tuple[viser.MeshHandle, ...]:
        """Add the column and the joint on it, which only a rig with a neck has."""
        column = [(0.034, 0.022), (0.030, 0.05), (0.028, -FLOOR_M), (0.0, -FLOOR_M)]
        return (
            self._add("/stand", turned(column), _METAL, (0.0, 0.0, FLOOR_M)),
            self._add("/joint", cap(0.031, pi, 24), _TRIM),
        )

    def _add_shell(self) -> None:
        self._add("/head/shell", ellipsoid(SHELL_HALF_AXES_M, 0.86, 33), _SHELL, SHELL_MIDDLE_M)
        self._add("/head/nose", ellipsoid((0.013, 0.008, 0.014)), _SHELL, (0.005, 0.0, -0.034))
        self._add("/head/mouth", ellipsoid((0.005, 0.019, 0.002)), _TRIM, (-0.0105, 0.0, -0.064))
        self._jaw = self._scene.add_frame("/head/jaw", show_axes=False, position=_JAW_HINGE_M)
        self._jaw.visible = False
        chin = sub(_CHIN_M, _JAW_HINGE_M)
        self._add("/head/jaw/chin", ellipsoid(_CHIN_HALF_AXES_M), _SHELL, chin)
        ear = turned([(0.0, 0.0), (0.022, 0.0), (0.022, 0.0), (0.018, 0.009), (0.0, 0.011)])
        x, _, z = SHELL_MIDDLE_M
        for side, y, turn in (("left", 0.070, -pi / 2), ("right", -0.070, pi / 2)):
            disc = self._add(f"/head/ear_{side}", ear, _TRIM, (x, y, z))
            disc.wxyz = transforms.SO3.from_x_radians(turn).wxyz

    def _add_eye(self, side: str) -> _EyeModel:
        name = f"/head/eye_{side}"
        ball = self._scene.add_frame(name, show_axes=False)
        caps = (
            ("sclera", 1.0, 180.0, _SCLERA),
            ("iris_rim", 1.006, 33.0, _IRIS_RIM),
            ("iris", 1.012, 29.0, _IRIS),
            ("pupil", 1.018, 13.0, _PUPIL),
        )
        for part, swell, half_deg, colour in caps:
            self._add(f"{name}/{part}", cap(swell * EYE_RADIUS_M, radians(half_deg), 24), colour)
        gleam = self._add(f"{name}/gleam", cap(1.022 * EYE_RADIUS_M, radians(4.5)), _SCLERA)
        gleam.wxyz = transforms.SO3.from_rpy_radians(0.0, radians(-13), radians(13)).wxyz
        sight = self._scene.add_line_segments(
            f"{name}/sight", _AHEAD, _SIGHT["fixate"], thickness=2.0, thickness_units="screen"
        )
        return _EyeModel(side, ball, sight, *self._add_lids(side))

    def _add_lids(self, side: str) -> tuple[viser.FrameHandle, viser.FrameHandle, viser.MeshHandle]:
        name = f"/head/lids_{side}"
        lids = self._scene.add_frame(name, show_axes=False)
        upper = self._scene.add_frame(f"{name}/upper", show_axes=False)
        self._add(f"{name}/upper/skin", lid(1.07 * EYE_RADIUS_M, radians(120.0)), _LID)
        lower = self._add(f"{name}/lower", lid(1.06 * EYE_RADIUS_M, radians(-100.0)), _LID)
        lower.wxyz = turned_up(_SHUT_RAD)
        rim = self._add(f"{name}/rim", ring(1.14 * EYE_RADIUS_M, 0.0026), _TRIM, (0.001, 0.0, 0.0))
        outwards = radians(26.0) if side == "left" else radians(-26.0)
        rim.wxyz = transforms.SO3.from_z_radians(outwards).wxyz
        return lids, upper, lower

    def show(self, snapshot: Snapshot) -> None:
        """Move everything to where it was measured."""
        if snapshot.joints != self._joints:
            self._have(snapshot.joints)
        R_world_head, p_world_head_m = snapshot.R_world_head, snapshot.p_world_head_m
        put(self._head, p_world_head_m, quaternion(R_world_head))
        self._hold_up(R_world_head, p_world_head_m)
        if JAW in self._joints:
            turn_to(self._jaw, jaw_turn(snapshot.measured_rad[self._joints.index(JAW)]))
        colour = _SIGHT.get(snapshot.phase, _SIGHT["fixate"])
        sides = zip(
            self._eyes,
            snapshot.p_world_eyes_m,
            snapshot.gaze_world,
            snapshot.lids,
            self._lower(snapshot),
            strict=True,
        )
        for eye, p_world_m, gaze_world, opening, lower in sides:
            p_head_m = rotate_back(R_world_head, sub(p_world_m, p_world_head_m))
            put(eye.ball, p_head_m, along(rotate_back(R_world_head, gaze_world)))
            put(eye.lids, p_head_m)
            turn_to(eye.upper, lid_turn(opening))
            turn_to(eye.lower, lower_lid_turn(lower))
            # As far as the target is: the lines meet there only if the eyes truly fixate it.
            eye.sight.scale = round(dist(p_world_m, snapshot.p_world_target_m), 2)
        if colour != self._colour:
            self._colour = colour
            for eye in self._eyes:
                eye.sight.colors = np.array(colour, np.uint8)

    def _have(self, joints: tuple[str, ...]) -> None:
        """Draw what these joints move, and what stands still beside it."""
        self._joints = joints
        self._necked = any(joint.startswith("neck_") for joint in joints)
        for part in (*self._stand, self._neck):
            part.visible = self._necked
        self._post.visible = not self._necked
        if self._necked:
            put(self._foot, (0.0, 0.0, FLOOR_M))
        self._jaw.visible = JAW in joints
        for eye in self._eyes:
            eye.upper.visible = f"{eye.side}_upper_lid" in joints
            # An upper lid shuts upon a lower one, moved or not.
            eye.lower.visible = eye.upper.visible or f"{eye.side}_lower_lid" in joints

    def _lower(self, snapshot: Snapshot) -> list[float]:
        """Return how far the lower lids are open; one that nothing moves stands where they meet."""
        openings = snapshot.lower_lids or (0.0, 0.0)
        return [
            opening if f"{side}_lower_lid" in self._joints else 0.0
            for side, opening in zip(SIDES, openings, strict=True)
        ]

    def _hold_up(self, R_world_head: Mat3, p_world_head_m: Vec3) -> None:
        """Add a neck, or a post if there is none, between the table and the head."""
        if self._necked:
            self._stretch_neck(add(p_world_head_m, rotate(R_world_head, _NECK_TOP_M)))
            return
        x, y, z = add(p_world_head_m, SHELL_MIDDLE_M)
        length = max(0.01, round(z - 0.9 * SHELL_HALF_AXES_M[2] - FLOOR_M, 4))
        for part in (self._foot, self._post):
            put(part, (x, y, FLOOR_M))
        if length != self._post_m:
            self._post_m = length
            self._post.scale = (1.0, 1.0, length)

    def _stretch_neck(self, top_m: Vec3) -> None:
        """Lay the column, which stands along z, onto the way from base to head."""
        length = round(norm(top_m), 4)
        if length != self._neck_m:
            self._neck_m = length
            self._neck.scale = (1.0, 1.0, length)
        turn_to(self._neck, upright_along(top_m))


def jaw_turn(angle_rad: float) -> Turn:
    """Return the turn of a jaw: + is open, the chin down."""
    return turned_up(-angle_rad)


def lid_turn(opening: float) -> Turn:
    """Return the turn of an upper lid that is open so far, 0..1."""
    return turned_up(_SHUT_RAD + opening * (_OPEN_RAD - _SHUT_RAD))


def lower_lid_turn(opening: float) -> Turn:
    """Return the turn of a lower lid that is open so far, 0..1."""
    return turned_up(_SHUT_RAD + opening * (_LOWER_OPEN_RAD - _SHUT_RAD))

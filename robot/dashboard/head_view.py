"""Draw the rig's head on the page as measured: bust, neck, skin, eyes, lids and lines of sight.

Every pose comes from the snapshot, and the measures of the shape from where its eyes and the axes
of its neck are (robot/model/head_shape.py).
"""

from math import dist, radians
from typing import NamedTuple

import numpy as np
import viser
from viser import transforms

from gazerig.gaze.angles import add, norm, rotate, rotate_back, sub
from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.dashboard import head_mesh
from gazerig.robot.dashboard.glb import CLOTH, EYE, FLAT, PLASTIC, SKIN, Finish, glb
from gazerig.robot.dashboard.scene_node import Turn, along, put, turn_to, turned_up, upright_along
from gazerig.robot.dashboard.scene_node import quaternion as quaternion_of
from gazerig.robot.model.head_shape import CHIN, HeadMeasures, measures_of
from gazerig.robot.model.paint import Colour, Painted, mirrored
from gazerig.robot.model.types import Snapshot

FLOOR_M = -0.09
"""Height of the table the rig stands on, below the neck base."""

_SIGHT: dict[str, Colour] = {
    "fixate": (48, 190, 120),
    "saccade": (255, 120, 40),
    "pursue": (60, 150, 255),
}

_AHEAD = np.array((((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),))
# Edges of the lids above the eye's equator: where they meet, and each wide open. A lower lid
# that no servo moves stands where they meet.
_SHUT_RAD = radians(-24.0)
_OPEN_RAD = radians(48.0)
_LOWER_OPEN_RAD = radians(-46.0)
UPPER_LID, LOWER_LID = 1.085, 1.07
"""Radii of the lids, in those of the eyeball."""
_NECK_RADIUS, _BUST, _BELOW_CHIN = 0.42, 1.45, 0.25  # in distances between the eyes
_THROAT: Vec3 = (-0.72, 0.0, -0.90)
"""Where a neck without joints ends, in distances between the eyes."""
LEAST_M = 0.01
"""No part is drawn shorter."""
_BROW_OUT = 0.35  # how far a brow's joint moves it up, in distances between the eyes a radian

SIDES = ("left", "right")
JAW = "jaw"
"""A joint of this name opens the mouth."""


class _EyeModel(NamedTuple):
    side: str
    ball: viser.GlbHandle
    sight: viser.LineSegmentsHandle
    upper: viser.GlbHandle
    lower: viser.GlbHandle
    brow: viser.GlbHandle


class HeadView:
    """The rig in the scene, with those parts that its joints move."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._joints: tuple[str, ...] = ()
        self.measures = HeadMeasures()
        self._shade = self._add("/shade", head_mesh.glow((20, 24, 34, 140), 10), FLAT)
        self._shade.position = (0.0, 0.0, FLOOR_M + 0.001)
        self._bust = self._add("/bust", head_mesh.bust(), CLOTH)
        self._neck = self._add("/neck", head_mesh.neck(), PLASTIC)
        self._head = scene.add_frame("/head", show_axes=False)
        skin = head_mesh.skin()
        self._skin = (
            self._add("/head/skin", skin.head, SKIN),
            self._add("/head/jaw", skin.jaw, SKIN),
            self._add("/head/cap", head_mesh.cap(), PLASTIC),
        )
        self._jaw = self._skin[1]
        self._mouth = self._add("/head/mouth", head_mesh.mouth(), FLAT)
        self._mouth.visible = False
        self._ears = tuple(self._add_ear(side) for side in SIDES)
        self._eyes = tuple(self._add_eye(side) for side in SIDES)
        self._colour = _SIGHT["fixate"]
        self._necked = True
        self._fit(self.measures)

    def _add(
        self, name: str, painted: Painted, finish: Finish, pose: Floats | None = None
    ) -> viser.GlbHandle:
        return self._scene.add_glb(
            name, glb(painted, finish, pose), cast_shadow=False, receive_shadow=False
        )

    def _add_ear(self, side: str) -> viser.GlbHandle:
        turn = transforms.SO3.from_x_radians(radians(-84.0 if side == "left" else 84.0))
        ear = self._add(
            f"/head/ear_{side}", head_mesh.ear(), PLASTIC, np.asarray(turn.as_matrix(), np.float64)
        )
        ear.wxyz = turn.wxyz
        return ear

    def _add_eye(self, side: str) -> _EyeModel:
        name = f"/head/eye_{side}"
        ball = self._add(name, head_mesh.eye(), EYE)
        sight = self._scene.add_line_segments(
            f"/head/sight_{side}", _AHEAD, _SIGHT["fixate"], thickness=2.0, thickness_units="screen"
        )
        sight.visible = False
        # Lit as they stand most of the time; the lower ones a little higher, or they look tired.
        upper, lower = (
            self._add(
                f"/head/lids_{side}/{part}",
                head_mesh.eyelid(part == "upper"),
                SKIN,
                np.asarray(transforms.SO3(np.array(turn)).as_matrix(), np.float64),
            )
            for part, turn in (("upper", lid_turn(0.7)), ("lower", turned_up(radians(12.0))))
        )
        brow = head_mesh.brow()
        brow = brow if side == "left" else mirrored(brow)
        lower.wxyz = turned_up(_SHUT_RAD)
        return _EyeModel(
            side, ball, sight, upper, lower, self._add(f"/head/brow_{side}", brow, SKIN)
        )

    def _fit(self, measures: HeadMeasures) -> None:
        """Give every part the size that the rig's measures say."""
        self.measures = measures
        unit = measures.interocular_m
        for part in (*self._skin, self._mouth, *(eye.brow for eye in self._eyes)):
            part.scale = unit
        for ear, side in zip(self._ears, (1.0, -1.0), strict=True):
            ear.scale = 0.36 * unit
            ear.position = measures.scaled((-1.12, 1.185 * side, -0.02))
        for eye in self._eyes:
            eye.ball.scale = measures.eye_radius_m
            eye.upper.scale = UPPER_LID * measures.eye_radius_m
            eye.lower.scale = LOWER_LID * measures.eye_radius_m
        self._shade.scale = 4.4 * unit

    def show(self, snapshot: Snapshot, *, sight: bool = False) -> None:
        """Move everything to where it was measured; ``sight``: with the lines of sight."""
        if snapshot.joints != self._joints:
            self._have(snapshot.joints)
        R_world_head, p_world_head_m = snapshot.R_world_head, snapshot.p_world_head_m
        measures = shown_measures(snapshot)
        if measures != self.measures:
            self._fit(measures)
        put(self._head, p_world_head_m, quaternion_of(R_world_head))
        pivot_m = measures.pivot_m if self._necked else measures.scaled(_THROAT)
        self._hold_up(p_world_head_m, add(p_world_head_m, rotate(R_world_head, pivot_m)))
        if JAW in self._joints:
            turn_to(self._jaw, jaw_turn(snapshot.measured_rad[self._joints.index(JAW)]))
            put(self._jaw, _about(measures.hinge_m, self._jaw.wxyz))
        self._show_eyes(snapshot, sight)

    def _show_eyes(self, snapshot: Snapshot, sight: bool) -> None:
        R_world_head, p_world_head_m = snapshot.R_world_head, snapshot.p_world_head_m
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
            turn = along(rotate_back(R_world_head, gaze_world))
            put(eye.ball, p_head_m, turn)
            put(eye.upper, p_head_m, lid_turn(opening))
            put(eye.lower, p_head_m, lower_lid_turn(lower))
            self._raise_brow(eye, snapshot)
            if sight:
                put(eye.sight, p_head_m, turn)
                # As far as the target is: the lines meet there only if the eyes truly fixate it.
                eye.sight.scale = round(dist(p_world_m, snapshot.p_world_target_m), 2)
            eye.sight.visible = sight
        if colour != self._colour:
            self._colour = colour
            for eye in self._eyes:
                eye.sight.colors = np.array(colour, np.uint8)

    def _raise_brow(self, eye: _EyeModel, snapshot: Snapshot) -> None:
        """Move a brow by its joint, if there is one."""
        name = f"{eye.side}_brow"
        if name in self._joints:
            up = _BROW_OUT * snapshot.measured_rad[self._joints.index(name)]
            put(eye.brow, self.measures.scaled((0.0, 0.0, up)))

    def _have(self, joints: tuple[str, ...]) -> None:
        """Draw what these joints move, and what stands still beside it."""
        self._joints = joints
        self._necked = any(joint.startswith("neck_") for joint in joints)
        self._mouth.visible = JAW in joints
        if JAW not in joints:
            put(self._jaw, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        for eye in self._eyes:
            eye.upper.visible = f"{eye.side}_upper_lid" in joints
            # An upper lid shuts upon a lower one, moved or not.
            eye.lower.visible = eye.upper.visible or f"{eye.side}_lower_lid" in joints
            put(eye.brow, (0.0, 0.0, 0.0))

    def _lower(self, snapshot: Snapshot) -> list[float]:
        """Return how far the lower lids are open; one that nothing moves stands where they meet."""
        openings = snapshot.lower_lids or (0.0, 0.0)
        return [
            opening if f"{side}_lower_lid" in self._joints else 0.0
            for side, opening in zip(SIDES, openings, strict=True)
        ]

    def _hold_up(self, p_world_head_m: Vec3, p_world_pivot_m: Vec3) -> None:
        """Stand the bust on the table, and a neck between it and the head's pivot."""
        x, y, z = (0.0, 0.0, 0.0) if self._necked else p_world_pivot_m
        unit = self.measures.interocular_m
        base_m = (x, y, min(0.0, z, p_world_head_m[2] + (CHIN - _BELOW_CHIN) * unit))
        put(self._bust, base_m)
        put(self._shade, (x, y, FLOOR_M + 0.001))
        tall = max(LEAST_M, round(base_m[2] - FLOOR_M, 4))
        _resize(self._bust, (_BUST * unit, _BUST * unit, tall))
        way = sub(p_world_pivot_m, base_m)
        length = max(LEAST_M, round(norm(way), 4))
        radius = _NECK_RADIUS * unit
        put(self._neck, base_m, upright_along(way))
        _resize(self._neck, (radius, radius, length))


def shown_measures(snapshot: Snapshot) -> HeadMeasures:
    """Return the measures of the head in a snapshot, from its eyes and the pivot of its neck."""
    pivot_m = None
    if snapshot.p_world_pivot_m is not None:
        off = sub(snapshot.p_world_pivot_m, snapshot.p_world_head_m)
        x, y, z = rotate_back(snapshot.R_world_head, off)
        pivot_m = (round(x, 4), round(y, 4), round(z, 4))
    return measures_of(*snapshot.p_world_eyes_m, pivot_m)


def _resize(part: viser.GlbHandle, scale: Vec3) -> None:
    if part.scale != scale:
        part.scale = scale


def _about(hinge_m: Vec3, turn: object) -> Vec3:
    """Return where a part's origin goes when the part turns about a hinge."""
    x, y, z = transforms.SO3(np.asarray(turn)).apply(np.array(hinge_m)).tolist()
    return sub(hinge_m, (x, y, z))


def jaw_turn(angle_rad: float) -> Turn:
    """Return the turn of a jaw: + is open, the chin down."""
    return turned_up(-angle_rad)


def lid_turn(opening: float) -> Turn:
    """Return the turn of an upper lid that is open so far, 0..1."""
    return turned_up(_SHUT_RAD + opening * (_OPEN_RAD - _SHUT_RAD))


def lower_lid_turn(opening: float) -> Turn:
    """Return the turn of a lower lid that is open so far, 0..1."""
    return turned_up(_SHUT_RAD + opening * (_LOWER_OPEN_RAD - _SHUT_RAD))

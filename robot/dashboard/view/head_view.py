"""Draw the rig's head on the page as measured: the links of its description."""

from math import dist, radians

import numpy as np
import viser

from gazerig.gaze.angles import compose, rotate_back, rotation, sub, turn_about
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.dashboard.feed.rig_feed import ShownHead
from gazerig.robot.dashboard.view.glb import FINISHES, FLAT, glow_disc, painted_glb
from gazerig.robot.dashboard.view.scene_node import set_pose
from gazerig.robot.description.build import RigShape, describe
from gazerig.robot.description.links import (
    CAMERA,
    FLOOR_M,
    Description,
    HeadMeasures,
)
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.kinematics import LIDS

_SHADE = 4.4
"""Radius of the shade below the shoulders, in distances between the eyes."""
_LIT_OPEN = 0.7
"""Opening for which upper lids are lit: their usual one."""
_LIT_LOWER_LID: Mat3 = rotation((0.0, radians(12.0), 0.0))
"""Rotation of lower lids for the lighting, as if a little higher; otherwise they look tired."""


class HeadView:
    """Rig in the scene, with all parts that its joints move.

    on_table: whether it is on an object of a drawn world and needs no shadow of its own
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self.on_table = False
        self.links: dict[str, viser.FrameHandle] = {}
        self._drawn: RigShape | None = None
        self._description: Description | None = None
        self._root = scene.add_frame("/rig", show_axes=False)
        self._shade = self._add("/shade", painted_glb(glow_disc((20, 24, 34, 140)), FLAT))

    def _add(self, name: str, data: bytes) -> viser.GlbHandle:
        return self._scene.add_glb(name, data, cast_shadow=False, receive_shadow=False)

    def show(self, head: ShownHead) -> None:
        """Move all parts to their measured positions."""
        tick, pose, names = head.tick, head.tick.pose, head.rig.kinematics.names
        shape = with_shown_lids(head.rig.shape)
        if shape != self._drawn:  # the geometry has changed
            self._drawn = shape
            self._draw(describe(shape), shape)
        description = self._description
        assert description is not None
        angles = description.angles(names, tick.joints.position_rad)
        angles |= lid_angles(
            shape, (pose.lid_left, pose.lid_right), (pose.lower_left, pose.lower_right)
        )
        for link in description.links:
            if link.joint is not None:
                R = compose(link.R, turn_about(link.joint.axis, angles[link.joint.name]))
                set_pose(self.links[link.name], link.p_m, quaternion(R))
        self._shade.visible = not self.on_table

    def _draw(self, description: Description, shape: RigShape) -> None:
        """Draw a rig instead of the one that is drawn."""
        self._description = description
        self._root.remove()
        self._root = self._scene.add_frame("/rig", show_axes=False)
        self.links, paths = {}, dict[str | None, str]()
        at_rest = dict.fromkeys((joint.name for joint in description.joints), 0.0)
        lit = description.poses(at_rest | lid_angles(shape, (_LIT_OPEN,) * 2, (_LIT_OPEN,) * 2))
        for link in description.links:
            path = f"{paths.get(link.parent, '/rig')}/{link.name}"  # below that of its parent
            paths[link.name] = path
            frame = self.links[link.name] = self._scene.add_frame(path, show_axes=False)
            set_pose(frame, link.p_m, quaternion(link.R))
            moved = link.joint.name if link.joint is not None else ""
            # The camera's housing would cover the face.
            for look in link.visuals if link.name != CAMERA else ():
                R_lit = compose(lit[link.name][0], look.R)
                if look.name.endswith("still_lid") or "lower_lid" in moved:
                    R_lit = _LIT_LOWER_LID
                data = painted_glb(look.painted(), FINISHES[look.finish], np.array(R_lit))
                handle = self._add(f"{path}/look_{look.name}", data)
                handle.position, handle.wxyz = look.p_m, quaternion(look.R)
        self._shade.scale = _SHADE * shape.geometry.interocular_mm / 1e3
        (base, *_) = description.links
        if base.visuals:
            x, y, _ = base.visuals[0].p_m
            set_pose(self._shade, (x, y, FLOOR_M + 0.001))


def lid_angles(
    shape: RigShape, upper: tuple[float, float], lower: tuple[float, float]
) -> dict[str, float]:
    """Return the angles of a rig's lid joints, in radians.

    Args:
        shape: geometry of the rig.
        upper: opening of the left and the right upper lid, 0..1.
        lower: the same for the lower lids.
    """
    openings = dict(zip(LIDS, (*upper, *lower), strict=True))
    return {
        name: shut + openings[name] * (wide - shut)
        for name, (shut, wide) in shape.lids.items()
        if name in shape.joints
    }


def eyes_m(head: ShownHead) -> tuple[Vec3, Vec3]:
    """Return the centres of the left and the right eye, world."""
    return head.tick.pose.p_world_eye_left_m, head.tick.pose.p_world_eye_right_m


def pivot_m(head: ShownHead) -> Vec3:
    """Return the intersection of the neck's pitch and roll axes, world."""
    pose = head.tick.pose
    return head.rig.kinematics.pivot_m(pose.R_world_head, pose.p_world_head_m)


def head_dimensions(head: ShownHead) -> HeadMeasures:
    """Return the dimensions of the head in tenths of a millimetre, which noise does not change."""
    pose = head.tick.pose
    x, y, z = rotate_back(pose.R_world_head, sub(pivot_m(head), pose.p_world_head_m))
    return HeadMeasures(round(dist(*eyes_m(head)), 4), (round(x, 4), round(y, 4), round(z, 4)))


_LID_RAD = {"upper": radians(74.0), "lower": radians(22.0)}
"""Rotation of shown lids from closed to open, about that of a person. Servos of a small head move
its lids less, so that the head would always look sleepy."""


def with_shown_lids(shape: RigShape) -> RigShape:
    """Return a rig whose lids have the shown rotation."""
    return shape._replace(lids={name: (0.0, _LID_RAD[name.split("_")[1]]) for name in shape.lids})

"""Draw the rig's head on the page as measured: the links of its description, and lines of sight."""

from collections.abc import Mapping
from math import dist, radians
from typing import NamedTuple

import numpy as np
import viser

from gazerig.gaze.angles import compose, rotate_back, rotation, sub
from gazerig.gaze.types import Floats, Mat3
from gazerig.robot.dashboard.view.glb import CLOTH, EYE, FLAT, PLASTIC, SKIN, Finish, glb
from gazerig.robot.dashboard.view.glow import glow
from gazerig.robot.dashboard.view.lid_edges import LidEdges, lid_edges
from gazerig.robot.dashboard.view.scene_node import put
from gazerig.robot.dashboard.view.snapshot_shape import shape_of, with_shown_lids
from gazerig.robot.description import links
from gazerig.robot.description.build import SIDES, RigShape, describe
from gazerig.robot.description.head_shape import HeadMeasures, measures_of
from gazerig.robot.description.links import Description, Link, Visual, turn_about
from gazerig.robot.description.paint import Colour
from gazerig.robot.description.parts import FLOOR_M
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.model.types import Snapshot

_SIGHT: dict[str, Colour] = {
    "fixate": (48, 190, 120),
    "saccade": (255, 120, 40),
    "pursue": (60, 150, 255),
}
_AHEAD = np.array((((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),))
_FINISHES: Mapping[links.Finish, Finish] = {
    "skin": SKIN,
    "plastic": PLASTIC,
    "cloth": CLOTH,
    "eye": EYE,
    "dark": FLAT,
}
_SHADE = 4.4
"""Radius of the shade below the shoulders, in distances between the eyes."""
_LIT_OPEN = 0.7
"""Opening for which upper lids are lit: their usual one."""
_LIT_LOWER_LID: Mat3 = rotation((0.0, radians(12.0), 0.0))
"""Rotation by which lower lids are lit as if a little higher; otherwise they look tired."""


class _Node(NamedTuple):
    """Link in the scene: its frame, and one file for each of its materials."""

    frame: viser.FrameHandle
    looks: list[viser.GlbHandle]


class HeadView:
    """Rig in the scene, with all parts that its joints move.

    shape: geometry of the rig; None: derived from snapshots
    on_table: whether it is on an object of a drawn world, and needs no shade of its own
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self.shape: RigShape | None = None
        self.on_table = False
        self.links: dict[str, _Node] = {}
        self._drawn: RigShape | None = None
        self._seen: tuple[tuple[str, ...], HeadMeasures] | None = None
        self._description: Description | None = None
        self._root = scene.add_frame("/rig", show_axes=False)
        self._shade = self._add("/shade", glb(glow((20, 24, 34, 140), 10), FLAT))
        self._sights: list[viser.LineSegmentsHandle] = []
        self._colour = _SIGHT["fixate"]
        self._edges = LidEdges({}, {})

    @property
    def lid_edges(self) -> LidEdges:
        """Return the positions of the lid edges; without lids before the first snapshot."""
        return self._edges

    def _add(self, name: str, data: bytes) -> viser.GlbHandle:
        return self._scene.add_glb(name, data, cast_shadow=False, receive_shadow=False)

    def show(self, snapshot: Snapshot, *, sight: bool = False, camera: bool = False) -> None:
        """Move all parts to their measured positions.

        Args:
            snapshot: of the rig.
            sight: with the lines of sight.
            camera: with the camera's housing, which else is left out of the face.
        """
        self._fit(snapshot)
        description, shape = self._description, self._drawn
        assert description is not None and shape is not None  # fitted
        angles = description.angles(snapshot.joints, snapshot.measured_rad)
        angles |= lid_angles(shape, snapshot.lids, snapshot.lower_lids or (0.0, 0.0))
        for link in description.links:
            if link.joint is not None:
                R = compose(link.R, turn_about(link.joint.axis, angles[link.joint.name]))
                put(self.links[link.name].frame, link.p_m, quaternion(R))
        for look in self.links[description.camera.link].looks:
            look.visible = camera
        self._shade.visible = not self.on_table
        self._show_sight(snapshot, sight)

    def _show_sight(self, snapshot: Snapshot, wanted: bool) -> None:
        colour = _SIGHT.get(snapshot.phase, _SIGHT["fixate"])
        for line, p_world_m in zip(self._sights, snapshot.p_world_eyes_m, strict=True):
            if wanted:
                # As long as the target's distance: the lines meet there only if the eyes fixate it.
                line.scale = round(dist(p_world_m, snapshot.p_world_target_m), 2)
            line.visible = wanted
            if colour != self._colour:
                line.colors = np.array(colour, np.uint8)
        self._colour = colour

    def _fit(self, snapshot: Snapshot) -> None:
        """Draw another rig if the geometry has changed."""
        shape = with_shown_lids(self.shape) if self.shape is not None else None
        if shape is None:
            seen = snapshot.joints, head_dimensions(snapshot)
            shape = self._drawn if seen == self._seen else shape_of(*seen, snapshot)
            self._seen = seen
        if shape != self._drawn and shape is not None:
            self._drawn, self._edges = shape, lid_edges(shape)
            self._draw(describe(shape), shape)

    def _draw(self, description: Description, shape: RigShape) -> None:
        """Draw a rig; if it has the same links, only those that look different."""
        before, self._description = self._description, description
        if before is None or _tree(before) != _tree(description):
            before = None
            self._add_frames(description)
        at_rest = dict.fromkeys((joint.name for joint in description.joints), 0.0)
        lit = description.poses(at_rest | lid_angles(shape, (_LIT_OPEN,) * 2, (_LIT_OPEN,) * 2))
        paths = _paths(description)
        for link in description.links:
            node = self.links[link.name]
            put(node.frame, link.p_m, quaternion(link.R))
            if before is not None and _look_alike(before.link(link.name), link):
                continue
            while node.looks:
                node.looks.pop().remove()
            for look in link.visuals:
                pose = _lit_as(link, look, lit[link.name][0])
                node.looks.append(self._add_look(paths[link.name], look, pose))
        self._shade.scale = _SHADE * shape.geometry.interocular_mm / 1e3
        (base, *_) = description.links
        if base.visuals:
            x, y, _ = base.visuals[0].p_m
            put(self._shade, (x, y, FLOOR_M + 0.001))

    def _add_frames(self, description: Description) -> None:
        """Add a frame for every link to the scene, in that of its parent."""
        self._root.remove()
        self._root = self._scene.add_frame("/rig", show_axes=False)
        paths = _paths(description)
        self.links = {
            name: _Node(self._scene.add_frame(path, show_axes=False), [])
            for name, path in paths.items()
        }
        self._sights = [
            self._scene.add_line_segments(
                f"{paths[f'{side}_eye']}/sight", _AHEAD, self._colour, thickness=2.0,
                thickness_units="screen", visible=False,
            )
            for side in SIDES
        ]  # fmt: skip

    def _add_look(self, path: str, look: Visual, lit: Floats) -> viser.GlbHandle:
        handle = self._add(
            f"{path}/look_{look.name}", glb(look.painted, _FINISHES[look.finish], lit)
        )
        handle.position, handle.wxyz = look.p_m, quaternion(look.R)
        return handle


def _paths(description: Description) -> dict[str, str]:
    """Return the pose of each link in the frame of its parent."""
    found: dict[str, str] = {}
    for link in description.links:
        found[link.name] = f"{found[link.parent] if link.parent else '/rig'}/{link.name}"
    return found


def _tree(description: Description) -> list[tuple[str, str | None]]:
    return [(link.name, link.parent) for link in description.links]


def _look_alike(one: Link, other: Link) -> bool:
    """Return whether two links look alike in their own frames."""
    return len(one.visuals) == len(other.visuals) and all(
        a._replace(painted=b.painted) == b
        and np.array_equal(a.painted.mesh.vertices, b.painted.mesh.vertices)
        and np.array_equal(a.painted.colours, b.painted.colours)
        for a, b in zip(one.visuals, other.visuals, strict=True)
    )


def _lit_as(link: Link, look: Visual, R_world_link: Mat3) -> Floats:
    """Return the rotation in the scene for which a mesh is lit."""
    if look.name.endswith("still_lid") or (link.joint and "lower_lid" in link.joint.name):
        return np.array(_LIT_LOWER_LID)
    return np.array(compose(R_world_link, look.R))


def lid_angles(
    shape: RigShape, upper: tuple[float, float], lower: tuple[float, float]
) -> dict[str, float]:
    """Return the angles of a rig's lid joints, in radians.

    Args:
        shape: of the rig.
        upper: how far the left and the right upper lid are open, 0..1.
        lower: the same for lower lids.
    """
    openings = dict(zip(LIDS, (*upper, *lower), strict=True))
    return {
        name: shut + openings[name] * (wide - shut)
        for name, (shut, wide) in shape.lids.items()
        if name in shape.joints
    }


def head_dimensions(snapshot: Snapshot) -> HeadMeasures:
    """Return the measures of the head in a snapshot, from its eyes and the pivot of its neck."""
    pivot_m = None
    if snapshot.p_world_pivot_m is not None:
        off = sub(snapshot.p_world_pivot_m, snapshot.p_world_head_m)
        x, y, z = rotate_back(snapshot.R_world_head, off)
        pivot_m = (round(x, 4), round(y, 4), round(z, 4))
    return measures_of(*snapshot.p_world_eyes_m, pivot_m)

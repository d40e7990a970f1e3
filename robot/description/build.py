"""The description of a rig: a tree of links from the dimensions and joints in its YAML. Pure.

The neck turns yaw, pitch, roll about axes through one point, on a lower neck if the rig has one.
The head carries eyes that pan and tilt about their centres, lids that turn about an axis through
both eyes' centres, and any other joints of the rig. Angles are those of the rig's joints,
with their signs (robot/model/kinematics.py).
"""

from collections.abc import Iterator, Mapping
from itertools import combinations, product
from math import copysign, pi, radians
from typing import NamedTuple

from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Vec3
from gazerig.robot.description import mass, parts
from gazerig.robot.description.head_shape import HeadMeasures
from gazerig.robot.description.links import (
    CameraFrame,
    Description,
    Link,
    LinkageFollower,
    LinkJoint,
)
from gazerig.robot.description.own_meshes import OwnMesh, with_own_meshes
from gazerig.robot.description.weights import (
    HEAD,
    carried_links,
    head_inertia,
    mass_faults,
    weighed,
)
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.frames import OPTICAL, CameraParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LIDS, LOWER_NECK, NECK, GeometryParams, LidEnds
from gazerig.robot.model.mass_params import MassParams
from gazerig.robot.model.types import further_joints


def joint_torques_nm(
    joints: Mapping[str, JointParams], couplings: Mapping[str, CouplingParams]
) -> dict[str, float]:
    """Return the stall torque at every joint, at the rated voltage of its servos.

    In a pair that two servos move together, each joint gets the torque of both servos on it alone.
    """
    own = {}
    for name, joint in joints.items():
        shaft_nm = joint.model_facts.stall_torque_nm * (joint.torque_limit or 1.0)
        # At the position with the highest ratio of servo to joint rotation.
        own[name] = shaft_nm * (
            joint.make_linkage().steepest * 2.0 * pi / joint.model_facts.steps_per_turn
        )
    found = dict(own)
    for pair in couplings.values():
        if joints.keys() >= {*pair.joints}:
            both = own[pair.first] + own[pair.second]
            for name, ratio in zip(pair.joints, pair.rates[0], strict=True):
                found[name] = ratio * both
    return found


BASE = "base_link"
CAMERA, OPTICAL_FRAME = "camera_link", "camera_optical_frame"
SIDES = ("left", "right")

UP: Vec3 = (0.0, -1.0, 0.0)
_AXES: dict[str, Vec3] = {"yaw": (0.0, 0.0, 1.0), "pitch": UP, "roll": (1.0, 0.0, 0.0)}
_AXES |= {"pan": _AXES["yaw"], "tilt": UP}


class RigShape(NamedTuple):
    """Values of a rig's YAML from which a description is built.

    lids: angles of the lid joints shut and open
    image_px: width and height of the camera's frames
    meshes: meshes supplied by the user
    """

    name: str
    geometry: GeometryParams
    joints: Mapping[str, JointParams]
    lids: Mapping[str, LidEnds]
    couplings: Mapping[str, CouplingParams]
    camera: CameraParams
    mass: MassParams = MassParams()
    image_px: tuple[int, int] = (640, 480)
    meshes: tuple[OwnMesh, ...] = ()


def describe(rig: RigShape, *, looks: bool = True) -> Description:
    """Return the description of a rig.

    Args:
        rig: the rig.
        looks: include visual shapes; without them, the same mechanism is built much faster.
    """
    if not looks:
        return _Builder(rig, looks=False).description().without_looks()
    return with_own_meshes(_Builder(rig, looks=True).description(), rig.meshes)


def rig_mass_faults(rig: RigShape) -> Iterator[tuple[str, str]]:
    """Find masses that are impossible for such a head: key in the rig's file, and the fault."""
    built = describe(rig._replace(mass=MassParams()), looks=False)
    yield from mass_faults(rig.mass, _measures(rig.geometry), built)


def _measures(geometry: GeometryParams) -> HeadMeasures:
    pivot_m = (-geometry.eyes_ahead_mm / 1e3, 0.0, -geometry.eyes_above_mm / 1e3)
    return HeadMeasures(geometry.interocular_mm / 1e3, pivot_m)


class _Builder:
    def __init__(self, rig: RigShape, *, looks: bool) -> None:
        self._rig, self._looks = rig, looks
        self._torques = joint_torques_nm(rig.joints, rig.couplings)
        geometry = rig.geometry
        self._eyes_m: Vec3 = (geometry.eyes_ahead_mm / 1e3, 0.0, geometry.eyes_above_mm / 1e3)
        self._measures = _measures(geometry)
        self._links: list[Link] = []

    def description(self) -> Description:
        rig = self._rig
        neck = self._add_neck()
        first = len(self._links)
        for side in SIDES:
            self._add_eye(side)
        for name in LIDS:
            if name in rig.joints and name in rig.lids:
                self._add_lid(name)
        for name in further_joints(rig.joints):
            if name not in LOWER_NECK:
                place, axis = parts.facial_joint_axis(name, self._measures)
                joint = self._joint(name, axis)
                self._links.append(
                    parts.facial_part(link_name(name), HEAD, place, joint, self._measures)
                )
        self._links = [weighed(link, rig.mass) for link in self._links]
        self._links.insert(first, self._build_head(neck, self._links[first:]))
        camera = rig.camera
        x, y, z = camera.position_mm
        angles = radians(camera.yaw_deg), radians(camera.pitch_deg), radians(camera.roll_deg)
        holder = HEAD if camera.mount == "head" else BASE
        self._links.append(
            parts.camera(CAMERA, holder, (x / 1e3, y / 1e3, z / 1e3), rotation(angles))
        )
        self._links.append(Link(OPTICAL_FRAME, CAMERA, R=OPTICAL))
        field = radians(camera.horizontal_field_deg)
        frame = CameraFrame(CAMERA, OPTICAL_FRAME, field, *rig.image_px)
        # The links of the neck overlap each other, the shoulders and the head.
        necks = [link.name for link in self._links[1:first]]
        inside = [HEAD, *(link.name for link in self._links if link.parent == HEAD)]
        touching = [*combinations((BASE, *necks), 2), *product(necks, inside)]
        if not necks:
            touching += product((BASE,), inside)
        return Description(rig.name, tuple(self._links), frame, tuple(touching))

    def _joint(
        self, name: str, axis: Vec3, of: str = "", follows: LinkageFollower | None = None
    ) -> LinkJoint:
        own = self._rig.joints[of or name]
        limit = own.limit()
        return LinkJoint(
            name,
            axis,
            limit.low_rad,
            limit.high_rad,
            limit.speed_rad_s,
            self._torques[of or name],
            follows,
        )

    def _add_neck(self) -> str:
        """Add base and neck; return the link that carries the head."""
        geometry, joints = self._rig.geometry, self._rig.joints
        pivot = geometry.pitch_axis_height_mm / 1e3
        lower = geometry.lower_pitch_axis_height_mm / 1e3
        chain = [(name, lower) for name in LOWER_NECK if name in joints]
        chain += [(name, pivot) for name in NECK if name in joints]
        head_m = (self._eyes_m[0], 0.0, pivot + self._eyes_m[2])
        first = chain[0][1] if chain else pivot
        # A column about a yaw axis turns with that axis; other columns do not move.
        turns = bool(chain) and chain[0][0].endswith("yaw")
        self._links.append(
            parts.base(BASE, self._measures, head_m, 0.0 if turns else first, bool(chain))
        )
        below = first - parts.shoulders_m(self._measures, head_m) if turns else 0.0
        parent, at = BASE, 0.0
        heights = [height for _, height in chain[1:]] + [pivot]
        for (name, height), following in zip(chain, heights, strict=False):
            joint = self._joint(name, _AXES[name.rpartition("_")[2]])
            place = (0.0, 0.0, height - at)
            above = following - height
            self._links.append(
                parts.neck(link_name(name), parent, place, joint, self._measures, below, above)
            )
            parent, at, below = link_name(name), height, 0.0
        self._pivot_m: Vec3 = (0.0, 0.0, pivot - at)
        return parent

    def _build_head(self, neck: str, carried: list[Link]) -> Link:
        """Return the head without the links that it carries."""
        x, y, z = self._pivot_m
        ahead, _, above = self._eyes_m
        still = [
            (side, self._lid_meeting_rad(side))
            for side in SIDES
            if f"{side}_upper_lid" in self._rig.lids and f"{side}_lower_lid" not in self._rig.lids
        ]
        return parts.head(
            HEAD,
            neck,
            (x + ahead, y, z + above),
            self._measures,
            head_inertia(self._rig.mass, self._measures, carried_links(carried)),
            further_joints(self._rig.joints),
            still,
            self._looks,
        )

    def _add_eye(self, side: str) -> None:
        joints = self._rig.joints
        parent, place = HEAD, parts.eye_m(side, self._measures.interocular_m)
        for turn in ("pan", "tilt"):
            own, both = f"{side}_eye_{turn}", f"eyes_{turn}"
            if own in joints:
                joint = self._joint(own, _AXES[turn])
            elif both not in joints:
                continue
            elif any(link.joint and link.joint.name == both for link in self._links):
                name = f"{side}_eyes_{turn}"
                while name in joints:
                    name += "_"
                joint = self._joint(name, _AXES[turn], both, LinkageFollower(both))
            else:
                joint = self._joint(both, _AXES[turn])
            name = link_name(joint.name)
            ring = mass.gimbal(self._measures.eye_radius_m)
            self._links.append(Link(name, parent, place, joint=joint, inertia=ring))
            parent, place = name, (0.0, 0.0, 0.0)
        self._links.append(parts.eye(f"{side}_eye", parent, place, self._measures))

    def _add_lid(self, name: str) -> None:
        """Add a lid whose edge meets the other lid's at the rig's shut angle."""
        side, which, _ = name.split("_")
        shut, wide = self._rig.lids[name]
        opens = 1.0 if wide > shut else -1.0
        up = opens if which == "upper" else -opens
        meet = self._lid_meeting_rad(side)
        # Elevation of the edge above the eye's equator with the joint at 0.
        edge = meet - up * shut
        opened = parts.awake_opening_rad(which == "upper", meet, abs(wide - shut))
        awake = shut + copysign(opened, wide - shut)
        joint = self._joint(name, (0.0, -up, 0.0))._replace(awake_rad=awake)
        place = parts.eye_m(side, self._measures.interocular_m)
        self._links.append(
            parts.lid(link_name(name), HEAD, place, joint, self._measures, which == "upper", edge)
        )

    def _lid_meeting_rad(self, side: str) -> float:
        """Return the elevation at which the lids of an eye meet."""
        spans = [
            abs(wide - shut)
            for shut, wide in (
                self._rig.lids.get(f"{side}_{which}_lid", (0.0, 0.0))
                for which in ("upper", "lower")
            )
        ]
        return parts.meeting_rad(spans[0], spans[1])


def link_name(joint: str) -> str:
    """Return the name of the link that a joint moves."""
    name = f"{joint}_link"
    # The name of a joint may be base or camera.
    return f"{name}_" if name in (BASE, CAMERA) else name

"""What a rig file holds: the Params of every room, in one place.

Bounds stand with the values, in the rooms; the rules between sections stand here.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from config.load import load, read_yaml, shipped
from drivers.camera_params import CameraCareParams, WebcamParams
from drivers.dynamixel import DynamixelParams
from drivers.dynamixel_table import MODELS
from drivers.face_params import FaceDetectorParams
from drivers.motion_params import MotionParams
from drivers.oak_params import OakParams
from gaze.attention import AttentionParams
from gaze.aversion import AversionParams
from gaze.bottom_up import BottomUpParams
from gaze.breathing import BreathingParams
from gaze.field_of_view import FieldOfViewParams
from gaze.head import HeadParams
from gaze.idle import IdleParams
from gaze.lids import LidParams
from gaze.oculomotor import OculomotorParams
from gaze.pursuit import PursuitParams
from gaze.saccade import SaccadeParams
from gaze.scanpath import ScanpathParams, Walk
from gaze.top_down import TopDownParams
from gaze.types import PARTS
from robot.body import JointParams
from robot.frames import CameraParams
from robot.kinematics import GeometryParams
from robot.loop import LoopParams
from robot.safety.guard import Guard, GuardParams
from robot.seeing.tracks import TrackParams
from robot.types import JOINTS


@dataclass(frozen=True)
class Ranges:
    """Ranges a style of gaze keeps to, inside those of the rig's joints."""

    eye_yaw_deg: float = field(
        metadata={"low": 1.0, "high": 90.0, "unit": "deg", "says": "eye range to each side"}
    )
    eye_pitch_deg: float = field(
        metadata={"low": 1.0, "high": 90.0, "unit": "deg", "says": "eye range up and down"}
    )
    neck_yaw_deg: float = field(
        metadata={"low": 0.0, "high": 180.0, "unit": "deg", "says": "head range to each side"}
    )


@dataclass(frozen=True)
class BusConfig:
    """How the servos are reached."""

    port: str = field(metadata={"unit": "", "says": "serial port, e.g. /dev/ttyUSB0"})
    dynamixel: DynamixelParams = field(
        default_factory=DynamixelParams, metadata={"unit": "", "says": "Protocol 2.0 settings"}
    )


@dataclass(frozen=True)
class LidJoints:
    """Lid joint angles at which the lids are shut and fully open."""

    left_shut_deg: float = field(
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "left upper lid shut"}
    )
    left_open_deg: float = field(
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "left upper lid open"}
    )
    right_shut_deg: float = field(
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "right upper lid shut"}
    )
    right_open_deg: float = field(
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "right upper lid open"}
    )

    def __post_init__(self) -> None:
        """Check that the lids can move.

        Raises:
            ValueError: shut and open are the same angle.
        """
        if self.left_shut_deg == self.left_open_deg or self.right_shut_deg == self.right_open_deg:
            raise ValueError("a lid's shut and open angles must differ")


@dataclass(frozen=True)
class GazeConfig:
    """The gaze models."""

    field_of_view: FieldOfViewParams = field(
        default_factory=FieldOfViewParams, metadata={"says": "what an eye can see"}
    )
    bottom_up: BottomUpParams = field(
        default_factory=BottomUpParams, metadata={"says": "how motion pulls"}
    )
    top_down: TopDownParams = field(
        default_factory=TopDownParams, metadata={"says": "what a behaviour looks at"}
    )
    attention: AttentionParams = field(
        default_factory=AttentionParams, metadata={"says": "who wins"}
    )
    idle: IdleParams = field(default_factory=IdleParams, metadata={"says": "when nothing is there"})
    aversion: AversionParams = field(
        default_factory=AversionParams, metadata={"says": "looking away while talking"}
    )
    scanpath: ScanpathParams = field(
        default_factory=ScanpathParams, metadata={"says": "the walk over a face"}
    )
    saccade: SaccadeParams = field(
        default_factory=SaccadeParams, metadata={"says": "how the eyes jump"}
    )
    pursuit: PursuitParams = field(
        default_factory=PursuitParams, metadata={"says": "how the eyes follow"}
    )
    head: HeadParams = field(default_factory=HeadParams, metadata={"says": "how the head joins"})
    breathing: BreathingParams = field(
        default_factory=BreathingParams, metadata={"says": "the head's slow sway"}
    )
    lids: LidParams = field(default_factory=LidParams, metadata={"says": "blinks"})
    oculomotor: OculomotorParams = field(
        default_factory=OculomotorParams, metadata={"says": "how it all fits together"}
    )


@dataclass(frozen=True)
class Rig:
    """One head: its wires, its build, its limits and its manners."""

    name: str = field(metadata={"unit": "", "says": "name of the rig"})
    profile: str = field(
        metadata={"unit": "", "says": "name of a shipped profile or path of a YAML file"}
    )
    ranges: Ranges = field(metadata={"says": "how far eyes and head go; the profile says"})
    bus: BusConfig = field(metadata={"says": "servo bus"})
    geometry: GeometryParams = field(metadata={"says": "measures of the head"})
    joints: Mapping[str, JointParams] = field(metadata={"says": "one entry a joint"})
    lid_joints: LidJoints = field(metadata={"says": "lid angles"})
    park_deg: Mapping[str, float] = field(
        metadata={
            "low": -180.0,
            "high": 180.0,
            "unit": "deg",
            "says": "pose before torque goes off; joints left out go to 0",
        }
    )
    camera: CameraParams = field(
        default_factory=CameraParams, metadata={"says": "where the camera sits"}
    )
    webcam: WebcamParams = field(
        default_factory=WebcamParams, metadata={"says": "what is asked of a webcam"}
    )
    oak: OakParams = field(
        default_factory=OakParams, metadata={"says": "what is asked of an OAK-D"}
    )
    camera_care: CameraCareParams = field(
        default_factory=CameraCareParams, metadata={"says": "a camera that went away"}
    )
    motion: MotionParams = field(
        default_factory=MotionParams, metadata={"says": "how moving things are found"}
    )
    detector: FaceDetectorParams = field(
        default_factory=FaceDetectorParams, metadata={"says": "how faces are found"}
    )
    face_parts_mm: Mapping[str, tuple[float, float, float]] = field(
        default_factory=dict,
        metadata={
            "low": -300.0,
            "high": 300.0,
            "unit": "mm",
            "says": "a person's own places of face parts (DN FL LE M N FR RE UP) from the nose "
            "tip: out of the face, to the owner's left, up; those left out are an adult's",
        },
    )
    tracks: TrackParams = field(
        default_factory=TrackParams, metadata={"says": "how identities are kept"}
    )
    loop: LoopParams = field(default_factory=LoopParams, metadata={"says": "control loop"})
    guard: GuardParams = field(default_factory=GuardParams, metadata={"says": "safety"})
    gaze: GazeConfig = field(default_factory=GazeConfig, metadata={"says": "gaze models"})


def load_rig(name_or_path: str, character: str | None = None, profile: str | None = None) -> Rig:
    """Read a rig by shipped name or by path, with every rule checked.

    profile: name or path of a style of gaze, instead of the one that the rig names
    character: name or path of a file with differences, laid over both

    Raises:
        config.load.ConfigError: with every fault.
    """
    layers = layers_of(name_or_path, character, profile)
    return load(layers[-1], Rig, defaults=layers[:-1], checks=RULES)


def layers_of(
    name_or_path: str, character: str | None = None, profile: str | None = None
) -> list[Path]:
    """List the files that ``load_rig`` lays one over the other, the rig's own first.

    Raises:
        config.load.ConfigError: none of that name is shipped, or the rig cannot be read.
    """
    layers = [_find("rigs", name_or_path)]
    named = profile or read_yaml(layers[0]).data.get("profile")
    if isinstance(named, str):
        layers.append(_find("profiles", named))
    if character is not None:
        layers.append(_find("characters", character))
    return layers


def load_rules(name_or_path: str) -> TopDownParams:
    """Read a rule set, behaviour -> what to look at, by shipped name or by path.

    Raises:
        config.load.ConfigError: with every fault.
    """
    return load(_find("rules", name_or_path), TopDownParams)


def load_walk(name_or_path: str) -> Walk:
    """Read a scanpath walk by shipped name or by path.

    Raises:
        config.load.ConfigError: with every fault.
    """
    return load(_find("scanpaths", name_or_path), Walk)


def _find(kind: str, name_or_path: str) -> Path:
    """Take anything with a slash or a YAML ending as a path, anything else as a name."""
    looks_like_path = "/" in name_or_path or name_or_path.endswith((".yaml", ".yml"))
    if looks_like_path:
        return Path(name_or_path)
    return shipped(kind, name_or_path)


def _joint_names(rig: Rig) -> Iterable[tuple[str, str]]:
    for name in JOINTS:
        if name not in rig.joints:
            yield f"joints.{name}", f"joint {name} is missing; needed are {', '.join(JOINTS)}"
    for name in rig.joints:
        if name not in JOINTS:
            yield f"joints.{name}", f"unknown joint; known are {', '.join(JOINTS)}"


def _servo_ids(rig: Rig) -> Iterable[tuple[str, str]]:
    owner: dict[int, str] = {}
    for name, joint in rig.joints.items():
        if joint.id in owner:
            yield f"joints.{name}.id", f"id {joint.id} is already that of {owner[joint.id]}"
        owner.setdefault(joint.id, name)


def _models(rig: Rig) -> Iterable[tuple[str, str]]:
    for name, joint in rig.joints.items():
        if joint.model not in MODELS:
            known = ", ".join(sorted(MODELS))
            yield f"joints.{name}.model", f"unknown servo model {joint.model!r}; known are {known}"


def _lid_ranges(rig: Rig) -> Iterable[tuple[str, str]]:
    for side in ("left", "right"):
        joint = rig.joints.get(f"{side}_upper_lid")
        if joint is None:
            continue
        for end in ("shut", "open"):
            angle = getattr(rig.lid_joints, f"{side}_{end}_deg")
            if not joint.min_deg <= angle <= joint.max_deg:
                yield (
                    f"lid_joints.{side}_{end}_deg",
                    f"{angle} is outside the joint's range {joint.min_deg}..{joint.max_deg}",
                )


def _collisions(rig: Rig) -> Iterable[tuple[str, str]]:
    """Let the guard itself say whether its forbidden boxes leave any pose."""
    if any(name not in rig.joints for name in JOINTS):
        return
    try:
        Guard(rig.guard, tuple(rig.joints[name].limit() for name in JOINTS))
    except ValueError as error:
        yield "guard.collisions", str(error)


def _park_ranges(rig: Rig) -> Iterable[tuple[str, str]]:
    for name, angle in rig.park_deg.items():
        joint = rig.joints.get(name)
        if joint is None:
            yield f"park_deg.{name}", f"unknown joint; known are {', '.join(JOINTS)}"
        elif not joint.min_deg <= angle <= joint.max_deg:
            yield (
                f"park_deg.{name}",
                f"{angle} is outside the joint's range {joint.min_deg}..{joint.max_deg}",
            )


def _part_names(rig: Rig) -> Iterable[tuple[str, str]]:
    for code in rig.face_parts_mm:
        if code not in PARTS:
            yield f"face_parts_mm.{code}", f"unknown face part; parts are {', '.join(PARTS)}"


RULES = (_joint_names, _servo_ids, _models, _lid_ranges, _park_ranges, _part_names, _collisions)
"""What no single section of a rig can know."""

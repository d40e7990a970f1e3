"""What a rig file holds: the Params of every room, in one place.

Bounds stand with the values, in the rooms; the rules between sections in gazerig.config.rig_rules.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from gazerig.drivers.camera.oak_params import OakParams
from gazerig.drivers.camera.params import CameraCareParams, WebcamParams
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.feetech.params import FeetechParams
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.servo_models import BUS_KINDS
from gazerig.drivers.vision.face_params import FaceDetectorParams
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.gaze.attention import AttentionParams
from gazerig.gaze.aversion import AversionParams
from gazerig.gaze.bottom_up import BottomUpParams
from gazerig.gaze.breathing import BreathingParams
from gazerig.gaze.field_of_view import FieldOfViewParams
from gazerig.gaze.head import HeadParams
from gazerig.gaze.idle import IdleParams
from gazerig.gaze.lids import LidParams
from gazerig.gaze.oculomotor import OculomotorParams
from gazerig.gaze.pursuit import PursuitParams
from gazerig.gaze.saccade import SaccadeParams
from gazerig.gaze.scanpath import ScanpathParams
from gazerig.gaze.top_down import TopDownParams
from gazerig.robot.model.frames import CameraParams
from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LIDS, GeometryParams
from gazerig.robot.model.loop_params import LoopParams
from gazerig.robot.model.track_params import TrackParams
from gazerig.robot.model.types import in_order


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
    """How the servos on one port are reached."""

    port: str = field(metadata={"unit": "", "says": "serial port or I2C bus, e.g. /dev/ttyUSB0"})
    kind: str = field(
        default="dynamixel",
        metadata={"choices": BUS_KINDS, "unit": "", "says": "what the servos on it speak"},
    )
    dynamixel: DynamixelParams = field(
        default_factory=DynamixelParams,
        metadata={"unit": "", "says": "Protocol 2.0 settings, for kind dynamixel"},
    )
    feetech: FeetechParams = field(
        default_factory=FeetechParams,
        metadata={"unit": "", "says": "Feetech STS settings, for kind feetech"},
    )
    maestro: MaestroParams = field(
        default_factory=MaestroParams,
        metadata={"unit": "", "says": "Pololu Maestro settings, for kind maestro"},
    )
    pca9685: Pca9685Params = field(
        default_factory=Pca9685Params,
        metadata={"unit": "", "says": "PCA9685 settings, for kind pca9685"},
    )

    @property
    def baud(self) -> int:
        """Return the speed of its line in bit/s."""
        if self.kind == "dynamixel":
            return self.dynamixel.baud
        if self.kind == "pca9685":
            return self.pca9685.baud
        return self.feetech.baud if self.kind == "feetech" else self.maestro.baud

    @property
    def channels(self) -> float:
        """Return how many channels its boards have; inf where servos have ids instead."""
        if self.kind == "pca9685":
            return self.pca9685.channels
        return self.maestro.channels if self.kind == "maestro" else inf


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
    left_lower_shut_deg: float | None = field(
        default=None,
        metadata={
            "low": -180.0,
            "high": 180.0,
            "unit": "deg",
            "says": "left lower lid where it meets the upper one; null: there is none",
        },
    )
    left_lower_open_deg: float | None = field(
        default=None,
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "left lower lid open"},
    )
    right_lower_shut_deg: float | None = field(
        default=None,
        metadata={
            "low": -180.0,
            "high": 180.0,
            "unit": "deg",
            "says": "right lower lid where it meets the upper one; null: there is none",
        },
    )
    right_lower_open_deg: float | None = field(
        default=None,
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "right lower lid open"},
    )

    def __post_init__(self) -> None:
        """Check that the lids can move.

        Raises:
            ValueError: shut and open are the same angle, or one of them is missing.
        """
        for name in LIDS:
            shut, wide = self.ends_deg(name)
            if (shut is None) != (wide is None):
                raise ValueError(f"of the {name.replace('_', ' ')} one end is missing; give both")
            if shut is not None and shut == wide:
                raise ValueError("a lid's shut and open angles must differ")

    def ends_deg(self, name: str) -> tuple[float | None, float | None]:
        """Return the angles of the lid of a joint shut and open, None where they are not given."""
        shut, wide = (getattr(self, key) for key in self.keys(name))
        return shut, wide

    @staticmethod
    def keys(name: str) -> tuple[str, str]:
        """Return the keys of a lid joint's shut and open angle."""
        # "left_upper_lid" stands as left_shut_deg, "left_lower_lid" as left_lower_shut_deg.
        lid = name.removesuffix("_lid").removesuffix("_upper")
        return f"{lid}_shut_deg", f"{lid}_open_deg"


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
    buses: Mapping[str, BusConfig] = field(
        default_factory=dict,
        kw_only=True,
        metadata={"says": "further servo buses by name, for joints whose bus is that name"},
    )
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

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the joints, in the order of every sequence of them."""
        return in_order(self.joints)

    def bus_named(self, name: str) -> BusConfig:
        """Return a bus by its name, "" for the one without.

        Raises:
            KeyError: there is no such bus.
        """
        return self.buses[name] if name else self.bus

    def bus_of(self, joint: str) -> BusConfig:
        """Return the bus that a joint's servo is on.

        Raises:
            KeyError: there is no such joint, or no such bus.
        """
        return self.bus_named(self.joints[joint].bus)

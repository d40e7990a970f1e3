"""Content of a rig file: the Params of every package, in one place.

Bounds are with the values; ``plugins`` holds the sections of other packages' parts by their names
(gazerig.config.plugin_sections). The rules between sections are in gazerig.config.schema.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from gazerig.drivers.bus.servo_models import BUS_KINDS, BusKind
from gazerig.drivers.camera.params import OakParams, WebcamParams
from gazerig.drivers.dynamixel.control_table import DynamixelParams
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.maestro.board import MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Params
from gazerig.drivers.sound.params import SoundParams
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.gaze.attention.attention import AttentionParams
from gazerig.gaze.attention.bottom_up import BottomUpParams
from gazerig.gaze.attention.conversation import AversionParams, ConversationParams, LooksAway
from gazerig.gaze.attention.idle import IdleParams
from gazerig.gaze.attention.top_down import TopDownParams
from gazerig.gaze.lids.blink import LidParams
from gazerig.gaze.oculomotor.drift import DriftLaw
from gazerig.gaze.oculomotor.gaze_point import OculomotorParams
from gazerig.gaze.oculomotor.head import HeadParams
from gazerig.gaze.oculomotor.pursuit import PursuitParams
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.scanpath.scanpath import ScanpathParams
from gazerig.gaze.schedule import TrackStart
from gazerig.gaze.track.animation import LevelParams
from gazerig.params import Bounds, Choices, Unit, Unlisted
from gazerig.robot.model.clock import LoopParams
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.frames import CameraParams
from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import GeometryParams
from gazerig.robot.model.types import order_joints
from gazerig.robot.model.weight import MassParams


@dataclass(frozen=True)
class Ranges:
    """Ranges of a style of gaze, within those of the rig's joints."""

    eye_yaw_deg: Annotated[
        float, Bounds(1, 90), "largest eye rotation to the left and to the right"
    ]
    eye_pitch_deg: Annotated[float, Bounds(1, 90), "largest eye rotation up and down"]
    neck_yaw_deg: Annotated[
        float, Bounds(0, 180), "largest head rotation to the left and to the right"
    ]


@dataclass(frozen=True, kw_only=True)
class PluginSections:
    """Sections of other packages' parts by their names; no file contains this key."""

    plugins: Annotated[Mapping[str, Any], Unlisted()] = field(default_factory=dict)


@dataclass(frozen=True)
class BusConfig(PluginSections):
    """Connection to the servos on one port."""

    # fmt: off
    port: Annotated[str, "serial port or I2C bus, e.g. /dev/ttyUSB0"]
    kind: Annotated[BusKind, Choices(*BUS_KINDS), "type of the servos or board on this bus"] = "dynamixel"
    dynamixel: Annotated[DynamixelParams, "Protocol 2.0 settings, for kind dynamixel"] = DynamixelParams()
    feetech: Annotated[FeetechParams, "Feetech STS settings, for kind feetech"] = FeetechParams()
    maestro: Annotated[MaestroParams, "Pololu Maestro settings, for kind maestro"] = MaestroParams()
    pca9685: Annotated[Pca9685Params, "PCA9685 settings, for kind pca9685"] = Pca9685Params()
    # fmt: on

    @property
    def section(self) -> Any:
        """Return the parameters of its kind."""
        return self.plugins.get(self.kind) or getattr(self, self.kind)


_Degrees = Annotated[float, Bounds(-180, 180)]
_Millimetres = Annotated[float, Bounds(-300, 300)]
_LidPair = tuple[_Degrees, _Degrees]


@dataclass(frozen=True)
class LidJoints:
    """Lid joint angles at which the lids are shut and fully open."""

    # fmt: off
    left_deg: Annotated[_LidPair | None, "left upper lid: [shut, open]; null: no upper lid"] = None
    right_deg: Annotated[_LidPair | None, "right upper lid: [shut, open]; null: no upper lid"] = None
    left_lower_deg: Annotated[_LidPair | None, "left lower lid: [meets the upper one, open]; null: no lower lid"] = None
    right_lower_deg: Annotated[_LidPair | None, "right lower lid: [meets the upper one, open]; null: no lower lid"] = None
    # fmt: on

    def ends_deg(self, name: str) -> tuple[float, float] | None:
        """Return the angles of a joint's lid, shut and open; None if they are not given."""
        ends: tuple[float, float] | None = getattr(self, self.key(name))
        return ends

    @staticmethod
    def key(name: str) -> str:
        """Return the key of a lid joint, e.g. left_deg of left_upper_lid."""
        return f"{name.removesuffix('_lid').removesuffix('_upper')}_deg"


@dataclass(frozen=True)
class GazeConfig(PluginSections):
    """The gaze models."""

    # fmt: off
    bottom_up: Annotated[BottomUpParams, "bottom-up attention by motion"] = BottomUpParams()
    top_down: Annotated[TopDownParams, "gaze target of each behaviour"] = TopDownParams()
    chooser: Annotated[str, Choices("attention"), "selection of the gaze target: attention, or the rule of a package"] = "attention"
    attention: Annotated[AttentionParams, "who wins"] = AttentionParams()
    idle: Annotated[IdleParams, "idle gaze without a target"] = IdleParams()
    looks_away: Annotated[LooksAway,
        "looks away from a face; people: a speaker's often, mostly aside, a thinker's up, as measured in talk; none: never"] = "people"
    aversion: Annotated[AversionParams, "looks away in reported turns"] = AversionParams()
    conversation: Annotated[ConversationParams, "signs of listening"] = ConversationParams()
    scanpath: Annotated[ScanpathParams, "scanpath over a face"] = ScanpathParams()
    saccade: Annotated[SaccadeParams, "saccades of the eyes"] = SaccadeParams()
    pursuit: Annotated[PursuitParams, "smooth pursuit of the eyes"] = PursuitParams()
    head: Annotated[HeadParams, "head movements in gaze shifts"] = HeadParams()
    drift: Annotated[DriftLaw, "breathing, small random sway of a head at rest, and the motion of a speaker's"] = "people"
    lids: Annotated[LidParams, "blinks"] = LidParams()
    oculomotor: Annotated[OculomotorParams, "coordination of saccades, pursuit and head"] = OculomotorParams()
    # fmt: on


@dataclass(frozen=True)
class DoorParams:
    """A door to a voice stack, which begins and ends with the head."""

    # fmt: off
    address: Annotated[str, "of the voice stack; empty: the usual one"] = ""
    bind: Annotated[str, "HOST:PORT where the door listens; empty: the usual port, for this computer only"] = ""
    addressed: Annotated[bool, "the voice stack listens, without a wake word, when a person addresses the head"] = False
    # fmt: on


@dataclass(frozen=True, kw_only=True)
class Rig(PluginSections):
    """One head: buses, geometry, joints, limits and gaze."""

    # fmt: off
    name: Annotated[str, "name of the rig"]
    profile: Annotated[str, "name of a shipped profile or path of a YAML file"]
    character: Annotated[str | None,
        "name of a shipped character or path of a YAML file, applied over rig and profile; null: none"] = None
    ranges: Annotated[Ranges, "ranges of eyes and head; null: those of the profile"]
    bus: Annotated[BusConfig, "servo bus"]
    buses: Annotated[Mapping[str, BusConfig],
        "further servo buses by name; a joint selects its bus by this name"] = field(default_factory=dict)
    geometry: Annotated[GeometryParams, "dimensions of the head"]
    joints: Annotated[Mapping[str, JointParams], "one entry per joint"]
    lid_joints: Annotated[LidJoints, "lid angles of a rig with lids"] = LidJoints()
    couplings: Annotated[Mapping[str, CouplingParams],
        "pairs of joints that two servos move together, each pair under any name"] = field(default_factory=dict)
    mass: Annotated[MassParams, "masses and their balance"] = MassParams()
    park_deg: Annotated[Mapping[str, _Degrees],
        "pose to which the joints move before torque is switched off; omitted joints go to 0"] = field(default_factory=dict)
    camera: Annotated[CameraParams, "mount of the camera"] = CameraParams()
    webcam: Annotated[WebcamParams, "settings requested from a webcam"] = WebcamParams()
    oak: Annotated[OakParams, "settings requested from an OAK-D"] = OakParams()
    motion: Annotated[MotionParams, "detection of moving things"] = MotionParams()
    detector: Annotated[FaceDetectorParams, "detection of faces"] = FaceDetectorParams()
    face_parts_mm: Annotated[Mapping[str, tuple[_Millimetres, _Millimetres, _Millimetres]],
        "measured positions of one person's face parts (DN FL LE M N FR RE UP) relative to the nose tip: "
        "out of the face, to that person's left, up; omitted parts have an average adult's position"] = field(default_factory=dict)
    loop: Annotated[LoopParams, "control loop"] = LoopParams()
    guard: Annotated[GuardParams, "safety"] = GuardParams()
    gaze: Annotated[GazeConfig, "gaze models"] = GazeConfig()
    track_files: Annotated[tuple[str, ...], "YAML files with further tracks, relative to this file; file names are track names"] = ()
    schedule: Annotated[Mapping[str, TrackStart], "tracks that start by themselves, by name"] = field(default_factory=dict)
    sound: Annotated[SoundParams, "loudspeaker and voice"] = SoundParams()
    expressions: Annotated[Mapping[str, Mapping[str, _Degrees]], Unit("deg"),
        "facial expressions: name -> joint -> angle added to it; for a lid, to the open lid"] = field(default_factory=dict)
    expression_blend_s: Annotated[float, Bounds(0.05, 10), "time from one expression to another"] = 0.5
    levels: Annotated[Mapping[str, LevelParams],
        "values 0..1 that a program sets many times per second, such as a jaw's opening from loudness"] = field(default_factory=dict)
    doors: Annotated[Mapping[str, DoorParams],
        "voice stacks by the names of their doors, each in a process of its own"] = field(default_factory=dict)
    # fmt: on

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the joints, in the common order of all sequences."""
        return order_joints(self.joints)

    def bus_named(self, name: str) -> BusConfig:
        """Return a bus by its name; "" is the unnamed one.

        Raises:
            KeyError: the bus does not exist.
        """
        return self.buses[name] if name else self.bus

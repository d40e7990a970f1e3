"""Real or simulated parts to one robot: the only room that sees config and sim_mock."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from math import radians
from typing import NamedTuple, TypeVar

import numpy as np

from config.schema import Rig, load_rules, load_walk
from drivers.camera_depth import depth_at
from drivers.camera_poses import PoseRing
from drivers.dynamixel import DynamixelBus
from drivers.dynamixel_port import BlockingPort, BusPort
from drivers.errors import SetupError
from gaze.attention import Attention
from gaze.aversion import Aversion
from gaze.bottom_up import BottomUp
from gaze.breathing import Breathing
from gaze.field_of_view import FieldOfView
from gaze.head import Head
from gaze.idle import Idle
from gaze.lids import Lids
from gaze.oculomotor import Oculomotor
from gaze.pursuit import Pursuit
from gaze.saccade import Saccade, SaccadeParams
from gaze.scanpath import Scanpath, ScanpathParams, row_sums_note
from gaze.top_down import TopDown
from gaze.types import Angles2, Angles3, Mat3, Vec3
from robot.body import Body, JointParams
from robot.cameras import HeadPose, real_camera, scene_camera
from robot.choice import Choice
from robot.clock import Clock, RealClock, SimulatedClock
from robot.emulated_rig import emulated_servos
from robot.frames import CameraMount, CameraParams, NewestPose, PoseHistory, standing_still
from robot.kinematics import Kinematics
from robot.loop import LoopParams, Robot
from robot.perception import Perception
from robot.safety import Guard
from robot.tracks import Tracker
from robot.types import JOINTS, JointAngles
from sim_mock.ports import InProcessPort
from sim_mock.pty_bus import PtyBus
from sim_mock.scene import Scene
from sim_mock.scenes import scenes
from sim_mock.servo_chain import ServoChain, build_chain

P = TypeVar("P", ScanpathParams, SaccadeParams)


class Assembly(NamedTuple):
    """A robot with what belongs to running it.

    sent_digest: gives the SHA-256 of all bytes sent to the emulated bus, None elsewhere
    close: ends what was started for it; notes: what a person should know
    """

    robot: Robot
    clock: Clock
    loop: LoopParams
    park_rad: JointAngles
    mount: CameraMount
    poses: PoseHistory
    horizontal_field_deg: float
    scene: Scene | None
    sent_digest: Callable[[], str | None]
    close: Callable[[], None]
    notes: tuple[str, ...]


class _Wires(NamedTuple):
    """The servo port and, where it is emulated in this process, the chain behind it."""

    port: BusPort
    chain: ServoChain | None
    digest: Callable[[], str | None]
    close: Callable[[], None]


def assemble(rig: Rig, choice: Choice) -> Assembly:
    """Build the robot of a rig; nothing is opened but the emulated bus.

    Raises:
        config.load.ConfigError: the profile or walk that the rig names is at fault.
        drivers.errors.SetupError: a film or model file cannot be used.
    """
    if choice.rules is not None:
        gaze = replace(rig.gaze, top_down=load_rules(choice.rules))
        rig = replace(rig, gaze=gaze)
    scene = _scene(rig, choice.scene) if choice.scene is not None else None
    dice = [np.random.default_rng(child) for child in np.random.SeedSequence(choice.seed).spawn(6)]
    scanpath_dice, lid_dice, camera_dice, idle_dice, aversion_dice, landing_dice = dice
    clock: Clock = SimulatedClock() if choice.fast else RealClock()
    kinematics = _kinematics(rig)
    camera_params, notes = _camera_params(rig, choice, kinematics)
    walk = load_walk(rig.gaze.scanpath.walk)
    note = row_sums_note(walk)
    notes = (*notes, note) if note is not None else notes
    mount = CameraMount(camera_params)
    turns = PoseRing() if scene is None and mount.on_head else None
    remembering = PoseHistory if choice.placed_by == "capture" else NewestPose
    poses = remembering(kinematics, tell=_teller(kinematics, mount, turns))
    wires = _wires(rig, choice, clock)
    try:
        bus = DynamixelBus(
            wires.port, [rig.joints[name].setup(name) for name in JOINTS], rig.bus.dynamixel
        )
        body = Body(bus, rig.joints)
        lids = Lids(rig.gaze.lids, lid_dice)
        where = _true_head(wires.chain, body, kinematics, poses)
        robot = Robot(
            body,
            kinematics,
            scene_camera(rig, choice, scene, mount, where, camera_dice)
            if scene is not None
            else real_camera(rig, choice, clock, camera_params, turns),
            Perception(
                mount,
                camera_params.horizontal_field_deg,
                Tracker(rig.tracks),
                _own_parts(rig),
                camera_params.lens,
                depth_at,
            ),
            poses,
            _attention(rig, idle_dice),
            Scanpath(_scanpath_params(rig, choice), walk, scanpath_dice),
            Aversion(rig.gaze.aversion, aversion_dice),
            _oculomotor(rig, choice, kinematics, lids, landing_dice),
            lids,
            Guard(rig.guard, tuple(rig.joints[name].limit() for name in JOINTS)),
        )
    except BaseException:
        wires.close()
        raise
    park = tuple(radians(rig.park_deg.get(name, 0.0)) for name in JOINTS)
    return Assembly(
        robot,
        clock,
        rig.loop,
        park,
        mount,
        poses,
        camera_params.horizontal_field_deg,
        scene,
        wires.digest,
        wires.close,
        notes,
    )


def gaze_parts(rig: Rig, seed: int) -> tuple[Kinematics, Oculomotor]:
    """Give a rig's geometry and its oculomotor model, for looking without a camera."""
    lid_dice, landing_dice = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(2)
    )
    kinematics = _kinematics(rig)
    choice = Choice(mock=False, fast=False, seed=seed)
    lids = Lids(rig.gaze.lids, lid_dice)
    return kinematics, _oculomotor(rig, choice, kinematics, lids, landing_dice)


def _scene(rig: Rig, name: str) -> Scene:
    """Find a scene, and see that the rig has a rule for all that it makes the robot do."""
    known = scenes()
    if name not in known:
        raise SetupError(f"--scene {name}: unknown; scenes: {', '.join(sorted(known))}")
    scene = known[name]
    missing = [b for b in scene.behaviours if b not in rig.gaze.top_down.rules]
    if missing:
        raise SetupError(
            f"--scene {name}: the rig has no rule for {', '.join(missing)}; "
            "add it under gaze.top_down.rules"
        )
    return scene


def _own_parts(rig: Rig) -> dict[str, Vec3]:
    """Give the rig's own places of face parts in metres."""
    return {code: (x / 1e3, y / 1e3, z / 1e3) for code, (x, y, z) in rig.face_parts_mm.items()}


def _kinematics(rig: Rig) -> Kinematics:
    lids = rig.lid_joints
    return Kinematics(
        rig.geometry,
        (radians(lids.left_shut_deg), radians(lids.right_shut_deg)),
        (radians(lids.left_open_deg), radians(lids.right_open_deg)),
    )


def _camera_params(
    rig: Rig, choice: Choice, kinematics: Kinematics
) -> tuple[CameraParams, tuple[str, ...]]:
    """Take the rig's camera, standing still where its pictures cannot turn with the head."""
    what = choice.eyes
    turns = choice.video is None and choice.replay is None and not choice.mock
    if what is None or turns or rig.camera.mount == "base":
        return rig.camera, ()
    beside = "" if choice.video or choice.replay else " beside an emulated head"
    note = f"{what}{beside} does not turn with the head: the camera counts as standing still"
    return standing_still(rig.camera, kinematics), (note,)


def _wires(rig: Rig, choice: Choice, clock: Clock) -> _Wires:
    """Give the real port, an emulated bus in this process, or one on a pseudo-terminal."""
    if not choice.mock:
        port = choice.port if choice.port is not None else rig.bus.port
        return _Wires(BlockingPort(port), None, _no_digest, _nothing)
    specs = emulated_servos(rig)
    if not choice.fast:
        bus = PtyBus()
        return _Wires(
            BlockingPort(bus.start(specs, baud=rig.bus.dynamixel.baud)), None, _no_digest, bus.stop
        )
    sent = hashlib.sha256()
    chain = build_chain(specs, clock.now_s, baud=rig.bus.dynamixel.baud)
    return _Wires(InProcessPort(chain, sent.update), chain, sent.hexdigest, _nothing)


def _no_digest() -> str | None:
    return None


def _nothing() -> None:
    return None


def _teller(
    kinematics: Kinematics, mount: CameraMount, turns: PoseRing | None
) -> Callable[[float, Angles3], None] | None:
    """Give what tells the camera's process how its camera is turned, None where nobody asks."""
    if turns is None:
        return None

    def tell(t_s: float, head_rad: Angles3) -> None:
        turns.remember(t_s, np.array(mount.pose(*kinematics.head_pose(head_rad))[0]))

    return tell


def _true_head(
    chain: ServoChain | None, body: Body, kinematics: Kinematics, poses: PoseHistory
) -> HeadPose:
    """Give where the emulated head is: from the servos themselves where they are at hand."""
    if chain is None:
        return poses.head_pose

    def now(_: float) -> tuple[Mat3, Vec3]:
        q = body.angles(list(chain.positions_steps()))
        return kinematics.head_pose((q[6], q[7], q[8]))

    return now


def _scanpath_params(rig: Rig, choice: Choice) -> ScanpathParams:
    """Take the rig's scanpath, or another model by name."""
    params = rig.gaze.scanpath
    if choice.scanpath is None:
        return params
    return chosen(params, "model", choice.scanpath, "--scanpath")


def _saccade_params(rig: Rig, choice: Choice) -> SaccadeParams:
    """Take the rig's saccades, or another profile by name."""
    params = rig.gaze.saccade
    if choice.saccade is None:
        return params
    return chosen(params, "profile", choice.saccade, "--saccade")


def chosen(params: P, key: str, value: str, option: str) -> P:
    """Replace one key that has choices, as an option of the command line asks.

    Raises:
        drivers.errors.SetupError: the value is none of the choices.
    """
    (declared,) = (f for f in fields(params) if f.name == key)
    choices = declared.metadata["choices"]
    if value not in choices:
        raise SetupError(f"{option} {value}: unknown; there is {', '.join(choices)}")
    return replace(params, **{key: value})  # type: ignore[arg-type]


def _attention(rig: Rig, idle_dice: np.random.Generator) -> Attention:
    gaze = rig.gaze
    return Attention(
        gaze.attention,
        FieldOfView(gaze.field_of_view),
        BottomUp(gaze.bottom_up),
        TopDown(gaze.top_down),
        Idle(gaze.idle, idle_dice),
    )


def _oculomotor(
    rig: Rig,
    choice: Choice,
    kinematics: Kinematics,
    lids: Lids,
    landing_dice: np.random.Generator,
) -> Oculomotor:
    """Compose the models with the narrower of the rig's and the profile's ranges."""
    gaze, joints, ranges = rig.gaze, rig.joints, rig.ranges
    eyes = tuple(
        (
            _range(joints, f"{side}_eye_pan", ranges.eye_yaw_deg),
            _range(joints, f"{side}_eye_tilt", ranges.eye_pitch_deg),
        )
        for side in ("left", "right")
    )
    neck = (
        _range(joints, "neck_yaw", ranges.neck_yaw_deg),
        _range(joints, "neck_pitch", 180.0),
    )
    smallest = min(abs(end) for eye in eyes for span in eye for end in span)
    return Oculomotor(
        gaze.oculomotor,
        kinematics,
        (eyes[0], eyes[1]),
        Saccade(_saccade_params(rig, choice)),
        Pursuit(gaze.pursuit),
        Head(gaze.head, smallest, neck),
        lids,
        Breathing(gaze.breathing),
        landing_dice,
    )


def _range(joints: Mapping[str, JointParams], name: str, most_deg: float) -> Angles2:
    """Give a joint's range within +-most_deg, in radians."""
    joint = joints[name]
    return radians(max(joint.min_deg, -most_deg)), radians(min(joint.max_deg, most_deg))

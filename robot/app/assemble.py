"""Real or simulated parts to one robot: the only room that sees config and sim_mock."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import radians
from typing import NamedTuple, TypeVar

import numpy as np

from gazerig.config.schema import Rig, load_rules, load_walk
from gazerig.drivers.camera.depth_roi import depth_at
from gazerig.drivers.camera.pose_buffer import PoseRing
from gazerig.drivers.errors import SetupError
from gazerig.drivers.serial.list_ports import serial_ports
from gazerig.drivers.serial.port_owner import refuse_owner
from gazerig.drivers.types import ServoBus
from gazerig.gaze.attention import Attention
from gazerig.gaze.aversion import Aversion
from gazerig.gaze.bottom_up import BottomUp
from gazerig.gaze.breathing import Breathing
from gazerig.gaze.field_of_view import FieldOfView
from gazerig.gaze.head import Head
from gazerig.gaze.idle import Idle
from gazerig.gaze.lids import Lids
from gazerig.gaze.oculomotor import Oculomotor
from gazerig.gaze.pursuit import Pursuit
from gazerig.gaze.saccade import Saccade, SaccadeParams
from gazerig.gaze.scanpath import Scanpath, ScanpathParams, row_sums_note
from gazerig.gaze.top_down import TopDown
from gazerig.gaze.types import Angles3, Mat3, Vec3
from gazerig.params import choices_of
from gazerig.robot.app.bus_wiring import guarded_rig_bus, ports_of, rig_bus
from gazerig.robot.app.camera_factory import HeadPose, real_camera, scene_camera
from gazerig.robot.app.emulation import emulated_lines, place_of
from gazerig.robot.app.live_params import Parts, Placed, Retuner
from gazerig.robot.app.options import Choice
from gazerig.robot.app.rig_limits import (
    eye_limits,
    head_limits,
    lid_ends,
    limits,
    own_parts,
    park_rad,
)
from gazerig.robot.control.body import Body
from gazerig.robot.control.loop import Robot
from gazerig.robot.dashboard.snapshot import ShownRig
from gazerig.robot.model.clock import Clock, RealClock, SimulatedClock
from gazerig.robot.model.frames import (
    CameraMount,
    CameraParams,
    NewestPose,
    PoseHistory,
    standing_still,
)
from gazerig.robot.model.kinematics import NECK, Kinematics
from gazerig.robot.model.loop_params import LoopParams
from gazerig.robot.model.types import JointAngles
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.scenes.registry import scenes
from gazerig.sim_mock.scenes.scene import Scene

P = TypeVar("P", ScanpathParams, SaccadeParams)


class Assembly(NamedTuple):
    """A robot with what belongs to running it.

    sent_digest: gives the SHA-256 of all bytes sent to the emulated bus, None elsewhere
    close: ends what was started for it; notes: what a person should know
    retuner: holds the rig in force and puts changes into the running parts
    """

    robot: Robot
    clock: Clock
    mount: CameraMount
    poses: PoseHistory
    scene: Scene | None
    sent_digest: Callable[[], str | None]
    close: Callable[[], None]
    notes: tuple[str, ...]
    retuner: Retuner

    def shown(self) -> ShownRig:
        """Return how the rig is built now, as far as people are shown it."""
        rig, parts = self.retuner.rig, self.retuner.parts
        return ShownRig(
            parts.kinematics,
            limits(rig.joints),
            rig.guard.health,
            self.mount,
            radians(self.horizontal_field_deg),
            rig.gaze.field_of_view,
        )

    def camera(self) -> CameraParams:
        """Return lens and place of the camera as they are believed now."""
        return self.retuner.camera

    @property
    def loop(self) -> LoopParams:
        """Return the rate and the time for parking in force now."""
        return self.retuner.loop

    @property
    def park_rad(self) -> JointAngles:
        """Return the pose before torque goes off, as it is now."""
        return self.retuner.park_rad

    @property
    def horizontal_field_deg(self) -> float:
        """Return the camera's field of view as it is believed now."""
        return self.retuner.horizontal_field_deg


class _Wires(NamedTuple):
    """The bus of the rig, and what is emulated behind it in this process, by the bus's name."""

    bus: ServoBus
    devices: Mapping[str, Device]
    digest: Callable[[], str | None]
    close: Callable[[], None]


def assemble(rig: Rig, choice: Choice) -> Assembly:
    """Build the robot of a rig; nothing is opened but the emulated bus.

    Raises:
        gazerig.config.load.ConfigError: the profile or walk that the rig names is at fault.
        SetupError: a film or model file cannot be used.
    """
    rig = _as_chosen(rig, choice)
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
        body = _body(rig, wires)
        lids = Lids(rig.gaze.lids, lid_dice)
        where = _true_head(wires.devices, rig, poses)
        tracker = Tracker(rig.tracks)
        moves = _movers(rig)
        decides = _deciders(rig, idle_dice)
        parts = Parts(
            body=body,
            guard=_guard(rig, body),
            kinematics=kinematics,
            camera=scene_camera(rig, choice, scene, mount, where, camera_dice)
            if scene is not None
            else real_camera(rig, choice, clock, camera_params, turns),
            mount=mount,
            perception=Perception(
                mount,
                camera_params.horizontal_field_deg,
                tracker,
                own_parts(rig),
                camera_params.lens,
                depth_at,
            ),
            tracker=tracker,
            attention=Attention(rig.gaze.attention, *decides),
            field_of_view=decides.field_of_view,
            bottom_up=decides.bottom_up,
            top_down=decides.top_down,
            idle=decides.idle,
            scanpath=Scanpath(rig.gaze.scanpath, walk, scanpath_dice),
            aversion=Aversion(rig.gaze.aversion, aversion_dice),
            oculomotor=_oculomotor(rig, kinematics, moves, lids, landing_dice),
            saccade=moves.saccade,
            pursuit=moves.pursuit,
            head=moves.head,
            breathing=moves.breathing,
            lids=lids,
        )
        robot = _robot(parts, poses)
    except BaseException:
        wires.close()
        raise
    placed = Placed(lambda rig: _camera_params(rig, choice, kinematics)[0], camera_params.mount)
    retuner = robot.tune = Retuner(parts, rig, placed)
    return Assembly(robot, clock, mount, poses, scene, wires.digest, wires.close, notes, retuner)


def _body(rig: Rig, wires: _Wires) -> Body:
    gentle_deg_s = rig.guard.gentle_speed_deg_s
    return Body(wires.bus, rig.joints, park_rad(rig), gentle_deg_s)


def _guard(rig: Rig, body: Body) -> Guard:
    return Guard(rig.guard, limits(rig.joints), body.names, body.reach, 1.0 / rig.loop.rate_hz)


def _robot(parts: Parts, poses: PoseHistory) -> Robot:
    return Robot(
        parts.body,
        parts.kinematics,
        parts.camera,
        parts.perception,
        poses,
        parts.attention,
        parts.scanpath,
        parts.aversion,
        parts.oculomotor,
        parts.lids,
        parts.guard,
    )


def _as_chosen(rig: Rig, choice: Choice) -> Rig:
    """Return the rig with what the command line says otherwise."""
    gaze = rig.gaze
    if choice.rules is not None:
        gaze = replace(gaze, top_down=load_rules(choice.rules))
    if choice.scanpath is not None:
        scanpath = chosen(gaze.scanpath, "model", choice.scanpath, "--scanpath")
        gaze = replace(gaze, scanpath=scanpath)
    if choice.saccade is not None:
        saccade = chosen(gaze.saccade, "profile", choice.saccade, "--saccade")
        gaze = replace(gaze, saccade=saccade)
    return replace(rig, gaze=gaze)


def gaze_parts(rig: Rig, seed: int) -> tuple[Kinematics, Oculomotor]:
    """Return a rig's geometry and its oculomotor model, for looking without a camera."""
    lid_dice, landing_dice = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(2)
    )
    kinematics = _kinematics(rig)
    lids = Lids(rig.gaze.lids, lid_dice)
    return kinematics, _oculomotor(rig, kinematics, _movers(rig), lids, landing_dice)


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


def _kinematics(rig: Rig) -> Kinematics:
    return Kinematics(rig.geometry, rig.joints, lid_ends(rig))


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
    """Return the real port, an emulated bus in this process, or one on a pseudo-terminal."""
    if not choice.mock:
        paths, here = ports_of(rig, choice.port), serial_ports()
        for name, path in paths.items():
            refuse_owner(path, rig.bus_named(name).kind, here)
        return _Wires(guarded_rig_bus(rig, paths), {}, _no_digest, _nothing)
    lines = emulated_lines(rig)
    if not choice.fast:
        buses = PtyBuses()
        return _Wires(guarded_rig_bus(rig, buses.start(lines)), {}, _no_digest, buses.stop)
    sent = hashlib.sha256()
    devices = {name: build(line, clock.now_s) for name, line in lines.items()}
    ports = {name: InProcessPort(device, sent.update) for name, device in devices.items()}
    return _Wires(rig_bus(rig, ports), devices, sent.hexdigest, _nothing)


def _no_digest() -> str | None:
    return None


def _nothing() -> None:
    return None


def _teller(
    kinematics: Kinematics, mount: CameraMount, turns: PoseRing | None
) -> Callable[[float, Angles3], None] | None:
    """Return what tells the camera's process how its camera is turned, None where nobody asks."""
    if turns is None:
        return None

    def tell(t_s: float, head_rad: Angles3) -> None:
        turns.remember(t_s, np.array(mount.pose(*kinematics.head_pose(head_rad))[0]))

    return tell


def _true_head(devices: Mapping[str, Device], rig: Rig, poses: PoseHistory) -> HeadPose:
    """Return where the emulated head is: from the servos themselves where they are at hand.

    It is built as the rig says now, whatever is believed of it later.
    """
    if not devices:
        return poses.head_pose
    kinematics = _kinematics(rig)
    axes = [
        (i, rig.joints[name].made(), devices[rig.joints[name].bus], place_of(rig, name))
        for i, name in enumerate(NECK)
        if name in rig.joints
    ]

    def now(_: float) -> tuple[Mat3, Vec3]:
        angles = [0.0, 0.0, 0.0]
        for i, linkage, device, place in axes:
            angles[i] = linkage.angle_rad(device.positions_steps()[place])
        return kinematics.head_pose((angles[0], angles[1], angles[2]))

    return now


def chosen(params: P, key: str, value: str, option: str) -> P:
    """Replace one key that has choices, as an option of the command line asks.

    Raises:
        SetupError: the value is none of the choices.
    """
    choices = choices_of(type(params), key)
    if value not in choices:
        raise SetupError(f"{option} {value}: unknown; there is {', '.join(choices)}")
    return replace(params, **{key: value})  # type: ignore[arg-type]


class _Deciders(NamedTuple):
    """What attention decides between."""

    field_of_view: FieldOfView
    bottom_up: BottomUp
    top_down: TopDown
    idle: Idle


def _deciders(rig: Rig, idle_dice: np.random.Generator) -> _Deciders:
    gaze = rig.gaze
    return _Deciders(
        FieldOfView(gaze.field_of_view),
        BottomUp(gaze.bottom_up),
        TopDown(gaze.top_down),
        Idle(gaze.idle, idle_dice),
    )


class _Movers(NamedTuple):
    """What moves eyes and head."""

    saccade: Saccade
    pursuit: Pursuit
    head: Head
    breathing: Breathing


def _movers(rig: Rig) -> _Movers:
    gaze = rig.gaze
    return _Movers(
        Saccade(gaze.saccade),
        Pursuit(gaze.pursuit),
        Head(gaze.head, *head_limits(rig)),
        Breathing(gaze.breathing),
    )


def _oculomotor(
    rig: Rig,
    kinematics: Kinematics,
    moves: _Movers,
    lids: Lids,
    landing_dice: np.random.Generator,
) -> Oculomotor:
    """Compose the models with the narrower of the rig's and the profile's ranges."""
    return Oculomotor(
        rig.gaze.oculomotor,
        kinematics,
        eye_limits(rig),
        moves.saccade,
        moves.pursuit,
        moves.head,
        lids,
        moves.breathing,
        landing_dice,
    )

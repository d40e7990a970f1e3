"""Assembly of a robot from real or simulated parts, with config and sim_mock."""

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from math import radians
from typing import NamedTuple, TypeVar

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.schema import load_walk
from gazerig.config.shipped_files import shipped_names
from gazerig.config.tracks import tracks_of
from gazerig.drivers.types import Camera
from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.bottom_up import BottomUp
from gazerig.gaze.attention.conversation import ConversationGaze
from gazerig.gaze.attention.idle import Idle
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.scanpath.scanpath import Scanpath, Walk, row_sums_note
from gazerig.gaze.track.animation import Animation
from gazerig.robot.dashboard.feed.rig_feed import ShownRig
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.chooser import TargetChooser
from gazerig.robot.loop.loop import Robot
from gazerig.robot.loop.track_choices import TrackChoices
from gazerig.robot.model.clock import Clock, LoopParams, RealClock, SimulatedClock
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.scene import BoxingScene
from gazerig.robot.model.types import JointAngles, further_joints
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.pixel_to_world import PixelToWorld
from gazerig.robot.run.browser_camera import BrowserCamera
from gazerig.robot.run.camera_factory import (
    browser_camera,
    camera_placement,
    camera_poses,
    run_camera,
)
from gazerig.robot.run.gaze_models import motion_models, oculomotor, rig_kinematics, target_chooser
from gazerig.robot.run.live_params import Components, LiveParams
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.program_parts import NO_PARTS, ProgramParts
from gazerig.robot.run.rig_description import sag_compensation, shape_of
from gazerig.robot.run.rig_limits import face_parts_m, face_tables, lid_spans, limits, park_rad
from gazerig.robot.run.rig_weight import park_note
from gazerig.robot.run.run_bus import RunBus, run_bus
from gazerig.robot.run.run_rig import scene_of, with_options
from gazerig.robot.run.surroundings import RunRoom, surroundings
from gazerig.robot.run.track_file import TrackFolder
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.scenes.scene import Scene

T = TypeVar("T")


def _identity(part: T) -> T:
    return part


class Assembly(NamedTuple):
    """A robot and the parts that run it.

    sent_bytes_digest: returns the SHA-256 of all bytes to the emulated bus, None for another bus
    close: ends the processes started for the robot; notes: messages for the user
    live_params: holds the present rig and applies changes to the running parts
    inject_fault: executes a fault command of the emulated servos, None for real or ideal ones
    room: the surroundings of --world, None without
    browser: a browser's camera that may replace the emulated rig's, None for other rigs
    """

    robot: Robot
    clock: Clock
    mount: CameraMount
    poses: PoseHistory
    scene: Scene | None
    sent_bytes_digest: Callable[[], str | None]
    close: Callable[[], None]
    notes: tuple[str, ...]
    live_params: LiveParams
    inject_fault: Callable[[str], str] | None = None
    room: RunRoom | None = None
    browser: BrowserCamera | None = None

    def shown_rig(self) -> ShownRig:
        """Return the visible structure of the present rig."""
        rig, parts = self.live_params.rig, self.live_params.parts
        return ShownRig(
            parts.kinematics,
            self.mount,
            radians(self.horizontal_field_deg),
            shape_of(rig),
        )

    def camera_params(self) -> CameraParams:
        """Return the present lens and placement of the camera."""
        return self.live_params.camera

    @property
    def loop(self) -> LoopParams:
        """Return the rate of the loop."""
        return self.live_params.rig.loop

    @property
    def park_rad(self) -> JointAngles:
        """Return the present pose for parking, before torque is switched off."""
        return self.live_params.park_rad

    @property
    def horizontal_field_deg(self) -> float:
        """Return the present field of view of the camera."""
        return self.live_params.horizontal_field_deg


class Substitutes(NamedTuple):
    """Wrappers or replacements of the rig's own parts; each gets the rig's own part.

    program: objects of a program, which are checked and supervised
    """

    body: Callable[[Body], Body] = _identity
    camera: Callable[[Camera], Camera] = _identity
    perception: Callable[[Perception], Perception] = _identity
    chooser: Callable[[TargetChooser], TargetChooser] = _identity
    program: ProgramParts = NO_PARTS


RIGS_OWN = Substitutes()


def assemble(
    rig: Rig,
    options: RunOptions,
    substitutes: Substitutes = RIGS_OWN,
) -> Assembly:
    """Build the robot of a rig once; only the emulated bus is opened.

    Args:
        rig: the configuration.
        options: options of the run.
        substitutes: wrappers or replacements of the rig's own parts, by a recording, a rerun or a
            calibration.

    Raises:
        gazerig.config.load.ConfigError: the profile or walk that the rig names is invalid.
        SetupError: a film or model file cannot be used.
    """
    rig = with_options(rig, options)
    seeds = np.random.SeedSequence(options.seed).spawn(len(_Generators._fields))
    random = _Generators(*map(np.random.default_rng, seeds))
    kinematics = rig_kinematics(rig)
    camera, notes = camera_placement(rig, options, kinematics)
    walk = load_walk(rig.gaze.scanpath.transition_matrix)
    clock: Clock = SimulatedClock() if options.fast else RealClock()
    world = options.world
    room = surroundings(world).open(rig, options, clock) if world is not None else None
    if room is None:
        scene = scene_of(rig, options)
        opened = run_bus(rig, options, clock)
    else:
        scene, clock, opened = room.scene, room.clock, room.run_bus
    messages: list[str] = []
    try:
        drawn = options.pixels or (room is not None and not options.no_pictures)
        in_process = scene is None or (drawn and not options.fast)
        sight = camera_poses(kinematics, camera, in_process)
        program = substitutes.program
        if room is not None:
            seen = room.camera(rig, options, sight, camera, random.camera, program, messages.append)
        else:
            seen = run_camera(
                rig, options, scene, sight, opened, random.camera, camera, clock, program,
            )  # fmt: skip
        body = Body(
            opened.bus,
            rig.joints,
            park_rad(rig),
            rig.couplings.values(),
            None if options.bus == "ideal" else sag_compensation(rig),
            messages.append if options.recover else None,
        )
        parts = _build_components(
            rig, body, kinematics, seen, sight.mount, camera, walk, random, options.rig
        )
        browser: BrowserCamera | None = None

        def placement() -> CameraParams:
            in_use = browser is not None and browser.in_use
            return camera_placement(rig, options, kinematics, in_use)[0]

        live = LiveParams(parts, rig, placement)
        robot = _build_robot(parts, sight.poses, live, substitutes, rig, messages)
        close = opened.close
        if options.mock and not options.fast:
            own_camera = robot.camera

            def use(camera: Camera | None) -> None:
                robot.camera = own_camera if camera is None else camera
                sight.mount.retune(live.camera)

            browser = browser_camera(rig, clock, use, messages.append)
            close = partial(_close, browser, own_camera, opened)
        if room is not None and isinstance(scene, BoxingScene) and scene.opponent is not None:
            robot.set_opponent(scene.opponent, room.start_s)
    except BaseException:
        opened.close()
        raise

    # A shipped walk is reported only if verbose.
    shipped = rig.gaze.scanpath.transition_matrix in shipped_names("scanpaths")
    note = row_sums_note(walk) if options.verbose or not shipped else None
    if note is not None:
        notes = (*notes, note)
    if (parks := park_note(rig)) is not None:
        notes = (*notes, parks)
    return Assembly(
        robot, clock, sight.mount, sight.poses, scene, opened.sent_bytes_digest, close, notes, live,
        opened.inject_fault, room, browser,
    )  # fmt: skip


def _close(browser: BrowserCamera, own_camera: Camera, run_bus: RunBus) -> None:
    """Close what the robot has not closed: the camera that it does not use, and its bus."""
    with ExitStack() as stack:
        stack.callback(run_bus.close)
        if browser.in_use:
            stack.callback(own_camera.close)
        browser.close()


class _Generators(NamedTuple):
    """One random generator per model, so that no model depends on the draws of another."""

    scanpath: np.random.Generator
    lids: np.random.Generator
    camera: np.random.Generator
    idle: np.random.Generator
    aversion: np.random.Generator
    endpoint: np.random.Generator
    reaction: np.random.Generator
    head: np.random.Generator
    drift: np.random.Generator
    stays: np.random.Generator
    turns: np.random.Generator


def _build_components(
    rig: Rig,
    body: Body,
    kinematics: Kinematics,
    seen: Camera,
    mount: CameraMount,
    placed: CameraParams,
    walk: Walk,
    random: _Generators,
    rig_file: str,
) -> Components:
    """Build all components that have parameters."""
    lids = Lids(rig.gaze.lids, random.lids)
    moves = motion_models(rig, random.head, random.drift)
    gaze, bottom_up = rig.gaze, BottomUp(rig.gaze.bottom_up)
    top_down, idle = TopDown(gaze.top_down), Idle(gaze.idle, random.idle)
    attention = Attention(gaze.attention, bottom_up, top_down, idle, random.reaction, random.stays)
    looks_away = gaze.looks_away, gaze.aversion, gaze.conversation
    animation = Animation(further_joints(rig.joints), face_tables(rig))
    return Components(
        body=body,
        guard=Guard(
            rig.guard,
            limits(rig.joints),
            body.names,
            body.configured_limits,
            1.0 / rig.loop.rate_hz,
        ),
        kinematics=kinematics,
        camera=seen,
        mount=mount,
        perception=Perception(
            mount,
            placed.horizontal_field_deg,
            face_parts_m(rig),
            placed.lens,
            kinematics.body_volumes,
        ),
        attention=attention,
        bottom_up=bottom_up,
        top_down=top_down,
        idle=idle,
        scanpath=Scanpath(rig.gaze.scanpath, walk, random.scanpath),
        conversation=ConversationGaze(*looks_away, attention, random.aversion, random.turns),
        oculomotor=oculomotor(rig, kinematics, moves, lids, random.endpoint),
        saccade=moves.saccade,
        pursuit=moves.pursuit,
        head=moves.head,
        drift=moves.drift,
        lids=lids,
        animation=animation,
        tracks=TrackChoices(
            tracks_of(rig.track_files),
            animation.tracks,
            rig.names,
            lid_spans(rig),
            face_tables(rig),
            rig.gaze.oculomotor.eye_lag_ms / 1e3,
            TrackFolder(rig_file).changes,
        ),
    )


def _build_robot(
    parts: Components,
    poses: PoseHistory,
    live: LiveParams,
    substitutes: Substitutes,
    rig: Rig,
    messages: list[str],
) -> Robot:
    chooser = substitutes.program.make_chooser(target_chooser(rig, parts.attention))
    return Robot(
        substitutes.body(parts.body),
        parts.kinematics,
        substitutes.camera(parts.camera),
        substitutes.perception(parts.perception),
        poses,
        substitutes.chooser(chooser),
        parts.scanpath,
        parts.conversation,
        parts.oculomotor,
        parts.lids,
        parts.animation,
        parts.tracks,
        parts.guard,
        live,
        PixelToWorld(parts.mount, poses, lambda: live.camera),
        messages,
    )

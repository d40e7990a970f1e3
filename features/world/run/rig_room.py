"""Rig in a world with physics: its bus, its camera, and the shapes of the world."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.camera.capture_loop import CameraParts
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.types import Camera, FaceDetector
from gazerig.features.world.run.poses import RigInState, SimulatedPoses, WorldPoses
from gazerig.features.world.run.run_world import RunWorld
from gazerig.features.world.run.sight import (
    LATENCY_MS,
    RenderedSource,
    RenderedWorld,
)
from gazerig.features.world.serve import SentWorld
from gazerig.features.world.shapes import SpecShapes
from gazerig.features.world.world_scene import WorldScene
from gazerig.features.world.world_spec import state_file
from gazerig.robot.model.clock import Clock
from gazerig.robot.run.buses import RunBus, guarded_rig_bus, ideal_run_bus, in_process_run_bus
from gazerig.robot.run.cameras import CameraView
from gazerig.robot.run.emulated import emulated_lines
from gazerig.robot.run.models import rig_kinematics
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_limits import servo_configs
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.pty.client import PtyBuses


@dataclass(frozen=True)
class RigRoom:
    """A world from the view of its rig, whose emulated servos are in it."""

    world: RunWorld
    clock: Clock
    run_bus: RunBus
    head: WorldPoses | SimulatedPoses

    @property
    def scene(self) -> WorldScene:
        """Return the people in the world, in the frame of the rig."""
        return self.world.scene

    def camera(
        self,
        rig: Rig,
        options: RunOptions,
        view: CameraView,
        rng: np.random.Generator,
        detector: Callable[[], FaceDetector],
    ) -> Camera:
        """Return the rig's camera; called only once.

        Args:
            rig: Rig with the parameters of detectors.
            options: Options of the run.
            view: Placement of the camera.
            rng: Random numbers of its noise.
            detector: Creates the face detector.

        Raises:
            NoRenderer: nothing on this machine can render.
        """
        world, poses, locate = self.world, self.head, view.locate
        if options.no_pictures:
            params = FrameParams(horizontal_field_deg=view.params.horizontal_field_deg)
            return SceneCamera(
                params, world.scene, view.mount, poses.head, rng, locate, self.start_s
            )
        rendered = RenderedWorld(world.spec, view.mount, view.params, rng, world.camera, poses)
        if isinstance(poses, SimulatedPoses):
            motion = view.motion(rig.motion)()
            return rendered.pixels(poses.head, detector(), LATENCY_MS, motion, locate)
        source = partial(RenderedSource, rendered, poses)
        parts = CameraParts(source, detector, view.motion(rig.motion), locate)
        return CameraWorker(parts, self.clock.now_s)

    def start_s(self) -> float | None:
        """Return the start time of the script of the people, None before it."""
        return self.head.begin_s

    def shapes(self) -> SpecShapes:
        """Return the shapes of the world."""
        return SpecShapes(self.world.spec.figures, self.world.spec.mjcf_file)


def open_room(rig: Rig, options: RunOptions, clock: Clock, world: RunWorld) -> RigRoom:
    """Return a world with one rig; for a run with these options.

    Raises:
        SetupError: the world cannot be used; the message gives the reason.
    """
    lines = emulated_lines(rig)
    if not options.fast:
        buses = PtyBuses()
        paths = buses.start(
            lines, lambda folder: SentWorld(world.spec.with_shared_file(folder), folder)
        )
        run_bus = RunBus(guarded_rig_bus(rig, paths), close=buses.stop, inject_fault=buses.command)
        head = WorldPoses(state_file(buses.folder), RigInState(rig_kinematics(rig), buses.joints))
        return RigRoom(world.served(buses.folder), clock, run_bus, head)
    computed = world.computed(clock.now_s)
    if options.bus == "ideal":
        # Imports MuJoCo, which only runs in a world need.
        from gazerig.features.world.ideal_bus import WorldIdealBus

        measured = [rig.joints[name].model_facts.measures_position for name in rig.names]
        shafts = computed.ideal_shafts()
        ideal = WorldIdealBus(servo_configs(rig), shafts, measured, computed.now_s)
        run_bus = ideal_run_bus(rig, ideal)
    else:
        devices = {name: computed.device(line, name) for name, line in lines.items()}
        run_bus = in_process_run_bus(rig, devices)
    joints = RigInState(rig_kinematics(rig), computed.model.rig.qpos)
    return RigRoom(world, clock, run_bus, SimulatedPoses(computed, clock, joints))

"""Rig in a world with physics: its bus, its camera, and the shapes of the world."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.types import Camera
from gazerig.features.world.other_heads import HeadInState, OtherHeads
from gazerig.features.world.run.poses import RigInState, SimulatedPoses, WorldPoses
from gazerig.features.world.run.recorded_world import recorded_world_info
from gazerig.features.world.run.run_world import RunWorld, ServedRig, world_ideal_bus
from gazerig.features.world.run.sight import RenderedWorld, world_camera
from gazerig.features.world.shapes import shapes_of
from gazerig.features.world.world_spec import state_file
from gazerig.robot.app.bus_wiring import guarded_rig_bus
from gazerig.robot.app.camera_factory import frame_locator
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.program_parts import ProgramParts
from gazerig.robot.app.run_bus import (
    CameraPoses,
    RunBus,
    emulated_lines,
    ideal_run_bus,
    in_process_run_bus,
)
from gazerig.robot.description.world_shapes import WorldShapes
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.frames import CameraParams
from gazerig.robot.recording.run_info import WorldInfo
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.features.world.physics import World


@dataclass(frozen=True)
class RigRoom:
    """``RunRoom`` of gazerig.robot.app.surroundings: a world from the view of one of its rigs."""

    world: RunWorld
    clock: Clock
    run_bus: RunBus
    head: WorldPoses | SimulatedPoses
    heads: OtherHeads | None = None
    info: WorldInfo | None = None
    placement: tuple[float, ...] = ()

    @property
    def scene(self) -> Scene:
        """Return the people in the world, in the frame of the rig."""
        return self.world.scene

    def camera(
        self,
        rig: Rig,
        options: RunOptions,
        sight: CameraPoses,
        placed: CameraParams,
        rng: np.random.Generator,
        own: ProgramParts,
        say: Callable[[str], None],
    ) -> Camera:
        """Return the rig's camera; arguments as of ``RunRoom.camera``."""
        world = self.world
        rendered = RenderedWorld(
            world.spec, world.scene, sight.mount, placed, rng, world.camera, world.number
        )
        return world_camera(
            rig,
            options,
            rendered,
            self.head,
            frame_locator(placed),
            self.clock,
            sight.turns,
            own,
            say,
        )

    def start_s(self) -> float | None:
        """Return the start time of the script of the people, None before it."""
        return self.head.begin_s

    def shapes(self) -> WorldShapes:
        """Return the shapes of the world, with the other heads if another process computes it."""
        return shapes_of(self.world.spec, self.heads)

    def world_info(self) -> WorldInfo | None:
        """Return the recording's entry for the world, None before the people's script began."""
        start_s = self.start_s()
        return None if self.info is None or start_s is None else replace(self.info, start_s=start_s)


def open_room(rig: Rig, options: RunOptions, clock: Clock, world: RunWorld) -> RigRoom:
    """Return a world with one rig; arguments as of ``Surroundings.open``.

    Raises:
        SetupError: the world cannot be used; the message gives the reason.
    """
    if options.fast:
        return simulated_room(rig, options, clock, world, world.computed(clock.now_s))
    buses = PtyBuses()
    served = ServedRig(buses, buses.start(emulated_lines(rig), world.spec), buses.stop)
    return served_room(rig, options, clock, world.served(buses.folder), served)


def simulated_room(
    rig: Rig,
    options: RunOptions,
    clock: Clock,
    world: RunWorld,
    computed: "World",
    placement: tuple[float, ...] = (),
) -> RigRoom:
    """Return a rig in a world of this process, on the clock of the run."""
    if options.bus == "ideal":
        run_bus = ideal_run_bus(rig, world_ideal_bus(rig, computed, world.number))
    else:
        lines = emulated_lines(rig).items()
        devices = {name: computed.device(line, name, rig=world.number) for name, line in lines}
        run_bus = in_process_run_bus(rig, devices)
    joints = RigInState(rig_kinematics(rig), computed.model.rigs[world.number].qpos)
    head = SimulatedPoses(computed, clock, joints)
    return RigRoom(world, clock, run_bus, head, None, _info(options, world), placement)


def served_room(
    rig: Rig,
    options: RunOptions,
    clock: Clock,
    world: RunWorld,
    served: ServedRig,
    placement: tuple[float, ...] = (),
) -> RigRoom:
    """Return a rig in a world of another process."""
    buses, number = served.buses, world.number
    run_bus = RunBus(
        guarded_rig_bus(rig, served.paths), close=served.close, inject_fault=buses.command
    )
    state = state_file(buses.folder)
    head = WorldPoses(state, RigInState(rig_kinematics(rig), buses.joints[number]))
    # Only the page draws other heads, and the page belongs to the first head.
    heads = map(HeadInState, world.others, buses.joints[1:])
    others = OtherHeads(state, tuple(heads)) if world.others and number == 0 else None
    return RigRoom(world, clock, run_bus, head, others, _info(options, world), placement)


def _info(options: RunOptions, world: RunWorld) -> WorldInfo | None:
    """Return the recording's entry for a world, None if the run is not recorded."""
    if options.record is None:
        return None
    people = world.spec.figures
    return recorded_world_info(options, options.seed if people is None else people.seed)

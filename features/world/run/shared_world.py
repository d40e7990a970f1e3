"""A world with several heads: on one simulated clock, or in real time.

In simulated time the world and all heads are in this process. Each head has a thread, and only one
runs at a time (gazerig.features.world.run.lockstep): the same seed gives the same bytes on every
bus. In real time the emulator's process has the world and the servos of all heads; each head's
control loop uses its own terminals, on the host's clock.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.features.world.run.lockstep import Lockstep
from gazerig.features.world.run.poses import RigInState, SimulatedPoses, WorldPoses
from gazerig.features.world.run.rig_room import RigRoom, served_room, simulated_room
from gazerig.features.world.run.run_world import RunWorld, ServedRig
from gazerig.features.world.world_scene import HeadFace, RigFrame
from gazerig.features.world.world_spec import state_file
from gazerig.gaze.angles import add, rotate, rotation
from gazerig.gaze.types import Vec3
from gazerig.robot.analysis.mutual_gaze import HeadPlace
from gazerig.robot.app.gaze_models import kinematics_of
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.description.head_shape import HeadMeasures
from gazerig.robot.model.clock import RealClock
from gazerig.sim_mock.pty.client import PtyBuses, has_terminals
from gazerig.sim_mock.scenes.scene import Scene

SceneOfHead = Callable[[Scene], Scene]


@dataclass(frozen=True)
class FacePoseSource:
    """Source of the current pose of a face in the world; can be sent to another process."""

    poses: WorldPoses | SimulatedPoses
    frame: RigFrame
    nose_m: Vec3

    def __call__(self) -> HeadFace:
        """Return the current pose of the face."""
        R, p_m = self.frame.in_world(*self.poses.head(0.0))
        return HeadFace(R, add(p_m, rotate(R, self.nose_m)))


class SimulatedWorld:
    """The world of several heads in this process, on one simulated clock.

    The number of a head is the number of its rig in the world.
    """

    def __init__(self, found: RunWorld) -> None:
        self._found = found
        self._lockstep = Lockstep(len(found.spec.rigs))
        self._world = found.computed(self._lockstep.now_s)
        self.frames: Sequence[RigFrame] = [
            RigFrame(rig.R_world_base, rig.p_world_base_m) for rig in self._world.model.rigs
        ]

    def face(self, number: int, rig: Rig) -> FacePoseSource:
        """Return a source of the current pose of a head's face."""
        joints = RigInState(kinematics_of(rig), self._world.model.rigs[number].qpos)
        poses = SimulatedPoses(self._world, self._lockstep.clock(number), joints)
        return FacePoseSource(poses, self.frames[number], _nose_m(rig))

    def room(self, number: int, rig: Rig, options: RunOptions, before: SceneOfHead) -> RigRoom:
        """Return the world from the view of one of the heads."""
        world = self._found._replace(scene=before(self._found.scene), number=number)
        stands = HeadPlace(*self.frames[number]).numbers
        return simulated_room(
            rig, options, self._lockstep.clock(number), world, self._world, stands
        )

    def enter(self, number: int) -> None:
        """Wait for a head's first turn."""
        self._lockstep.enter(number)

    def leave(self, number: int) -> None:
        """Let the other heads continue without this one."""
        self._lockstep.leave(number)

    def close(self) -> None:
        """Do nothing: the world ends with this process."""


class RealTimeWorld:
    """The world of several heads in the emulator's process, in real time.

    Raises:
        SetupError: the world cannot be used; the message gives the reason.
    """

    def __init__(self, found: RunWorld, rigs: Sequence[tuple[str, Rig]]) -> None:
        if not has_terminals():
            raise SetupError("several heads need the pseudo-terminals of Linux, or --fast")
        self.frames: Sequence[RigFrame] = [
            RigFrame(rotation((rig.yaw_rad, 0.0, 0.0)), rig.p_m) for rig in found.spec.rigs
        ]
        self._buses = PtyBuses()
        lines = [
            (name if number else "", emulated_lines(rig)) for number, (name, rig) in enumerate(rigs)
        ]
        self._paths = self._buses.start_rigs(lines, found.spec)
        self._found = found.served(self._buses.folder)

    def face(self, number: int, rig: Rig) -> FacePoseSource:
        """Return a source of the current pose of a head's face."""
        joints = RigInState(kinematics_of(rig), self._buses.joints[number])
        return FacePoseSource(
            WorldPoses(state_file(self._buses.folder), joints), self.frames[number], _nose_m(rig)
        )

    def room(self, number: int, rig: Rig, options: RunOptions, before: SceneOfHead) -> RigRoom:
        """Return the world from the view of one of the heads."""
        # Other heads use the world until ``close`` ends it.
        served = ServedRig(self._buses, self._paths[number], lambda: None)
        world = self._found._replace(scene=before(self._found.scene), number=number)
        stands = HeadPlace(*self.frames[number]).numbers
        return served_room(rig, options, RealClock(), world, served, stands)

    def enter(self, number: int) -> None:
        """Return immediately: real time does not wait."""

    def leave(self, number: int) -> None:
        """Do nothing: no head waits for another."""

    def close(self) -> None:
        """End the emulator's process; safe to call twice."""
        self._buses.stop()


SharedWorld = SimulatedWorld | RealTimeWorld
"""The world of a group of heads."""


def _nose_m(rig: Rig) -> Vec3:
    return HeadMeasures(rig.geometry.interocular_mm / 1e3).nose_m

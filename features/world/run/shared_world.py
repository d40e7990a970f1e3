"""A world with several heads: on one simulated clock, or in real time.

In simulated time the world and all heads are in this process. Each head has a thread, and only one
runs at a time: the one with the earliest next instant, and of equal ones the one with the lowest
number. So the same seed gives the same bytes on every bus. In real time the emulator's process has
the world and the servos of all heads; each head's control loop uses its own terminals, on the
host's clock.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gazerig.config.rig import Rig
from gazerig.features.world.run.poses import RigInState, SimulatedPoses, WorldPoses
from gazerig.features.world.run.rig_room import RigRoom, served_room, simulated_room
from gazerig.features.world.run.run_world import RunWorld, ServedRig
from gazerig.features.world.world_scene import HeadFace, RigFrame
from gazerig.features.world.world_spec import state_file
from gazerig.gaze.angles import add, rotate, rotation
from gazerig.gaze.types import Vec3
from gazerig.robot.analysis.mutual_gaze import HeadPlacement
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.description.head_shape import HeadMeasures
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.scenes.scene import Scene


class Lockstep:
    """Time that advances when all participants wait.

    Args:
        count: number of participants; each calls ``enter`` first and ``leave`` last.
    """

    def __init__(self, count: int) -> None:
        self._changed = threading.Condition()
        self._due_s: list[float | None] = [0.0] * count
        self._turn: int | None = 0
        self._now_s = 0.0

    def now_s(self) -> float:
        """Return the time."""
        return self._now_s

    def clock(self, number: int) -> Clock:
        """Return the clock of a participant."""
        return _ParticipantClock(self, number)

    def enter(self, number: int) -> None:
        """Wait for the first turn of a participant."""
        with self._changed:
            self._await(number)

    def wait(self, number: int, t_s: float) -> None:
        """Let the other participants run until ``t_s``; return immediately if that has passed."""
        with self._changed:
            if t_s <= self._now_s:
                return
            self._due_s[number] = t_s
            self._hand_over()
            self._await(number)

    def leave(self, number: int) -> None:
        """Let the other participants continue without this one; safe to call twice."""
        with self._changed:
            if self._due_s[number] is None:
                return
            self._due_s[number] = None
            if self._turn == number:
                self._hand_over()

    def _await(self, number: int) -> None:
        while self._turn != number:
            self._changed.wait()

    def _hand_over(self) -> None:
        waiting = [(t_s, n) for n, t_s in enumerate(self._due_s) if t_s is not None]
        if not waiting:
            self._turn = None
            return
        t_s, self._turn = min(waiting)
        self._now_s = max(self._now_s, t_s)
        self._changed.notify_all()


class _ParticipantClock:
    """The clock of one participant."""

    def __init__(self, shared: Lockstep, number: int) -> None:
        self._shared, self._number = shared, number

    def now_s(self) -> float:
        """Return the time."""
        return self._shared.now_s()

    def sleep_until(self, t_s: float) -> None:
        """Let the other participants run; return at ``t_s``."""
        self._shared.wait(self._number, t_s)


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
        joints = RigInState(rig_kinematics(rig), self._world.model.rigs[number].qpos)
        poses = SimulatedPoses(self._world, self._lockstep.clock(number), joints)
        return FacePoseSource(poses, self.frames[number], _nose_m(rig))

    def room(self, number: int, rig: Rig, options: RunOptions, before: SceneOfHead) -> RigRoom:
        """Return the world from the view of one of the heads."""
        world = self._found._replace(scene=before(self._found.scene), number=number)
        placement = HeadPlacement(*self.frames[number]).as_numbers
        return simulated_room(
            rig, options, self._lockstep.clock(number), world, self._world, placement
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
        joints = RigInState(rig_kinematics(rig), self._buses.joints[number])
        return FacePoseSource(
            WorldPoses(state_file(self._buses.folder), joints), self.frames[number], _nose_m(rig)
        )

    def room(self, number: int, rig: Rig, options: RunOptions, before: SceneOfHead) -> RigRoom:
        """Return the world from the view of one of the heads."""
        # Other heads use the world until ``close`` ends it.
        served = ServedRig(self._buses, self._paths[number], lambda: None)
        world = self._found._replace(scene=before(self._found.scene), number=number)
        placement = HeadPlacement(*self.frames[number]).as_numbers
        return served_room(rig, options, RealClock(), world, served, placement)

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

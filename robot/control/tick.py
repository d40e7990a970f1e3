"""Everything one tick knew and decided."""

from typing import NamedTuple

from gazerig.drivers.types import Detections
from gazerig.gaze.types import GazeCommand, GazeState, Percept, Target
from gazerig.robot.model.commands import Command
from gazerig.robot.model.leader import NO_GESTURE, NOBODY_LEADS, GestureState, LeadState
from gazerig.robot.model.types import GuardResult, JointAngles, JointState


class Tick(NamedTuple):
    """Everything one tick knew and decided; desired, commanded and measured side by side.

    events: what has happened on the bus and to the camera, in words
    commands: what people asked for, obeyed at the beginning of this tick
    stopped: why the robot was stopped, "" while it moves
    led: who leads gaze or joints and with what, "" while no client leads
    lead: the newest lead, and whether the head is where it was to be
    gesture: the newest gesture, and whether it is under way
    parking: the run is over, and the head moves to its parking pose; such ticks are only shown
    """

    t_s: float
    joints: JointState
    pose: GazeState
    detections: Detections | None
    percept: Percept | None
    target: Target
    gaze: GazeCommand
    desired_rad: JointAngles
    guard_result: GuardResult
    events: tuple[str, ...] = ()
    commands: tuple[Command, ...] = ()
    stopped: str = ""
    led: str = ""
    lead: LeadState = NOBODY_LEADS
    gesture: GestureState = NO_GESTURE
    parking: bool = False

    def while_parking(
        self,
        t_s: float,
        joints: JointState,
        pose: GazeState,
        desired_rad: JointAngles,
        guard_result: GuardResult,
        events: tuple[str, ...],
    ) -> "Tick":
        """Return a later tick of parking: what was seen is as here, and nobody leads."""
        return Tick(
            t_s, joints, pose, self.detections, self.percept, self.target, self.gaze,
            desired_rad, guard_result, events, parking=True,
        )  # fmt: skip


def at_rest(
    joints: JointState, desired_rad: JointAngles, why: str, names: tuple[str, ...]
) -> GuardResult:
    """Record that nothing is sent, as a user stopped the robot."""
    reason = f"all: stopped ({why})"
    each = ("stopped",) * len(names)
    return GuardResult(
        joints.position_rad, "torque_off", (reason,), desired_rad, each, (reason,), names
    )

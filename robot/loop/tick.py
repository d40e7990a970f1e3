"""Inputs and decisions of one tick, and its record."""

from msgspec import UNSET, Struct, UnsetType

from gazerig.drivers.types import Detections
from gazerig.gaze.angles import add, unit
from gazerig.gaze.attention.addressing import Addressing
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import PART_NAMES, GazeCommand, GazeState, Percept, Target, Vec3, body_name
from gazerig.robot.model.commands import AnyCommand
from gazerig.robot.model.reply import (
    NO_CLIENT_CONTROL,
    NO_CONVERSATION,
    ControlSource,
    ControlState,
    ConversationState,
    TrackState,
    control_source,
)
from gazerig.robot.model.types import GuardResult, JointAngles, JointState


class Tick(Struct, frozen=True, gc=False, omit_defaults=True):
    """The inputs and decisions of one tick: desired, commanded and measured values.

    Attributes:
        events: Texts of events on the bus and of the camera.
        commands: Commands executed at the beginning of this tick.
        stopped: Reason for a stop, "" while the robot moves.
        client_control: State of the newest client's control, with arrival at its target.
        tracks: Tracks that play, and the last ones that have ended, in the order of their numbers.
        conversation: State of the conversation.
        addressed: People who address the head, the first one in front.
        parking: The run is over and the head moves to its parking pose; such ticks are only
            displayed.
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
    commands: tuple[AnyCommand, ...] = ()
    stopped: str = ""
    client_control: ControlState = NO_CLIENT_CONTROL
    tracks: tuple[TrackState, ...] = ()
    parking: bool = False
    conversation: ConversationState = NO_CONVERSATION
    addressed: tuple[Addressing, ...] = ()

    @property
    def controlled_by(self) -> str:
        """Return the client that controls gaze or joints, and its command; "" without one."""
        return self.client_control.client

    @property
    def addressed_by(self) -> int | None:
        """Return the person who addresses the head, None if nobody does."""
        return self.addressed[0].person if self.addressed else None

    @property
    def control_source(self) -> ControlSource:
        """Return the source of control of the head."""
        return control_source(self.stopped, self.parking, self.client_control, self.tracks)

    @property
    def camera_conditions(self) -> tuple[str, ...]:
        """Return the conditions that impair the camera, each with its remedy."""
        return self.detections.conditions if self.detections is not None else ()

    @property
    def estimated_joints(self) -> tuple[str, ...]:
        """Return the joints whose servos have no feedback.

        A hobby servo takes a goal and reports no position. Its position is estimated as its goal,
        moved at its known speed: no sensor detects sticking, slipping or oscillation.
        """
        rows = zip(self.guard_result.joints, self.joints.measured, strict=False)
        return tuple([name for name, measured in rows if not measured])

    def parking_tick(
        self,
        t_s: float,
        joints: JointState,
        pose: GazeState,
        guard_result: GuardResult,
        events: tuple[str, ...],
        stopped: str = "",
    ) -> "Tick":
        """Return a later tick of parking, with this tick's percept and without a client.

        Args:
            t_s: Its time.
            joints: Measured joints.
            pose: Measured poses of head and eyes.
            guard_result: Result of the guard.
            events: Texts of events on the bus.
            stopped: Reason for which a client has stopped the parking head, "" while it moves.
        """
        return Tick(
            t_s, joints, pose, self.detections, self.percept, self.target, self.gaze,
            guard_result.desired_rad, guard_result, events, stopped=stopped, parking=not stopped,
        )  # fmt: skip


class TorqueEnabled(Struct, frozen=True, gc=False, tag=True):
    """A switch-on of the torque, with the present angles as goals."""

    goals_rad: JointAngles


class MeasuredJoints(Struct, frozen=True, gc=False, tag=True):
    """A reading of the joints at ``t_s``."""

    t_s: float
    joints: JointState


class TorqueRefused(Struct, frozen=True, gc=False, tag=True):
    """A refused switch-on of the torque, with the reason."""

    why: str


BodyRecord = TorqueEnabled | MeasuredJoints | TorqueRefused
"""Report of the machine between two ticks."""


class TickRecord(Struct, frozen=True, gc=False, omit_defaults=True):
    """A tick as other processes and recordings have it.

    Attributes:
        tick: The tick without its detections and its percept.
        dt_s: Time since the previous tick, or since the start of the loop.
        percept: The tick's percept if it is another than that of the previous tick.
        before: Reports of the machine since the previous tick, without the tick's own joints.
        exact: The record in MessagePack if it has NaN or infinity, which JSON lacks.
    """

    tick: Tick
    dt_s: float
    percept: Percept | None | UnsetType = UNSET
    before: tuple[BodyRecord, ...] = ()
    exact: bytes = b""


def stopped_result(
    joints: JointState, desired_rad: JointAngles, why: str, names: tuple[str, ...]
) -> GuardResult:
    """Return the guard's result of a stopped robot, to which nothing is sent."""
    reason = f"all: stopped ({why})"
    each = ("stopped",) * len(names)
    return GuardResult(
        joints.position_rad, "torque_off", (reason,), desired_rad, each, (reason,), names
    )


def cyclopean_direction(tick: Tick) -> Vec3:
    """Return the unit mean of both measured lines of sight, in the world."""
    return unit(add(line_of_sight(tick.pose, True), line_of_sight(tick.pose, False)))


def target_name(target: Target) -> str:
    """Return a target's name for users, e.g. "face 3: left eye"."""
    kind = "motion" if target.kind == "thing" else target.kind
    name = body_name(kind, target.id)
    return name if target.part is None else f"{name}: {PART_NAMES[target.part]}"

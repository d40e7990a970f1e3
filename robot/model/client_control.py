"""Control of the head by a client: a target to look at, or joints that are held.

Without ``stay`` the control needs a heartbeat; if it is missing, the gaze models take over again.
Times are those of the ticks and heartbeats are commands, so a repeated run times out as recorded.
"""

from math import degrees, radians
from typing import Literal

from msgspec import structs
from msgspec.structs import replace

from gazerig.gaze.angles import add, scale
from gazerig.gaze.types import ORDERED, Face, GazeState, Percept, Target, Vec3
from gazerig.robot.model.commands import (
    ControlCommand,
    Jog,
    Look,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
    Renew,
)
from gazerig.robot.model.control_source import NO_CLIENT_CONTROL, ControlState
from gazerig.robot.model.kinematics import gaze_error
from gazerig.robot.model.lease import Lease
from gazerig.robot.model.types import JointAngles

ARRIVED_RAD = radians(1.0)
"""A gaze or joint has arrived if its measured error is below this."""
GONE_S = 2.0
"""A control that follows a person ends when the person has not been visible for this time."""


class ClientControl:
    """The present control of the head by a client.

    Attributes:
        point: Point to look at, world frame, None without one.
        person: Id of the person to look at, None without one.
        pose_rad: Held joint angles, empty while the models move the joints.
        controlled_by: Client and command as text, "" without a client.
        state: State at the last tick.
    """

    def __init__(self) -> None:
        self.point: Vec3 | None = None
        self.person: int | None = None
        self.pose_rad: JointAngles = ()
        self.controlled_by = ""
        self.state = NO_CLIENT_CONTROL
        self._shifts = 0
        self._jogged: dict[str, float] = {}
        self._jogged_at: tuple[int, ...] = ()
        self._what = ""
        self._lease = Lease()
        self._pointer = False
        self._leads = "", ""
        self._since_s = 0.0
        self._until_s: float | None = None
        self._face: Face | None = None
        self._seen_s = 0.0

    @property
    def active(self) -> bool:
        """Return whether a client is in control."""
        return bool(self.controlled_by)

    @property
    def needs_camera(self) -> bool:
        """Return False if a client has chosen a point or joints, which need no camera."""
        return not self.controlled_by or self.person is not None

    def look(self, command: Look, point: Vec3 | None, t_s: float) -> None:
        """Look at a point, or free the gaze; joints are no longer held.

        Args:
            command: The command.
            point: Its point in the world, None to free the gaze.
            t_s: Present time.
        """
        self._release(f"{command.who or 'a client'} looks elsewhere")
        self.point = point
        self._shifts += 1
        self._what = _target_text(command)
        self._start(command, t_s)

    def follow(self, command: LookAtPerson, face: Face, captured_s: float, t_s: float) -> None:
        """Look at a visible person."""
        self.look(command, None, t_s)
        self.person, self._face, self._seen_s = command.id, face, captured_s
        self._start(command, t_s)

    def jog(self, command: Jog, names: tuple[str, ...], now_rad: JointAngles, t_s: float) -> None:
        """Move the given joints and hold the others; without any, free the joints.

        Args:
            command: The command.
            names: Names of all joints.
            now_rad: Angles of joints that have not been jogged yet.
            t_s: Present time.
        """
        if not command.angles_rad:
            self.pose_rad = ()
            self._jogged.clear()
            if self.point is None and self.person is None:
                self.end(f"{command.who or 'a client'} has released the joints")
            self._describe()
            if self.state.active:  # the gaze returns to the previous target
                arrived = self.state.arrived
                self.state = structs.replace(
                    self._new_state(self.state.number, t_s), arrived=arrived
                )
            return
        if command.who != self._lease.who:
            self.point = self.person = None
        angles = dict(zip(names, self.pose_rad or now_rad, strict=True))
        angles.update(command.angles_rad)
        self.pose_rad = tuple(angles[name] for name in names)
        self._jogged.update(command.angles_rad)
        self._jogged_at = tuple([i for i, name in enumerate(names) if name in self._jogged])
        self._start(command, t_s)

    def renew(self, command: Renew, t_s: float) -> bool:
        """Record a heartbeat; return whether it came from the client in control."""
        return self.active and self._lease.renew(command.who, t_s)

    def expiry_reason(self, t_s: float) -> str:
        """Return the reason for the control to end now, "" if it continues or there is none."""
        if not self.active:
            return ""
        if self._until_s is not None and t_s >= self._until_s:
            return "its time is over"
        if self._lease.has_lapsed(t_s):
            return "not renewed"
        if self.person is not None and t_s - self._seen_s > GONE_S:
            return f"person {self.person} is gone"
        return ""

    def end(self, why: str) -> None:
        """End the control: the gaze models move the head again."""
        if self.point is not None or self.person is not None:
            self._shifts += 1
        self._release(why)
        self._leads = "", ""
        self._describe()

    def target(self, target: Target, percept: Percept | None, t_s: float) -> Target:
        """Return the client's target instead of attention's, if there is one."""
        if self.point is None and self.person is None:
            return target
        chosen = self.chosen_target(percept, t_s)
        if chosen is None:
            return target
        return replace(chosen, shift=target.shift + self._shifts, saliences=target.saliences)

    def chosen_target(self, percept: Percept | None, t_s: float) -> Target | None:
        """Return the client's target, None without one."""
        if self.person is None:
            if self.point is None:
                return None
            return Target(
                self.point, (0.0, 0.0, 0.0), t_s, ORDERED, -1, 1.0, True, None,
                self._shifts, "a user chose this point",
            )  # fmt: skip
        if percept is not None:
            for face in percept.faces:
                if face.id == self.person:
                    self._face, self._seen_s = face, percept.captured_s
        known = self._face  # at the last observed position
        if known is None:
            return None
        return Target(
            known.p_world_m, known.v_world_m_s, self._seen_s, "face", known.id, 1.0, True, None,
            self._shifts, f"face {known.id}: a user chose it",
        )  # fmt: skip

    def measure(
        self, target: Target, pose: GazeState, joints_rad: JointAngles, converges: bool, t_s: float
    ) -> ControlState:
        """Return the state of the control after a tick.

        Args:
            target: Gaze target of this tick.
            pose: Measured poses of head and eyes.
            joints_rad: Measured joint angles.
            converges: Whether each eye pans separately.
            t_s: Time of the tick.
        """
        if not self.state.active:
            return self.state
        if self.pose_rad:
            error = max([abs(self.pose_rad[i] - joints_rad[i]) for i in self._jogged_at])
        else:
            since_s = max(0.0, t_s - target.at_s)
            point = add(target.p_world_m, scale(target.v_world_m_s, since_s))
            error = gaze_error(point, pose, converges).whole
        arrived = self.state.arrived or error <= ARRIVED_RAD
        self.state = structs.replace(self.state, arrived=arrived, error_rad=error)
        return self.state

    def _start(self, command: ControlCommand, t_s: float) -> None:
        self._lease.start(command.who, command.stay, t_s)
        self._until_s = None if command.for_s is None else t_s + command.for_s
        if isinstance(command, LookAt):
            self._pointer = command.pointer
            if command.p_world_m is None:
                self._leads = "", ""
        elif not isinstance(command, Jog):
            self._pointer = False
        self._describe()
        if self.controlled_by:
            self.state = self._new_state(self.state.number + 1, t_s)

    def _new_state(self, number: int, t_s: float) -> ControlState:
        """Return the state of a control that begins or changes its target."""
        joints = tuple(self._jogged)
        by: Literal["person", "pointer", "joint"] = (
            "joint" if joints else "pointer" if self._pointer else "person"
        )
        if (by, self._lease.who) != self._leads:
            self._leads, self._since_s = (by, self._lease.who), t_s
        what = self._what
        if joints:
            angles = (f"{name} at {degrees(a):.1f} deg" for name, a in self._jogged.items())
            what = ", ".join(angles)
        return ControlState(
            number,
            True,
            kind=by,
            who=self._lease.who,
            description=what,
            joints=joints,
            since_s=self._since_s,
        )

    def _release(self, why: str) -> None:
        """Release gaze and joints."""
        self.point = self.person = self._face = None
        self.pose_rad = ()
        self._jogged.clear()
        if self.state.active:
            self.state = ControlState(self.state.number, arrived=self.state.arrived, end_reason=why)

    def _describe(self) -> None:
        """Update the text of client and command."""
        if self.pose_rad:
            angles = (f"{name} {degrees(angle):.1f}" for name, angle in self._jogged.items())
            what = f"jog {', '.join(angles)}"
        elif self.point is not None or self.person is not None:
            what = self._what
        else:
            self.controlled_by = ""
            return
        self.controlled_by = f"{self._lease.who or 'a client'}: {what}"


def _target_text(command: Look) -> str:
    """Return the target of a look command as text."""
    match command:
        case LookAt(p):
            return f"look at {_numbers(p)}" if p is not None else ""
        case LookAtDirection((yaw, pitch)):
            of = " of the head" if command.frame == "head" else ""
            return f"look in direction {degrees(yaw):.1f} {degrees(pitch):.1f} deg{of}"
        case LookAtPerson(person):
            return f"look at person {person}"
        case LookAtPixel(pixel):
            return f"look at pixel {pixel[0]:.0f} {pixel[1]:.0f}"
        case LookAtInHead(p):
            return f"look at {_numbers(p)} of the head"
    raise TypeError(f"no text for {command}")


def _numbers(point: Vec3) -> str:
    return "{:g} {:g} {:g}".format(*(round(x, 2) for x in point))

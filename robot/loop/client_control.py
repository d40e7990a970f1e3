"""Control of the head by a client: a target to look at, or joints that are held.

Without ``stay`` the control needs a heartbeat; if it is missing, the gaze models take over again.
Times are those of the ticks and heartbeats are commands, so a repeated run times out as recorded.
"""

from math import degrees, radians

from msgspec.structs import replace

from gazerig.gaze.angles import add, scale
from gazerig.gaze.types import ORDERED, Face, GazeCommand, GazeState, Percept, Target, Vec3
from gazerig.robot.model.commands import (
    HEARTBEAT_S,
    ControlCommand,
    Jog,
    Look,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
)
from gazerig.robot.model.control_source import NO_CLIENT_CONTROL, ControlState
from gazerig.robot.model.kinematics import gaze_error
from gazerig.robot.model.reply import ARRIVED_RAD
from gazerig.robot.model.types import JointAngles

GONE_S = 2.0
"""A control that follows a person ends when the person has not been visible for this time."""


_SETTLED_S, _AT_REST_RAD_S = 0.5, radians(5.0)
"""A head that turns slower than this, this long after a command, rests."""


class Lease:
    """A right of a client that ends after ``HEARTBEAT_S`` without a heartbeat, unless it stays.

    Attributes:
        who: Name of the client, "" without one.
        stay: Whether it needs no heartbeat.
    """

    def __init__(self) -> None:
        self.who, self.stay, self._renewed_s = "", False, 0.0

    def start(self, who: str, stay: bool, t_s: float) -> None:
        """Give the right to a client."""
        self.who, self.stay, self._renewed_s = who, stay, t_s

    def renew(self, who: str, t_s: float) -> bool:
        """Record a heartbeat; return whether it came from the present client."""
        if who == self.who:
            self._renewed_s = t_s
        return who == self.who

    def has_lapsed(self, t_s: float) -> bool:
        """Return whether the heartbeat is missing."""
        return not self.stay and t_s - self._renewed_s > HEARTBEAT_S


class ClientControl:
    """The present control of the head by a client.

    Attributes:
        point: Point to look at, world frame, None without one.
        face: Last observation of the person to look at, None without one.
        pose_rad: Held joint angles, empty while the models move the joints.
        state: State at the last tick.

    Args:
        names: Names of all joints.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.point: Vec3 | None = None
        self.face: Face | None = None
        self.pose_rad: JointAngles = ()
        self.state = NO_CLIENT_CONTROL
        self._names, self._jogged = names, dict[str, float]()
        self._look: Look = LookAt(None)
        self._lease = Lease()
        self._until_s: float | None = None
        self._seen_s = self._started_s = 0.0
        self._shifts = 0

    @property
    def has_target(self) -> bool:
        """Return whether a client has chosen the gaze's target."""
        return self.point is not None or self.face is not None

    @property
    def needs_camera(self) -> bool:
        """Return False if a client has chosen a point or joints, which need no camera."""
        return not self.state.active or self.face is not None

    def look(
        self,
        command: Look,
        t_s: float,
        point: Vec3 | None = None,
        face: Face | None = None,
        seen_s: float = 0.0,
    ) -> None:
        """Look at a point or a person, without both free the gaze; joints are no longer held.

        Args:
            command: The command.
            t_s: Present time.
            point: Its point in the world.
            face: The visible face of its person.
            seen_s: Time of the frame that shows the face.
        """
        before = self.state
        self.end(f"{command.who or 'a client'} looks elsewhere")
        self.point, self.face, self._seen_s = point, face, seen_s
        self._look = command
        self._shifts += 1
        if self.has_target:
            self._start(command, before, t_s)

    def jog(self, command: Jog, now_rad: JointAngles, t_s: float) -> None:
        """Move the given joints and hold the others; without any, free the joints.

        Args:
            command: The command.
            now_rad: Angles of joints that have not been jogged yet.
            t_s: Present time.
        """
        if not command.angles_rad:
            self.pose_rad = ()
            self._jogged.clear()
            if not self.has_target:
                self.end(f"{command.who or 'a client'} has released the joints")
            elif self.state.active:  # the gaze returns to the previous target
                state = self._new_state(self.state.number)
                self.state = replace(state, arrived=self.state.arrived)
            return
        if command.who != self._lease.who:
            self.point = self.face = None
        angles = dict(zip(self._names, self.pose_rad or now_rad, strict=True))
        angles.update(command.angles_rad)
        self.pose_rad = tuple(angles.values())
        self._jogged.update(command.angles_rad)
        self._start(command, self.state, t_s)

    def renew(self, who: str, t_s: float) -> bool:
        """Record a heartbeat; return whether it came from the client in control."""
        return self.state.active and self._lease.renew(who, t_s)

    def expiry_reason(self, t_s: float) -> str:
        """Return the reason for the control to end now, "" if it continues or there is none."""
        if not self.state.active:
            return ""
        if self._until_s is not None and t_s >= self._until_s:
            return "its time is over"
        if self._lease.has_lapsed(t_s):
            return "not renewed"
        if self.face is not None and t_s - self._seen_s > GONE_S:
            return f"person {self.face.id} is gone"
        return ""

    def end(self, why: str) -> None:
        """End the control: the gaze models move the head again."""
        self._shifts += self.has_target
        self.point = self.face = None
        self.pose_rad = ()
        self._jogged.clear()
        if self.state.active:
            self.state = ControlState(self.state.number, arrived=self.state.arrived, end_reason=why)

    def target(self, target: Target, percept: Percept | None, t_s: float) -> Target:
        """Return the client's target instead of attention's, if there is one."""
        chosen = self.chosen_target(percept, t_s)
        if chosen is None:
            return target
        return replace(chosen, shift=target.shift + self._shifts, saliences=target.saliences)

    def chosen_target(self, percept: Percept | None, t_s: float) -> Target | None:
        """Return the client's target, None without one."""
        if self.point is not None:
            return Target(
                self.point, (0.0, 0.0, 0.0), t_s, ORDERED, -1, 1.0, True, None,
                self._shifts, "a user chose this point",
            )  # fmt: skip
        if self.face is None:
            return None
        for face in percept.faces if percept is not None else ():
            if face.id == self.face.id and percept is not None:
                self.face, self._seen_s = face, percept.captured_s
        return Target(  # at the last observed position
            self.face.p_world_m, self.face.v_world_m_s, self._seen_s, "face", self.face.id, 1.0,
            True, None, self._shifts, f"face {self.face.id}: a user chose it",
        )  # fmt: skip

    def measure(
        self,
        target: Target,
        pose: GazeState,
        gaze: GazeCommand,
        joints_rad: JointAngles,
        converges: bool,
        t_s: float,
    ) -> ControlState:
        """Return the state of the control after a tick.

        Args:
            target: Gaze target of this tick.
            pose: Measured poses of head and eyes.
            gaze: Gaze command of this tick.
            joints_rad: Measured joint angles.
            converges: Whether each eye pans separately.
            t_s: Time of the tick.
        """
        if not self.state.active:
            return self.state
        limited = ""
        if self.pose_rad:
            rows = zip(self._names, self.pose_rad, joints_rad, strict=True)
            error = max([abs(held - now) for name, held, now in rows if name in self._jogged])
        else:
            since_s = max(0.0, t_s - target.at_s)
            point = add(target.p_world_m, scale(target.v_world_m_s, since_s))
            error = gaze_error(point, pose, converges)
            rests = max(map(abs, pose.head_rate_rad_s)) < _AT_REST_RAD_S
            if error > ARRIVED_RAD and rests and t_s - self._started_s > _SETTLED_S:
                limited = _limits_text(gaze, error)
        arrived = self.state.arrived or error <= ARRIVED_RAD
        self.state = replace(self.state, arrived=arrived, error_rad=error, limited=limited)
        return self.state

    def _start(self, command: ControlCommand, before: ControlState, t_s: float) -> None:
        self._lease.start(command.who, command.stay, t_s)
        self._started_s = t_s
        self._until_s = None if command.for_s is None else t_s + command.for_s
        self.state = self._new_state(before.number + 1)

    def _new_state(self, number: int) -> ControlState:
        """Return the state of a control that begins or changes its target."""
        pointer = isinstance(self._look, LookAt) and self._look.pointer
        state = ControlState(
            number,
            True,
            kind="joint" if self._jogged else "pointer" if pointer else "person",
            who=self._lease.who,
            description=_look_text(self._look),
            joints=tuple(self._jogged),
        )
        if self._jogged:
            angles = (f"{name} at {degrees(a):.1f} deg" for name, a in self._jogged.items())
            state = replace(state, description=", ".join(angles))
        return state


def _limits_text(gaze: GazeCommand, error_rad: float) -> str:
    """Return how far a gaze is off its point and the angles that limit it, "" without any."""
    if not gaze.limited:
        return ""
    ends = (
        f"{one.axis} {degrees(one.done_rad):.0f} of {degrees(one.asked_rad):.0f} deg"
        for one in gaze.limited
    )
    return f"{degrees(error_rad):.0f} deg off: {', '.join(ends)}"


def _look_text(command: Look) -> str:
    match command:
        case LookAt(point) if point is not None:
            return f"look at {_numbers(point)}"
        case LookAtDirection((yaw, pitch)):
            of = " of the head" if command.frame == "head" else ""
            return f"look in direction {degrees(yaw):.1f} {degrees(pitch):.1f} deg{of}"
        case LookAtPerson(person):
            return f"look at person {person}"
        case LookAtPixel(pixel):
            return f"look at pixel {pixel[0]:.0f} {pixel[1]:.0f}"
        case LookAtInHead(point):
            return f"look at {_numbers(point)} of the head"
    return ""


def _numbers(point: Vec3) -> str:
    return "{:g} {:g} {:g}".format(*(round(x, 2) for x in point))

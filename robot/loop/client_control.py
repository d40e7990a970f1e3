"""Control of the head by a client: a target to look at, joints that are held, a conversation.

Without ``stay`` each needs a heartbeat; if it is missing, the gaze models take over again.
Times are those of the ticks and heartbeats are commands, so a repeated run times out as recorded.
"""

from math import degrees, radians

from msgspec.structs import replace

from gazerig.gaze.angles import add, scale
from gazerig.gaze.attention.finding import Finding, found
from gazerig.gaze.presence import GONE_S
from gazerig.gaze.types import (
    ORDERED,
    SEARCH,
    Face,
    GazeCommand,
    GazeState,
    Percept,
    Target,
    TurnState,
    Vec3,
)
from gazerig.robot.model.commands import (
    HEARTBEAT_S,
    ControlCommand,
    Find,
    Jog,
    Look,
    LookAt,
    LookAtDirection,
    LookAtPerson,
    LookAtPixel,
    Talk,
)
from gazerig.robot.model.kinematics import gaze_error
from gazerig.robot.model.reply import (
    ARRIVED_RAD,
    CHARACTERS_PER_S,
    NO_CLIENT_CONTROL,
    NO_CONVERSATION,
    NOT_FOUND,
    ControlState,
    ConversationState,
)
from gazerig.robot.model.types import JointAngles

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
        search: Search for a person, None without one.
        pose_rad: Held joint angles, empty while the models move the joints.
        state: State at the last tick.

    Args:
        names: Names of all joints.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.point: Vec3 | None = None
        self.face: Face | None = None
        self.search: Finding | None = None
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
        return self.point is not None or self.face is not None or self.search is not None

    @property
    def needs_camera(self) -> bool:
        """Return False if a client has chosen a point or joints, which need no camera."""
        return not self.state.active or (self.has_target and self.point is None)

    def look(
        self,
        command: Look,
        t_s: float,
        point: Vec3 | None = None,
        face: Face | None = None,
        seen_s: float = 0.0,
        search: Finding | None = None,
    ) -> None:
        """Look at a point or a person, without both free the gaze; joints are no longer held.

        Args:
            command: The command.
            t_s: Present time.
            point: Its point in the world.
            face: The visible face of its person.
            seen_s: Time of the frame that shows the face.
            search: Search for its person.
        """
        before = self.state
        self.end(f"{command.who or 'a client'} looks elsewhere")
        self.point, self.face, self._seen_s = point, face, seen_s
        self.search = search
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
            self.point = self.face = self.search = None
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
        if self.search is not None and self.search.has_given_up(t_s):
            return NOT_FOUND
        return ""

    def end(self, why: str) -> None:
        """End the control: the gaze models move the head again."""
        self._shifts += self.has_target
        self.point = self.face = self.search = None
        self.pose_rad = ()
        self._jogged.clear()
        if self.state.active:
            self.state = ControlState(self.state.number, arrived=self.state.arrived, end_reason=why)

    def target(self, target: Target, percept: Percept | None, t_s: float) -> Target:
        """Return the client's target instead of attention's, if there is one."""
        chosen = self.chosen_target(percept, t_s)
        if chosen is None:
            return target
        looks = -chosen.id if chosen.kind == SEARCH else 0  # each look has its own number
        shift = target.shift + self._shifts + looks
        return replace(chosen, shift=shift, saliences=target.saliences)

    def chosen_target(self, percept: Percept | None, t_s: float) -> Target | None:
        """Return the client's target, None without one."""
        if self.point is not None:
            return Target(
                self.point, (0.0, 0.0, 0.0), t_s, ORDERED, -1, 1.0, True, None,
                self._shifts, "a user chose this point",
            )  # fmt: skip
        if self.search is not None:
            if percept is None or (wanted := self.search.face(percept)) is None:
                return self.search.step(t_s)
            self.face, self._seen_s, self.search = wanted, percept.captured_s, None
            self._shifts += 1
            self.state = replace(self.state, found=found(wanted))
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
        if not self.state.active or self.search is not None:
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
        case Find(sought):
            return f"find person {sought}" if isinstance(sought, int) else f"find {sought}"
        case LookAtPixel(pixel):
            return f"look at pixel {pixel[0]:.0f} {pixel[1]:.0f}"
    return ""


def _numbers(point: Vec3) -> str:
    return "{:g} {:g} {:g}".format(*(round(x, 2) for x in point))


_GIVEN, _ESTIMATED = 0.9, 0.3
"""Confidence of a planned end: given in seconds, and from the length of a text."""
_LONGEST_S = 60.0
"""Thinking or speaking ends this time after its planned end, or after its last report."""
_SHOWN_CHARACTERS = 80
"""Length of the text that each tick contains; the command contains the whole."""


class Conversation:
    """The present state of conversation and its client.

    Attributes:
        state: State at the present tick.
    """

    def __init__(self) -> None:
        self.state = NO_CONVERSATION
        self._lease = Lease()
        self._reported_s = 0.0

    @property
    def active(self) -> bool:
        """Return whether there is a conversation."""
        return self.state.state != "idle"

    def report(self, command: Talk, t_s: float) -> str:
        """Enter the state that a client reports; return a message if it replaces another client.

        Raises:
            ValueError: There is no speech or thought to interrupt.
        """
        now, active = self.state, self.active
        state: TurnState = "interrupted" if command.state == "interrupt" else command.state
        if state == "interrupted" and now.state not in ("thinking", "speaking"):
            raise ValueError(
                f"there is nothing to interrupt: the state is {now.state}; report speaking or "
                "thinking first"
            )
        other = self._lease.who if active and self._lease.who != command.who else ""
        person = command.person if command.person is not None or not active else now.partner
        self._lease.start(command.who, command.stay, t_s)
        self._reported_s = t_s
        repeated = not other and (state, person) == (now.state, now.partner)
        number, since_s = (now.number, now.since_s) if repeated else (now.number + 1, t_s)
        if state == "idle":
            self.state = ConversationState(now.number + active, since_s=t_s)
        else:
            ends_s, confidence = _planned_end(command, t_s)
            text = command.text[:_SHOWN_CHARACTERS]
            self.state = ConversationState(
                number, state, person, since_s, ends_s, confidence, text, command.who
            )
        return f"conversation: {command.who or 'a client'} takes over from {other}" if other else ""

    def renew(self, who: str, t_s: float) -> bool:
        """Record a heartbeat; return whether it came from the client of the conversation."""
        return self.active and self._lease.renew(who, t_s)

    def expiry_reason(self, t_s: float) -> str:
        """Return the reason for an end now, "" if the state continues or is idle."""
        now = self.state
        if now.state == "idle":
            return ""
        if self._lease.has_lapsed(t_s):
            return "not renewed"
        late_s = t_s - max(now.ends_s or 0.0, self._reported_s)
        if now.state in ("thinking", "speaking") and late_s > _LONGEST_S:
            return f"no report for {_LONGEST_S:g} s; report the next state, or the same again"
        return ""

    def end(self, why: str, t_s: float) -> None:
        """End the conversation without a request."""
        self.state = ConversationState(self.state.number + 1, since_s=t_s, end_reason=why)


def _planned_end(command: Talk, t_s: float) -> tuple[float | None, float]:
    """Return the planned end of speech and its confidence; None and 0 if unknown."""
    if command.seconds is not None:
        return t_s + command.seconds, _GIVEN
    if text := command.text.strip():
        return t_s + len(text) / CHARACTERS_PER_S, _ESTIMATED
    return None, 0.0

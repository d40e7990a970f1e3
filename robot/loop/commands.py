"""Commands to a robot: their queue, and their execution at the beginning of a tick."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import degrees, inf, radians

from msgspec import structs

from gazerig.drivers.types import Detections
from gazerig.gaze.angles import add, direction, rotate, scale
from gazerig.gaze.attention.conversation import MODES, ConversationGaze
from gazerig.gaze.attention.startle import FLINCH, Startle
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.track.animation import Animation
from gazerig.gaze.track.track_trigger import TrackTrigger
from gazerig.gaze.types import Face, GazeState, Percept, Target, Vec3
from gazerig.params import unknown_text
from gazerig.robot.loop.body import Body, StopControl
from gazerig.robot.loop.chooser import TargetChooser
from gazerig.robot.loop.client_control import ClientControl, Conversation
from gazerig.robot.loop.tracks import TrackChoices
from gazerig.robot.model.commands import (
    NO_TRACK,
    Ask,
    Command,
    ControlCommand,
    EndTrack,
    Express,
    Find,
    Jog,
    Look,
    LookAt,
    LookAtDirection,
    LookAtPerson,
    LookAtPixel,
    MoveOpponent,
    Play,
    Renew,
    Resume,
    Say,
    SetLevel,
    Stop,
    SyncTrack,
    Talk,
    Tune,
)
from gazerig.robot.model.frames import PoseHistory
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.reply import CommandReply, Ticket
from gazerig.robot.model.scene import MovableOpponent
from gazerig.robot.model.types import JointAngles
from gazerig.robot.perception.perception import PixelToWorld
from gazerig.robot.safety.guard import Guard

MAX_WAITING = 64
MAX_PER_TICK = 8
"""Commands executed in one tick, without stops. At most one of them changes parameters, as that
takes longest."""
_NEAR_END_RAD = radians(0.05)
"""A slider at the end of a joint's range is rounded to a tenth of a degree."""
_LID_COMMANDS = ("wink left", "wink right")


class CommandQueue:
    """The commands since the last tick, from any thread, and the tickets of their replies."""

    def __init__(self) -> None:
        self._commands: deque[tuple[Command, Ticket]] = deque()
        self._stops: deque[tuple[Command, Ticket]] = deque()
        self._replies: list[tuple[Ticket, CommandReply]] = []

    def __len__(self) -> int:
        """Return the number of queued commands."""
        return len(self._commands) + len(self._stops)

    def add(self, command: Command) -> Ticket:
        """Queue a command. Thread-safe.

        Raises:
            ValueError: The queue is full. A stop is never refused.
        """
        ticket = Ticket()
        if isinstance(command, Stop):
            if len(self._stops) >= MAX_WAITING:
                with suppress(IndexError):  # the loop has just taken it
                    return self._stops[-1][1]  # same effect as another stop
            self._stops.append((command, ticket))
        elif len(self._commands) >= MAX_WAITING:
            raise ValueError(f"too many requests: {MAX_WAITING} commands are waiting, try again")
        else:
            self._commands.append((command, ticket))
        return ticket

    def reply(self, ticket: Ticket, reply: CommandReply) -> None:
        """Store the reply to a command until ``give_replies``."""
        self._replies.append((ticket, reply))

    def give_replies(self, t_s: float) -> None:
        """Give the replies; called when others can see the tick of t_s, which executed them."""
        replies, self._replies = self._replies, []
        for ticket, reply in replies:
            ticket.answer(structs.replace(reply, t_s=t_s))

    def take_stops(self) -> list[tuple[Command, Ticket]]:
        """Remove and return all stops; refuse queued commands that would move the head."""
        taken = [self._stops.popleft() for _ in range(len(self._stops))]
        for _ in range(len(self._commands) if taken else 0):
            command, ticket = self._commands.popleft()
            if isinstance(command, ControlCommand | Resume):
                self.reply(ticket, CommandReply("it has been stopped meanwhile"))
            else:
                self._commands.append((command, ticket))
        return taken

    def take(self) -> list[tuple[Command, Ticket]]:
        """Remove and return the commands of this tick, stops first."""
        taken = self.take_stops()
        tunes, most = 0, len(taken) + MAX_PER_TICK
        while self._commands and len(taken) < most:
            tunes += isinstance(self._commands[0][0], Tune)
            if tunes > 1:
                break
            taken.append(self._commands.popleft())
        return taken


class CommandExecutor:
    """The executor of commands on one robot, with the states that commands leave behind.

    Attributes:
        lead: Control of gaze or joints by a client.
        stop: Stops and resumes.
        conversation: State that a voice agent reports.
        tracks: Tracks that can be played.
        commanded_rad: Joint angles last sent to the servos; joints are held from there.
        opponent: Boxer in the emulated world and the start of its scene; None without one.

    Args:
        body: The joints on their bus.
        poses: History of the head's pose.
        attention: Chooses the target.
        gaze: Looks away from faces, and follows reported turns.
        lids: Lids, for winks and sleepiness.
        animation: Tracks and expressions on top of the gaze.
        tracks: Tracks that can be played.
        guard: Guard between desired angles and the bus.
        tune: Applies changed parameters and returns messages about it.
        pixels: Converts pixels of a camera frame to points in the world.
        messages: Receives lines for the events of the next tick.
    """

    def __init__(
        self,
        body: Body,
        poses: PoseHistory,
        attention: TargetChooser,
        gaze: ConversationGaze,
        lids: Lids,
        animation: Animation,
        tracks: TrackChoices,
        guard: Guard,
        tune: Callable[[Tune, float], tuple[str, ...]],
        pixels: PixelToWorld,
        messages: list[str],
    ) -> None:
        self._poses, self._attention, self._gaze, self._lids = poses, attention, gaze, lids
        self._animation, self._guard, self._tune, self._pixels = animation, guard, tune, pixels
        self._names, self._messages = body.names, messages
        self.tracks = tracks
        self.lead = ClientControl(body.names)
        self.stop = StopControl(body, messages)
        self.conversation = Conversation()
        self.commanded_rad: JointAngles = ()
        self.opponent: tuple[MovableOpponent, Callable[[], float | None]] | None = None
        self._known: dict[int, Vec3] = {}
        self._taken_over = False
        self._trigger, self._startle = TrackTrigger(), Startle()
        self._detections: Detections | None = None
        self._percept: Percept | None = None

    def models_took_over(self) -> bool:
        """Return once whether the gaze models take control again, from the present pose."""
        taken_over, self._taken_over = self._taken_over, False
        return taken_over

    # --- checks, in the client's thread

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return the choices of ``Ask``: menu -> choices, the present one first."""
        top_down, animation = self._attention.top_down, self._animation
        menus = {
            "behaviour": _put_first(top_down.chosen_behaviour, top_down.behaviours),
            "conversation": _put_first(self._gaze.chosen_mode, MODES),
            "lids": _LID_COMMANDS,
        }
        if expressions := animation.names["expression"]:
            menus["expression"] = _put_first(animation.expression, expressions)
        names = [one.name for one in self.tracks.states() if not one.refused]
        newest = animation.tracks.playing[-1:]
        present = newest[0].state.name if newest else NO_TRACK
        menus["track"] = _put_first(present, (NO_TRACK, *names))
        return menus

    def prepare(self, command: Command) -> Command:
        """Return a command as it is queued; a track is fitted to the rig.

        Raises:
            ValueError: It names something that this robot does not have; the message lists the
                available choices.
        """
        match command:
            case Ask(menu, choice):
                menus = self.menus()
                if menu not in menus:
                    raise ValueError(unknown_text("menu", menu, menus))
                if choice not in menus[menu]:
                    raise ValueError(unknown_text(menu, choice, menus[menu]))
                if menu == "track":
                    return self.prepare(Play("" if choice == NO_TRACK else choice))
            case Jog(angles_rad):
                names = self._names
                for name, _ in angles_rad:
                    if name not in names:
                        raise ValueError(unknown_text("joint", name, names))
            case Express(name):
                self._animation.require("expression", name)
            case SetLevel(name):
                self._animation.require("level", name)
            case Say():
                raise ValueError("this run has no voice")
            case Play(""):
                return EndTrack(who=command.who)
            case Play():
                return self.tracks.prepare(command)
        return command

    # --- execution, in the loop's thread

    def complete(self, command: Command) -> Command:
        """Return a command as it is executed, with everything that a recording needs."""
        frame = self._detections
        if frame is None or not isinstance(command, LookAtPixel):
            return command
        point = command.p_world_m or self._pixels.point(
            command.pixel_px, frame, self._percept, command.distance_m, command.captured_s
        )
        return structs.replace(command, p_world_m=point)

    def execute(self, command: Command, t_s: float) -> CommandReply:
        """Execute a command; return its reply, with the reason if it is refused now."""
        if self.stop.reason and isinstance(command, ControlCommand | Play):
            return CommandReply(f"stopped ({self.stop.reason}): resume first")
        try:
            return self._execute(command, t_s) or CommandReply()
        except ValueError as error:
            return CommandReply(str(error))

    def _execute(self, command: Command, t_s: float) -> CommandReply | None:
        match command:
            case Ask(menu, choice):
                self._choose(menu, choice, t_s)
            case Jog():
                return self._jog(command, t_s)
            case Look():
                return self._look(command, t_s)
            case Play():
                return self._play(command, t_s)
            case EndTrack():
                return self.tracks.end(command, t_s)
            case SyncTrack(number, position_s):
                self._animation.tracks.sync(number, position_s, t_s)
            case Express(name, strength):
                self._animation.set_face("expression", name, strength, t_s)
            case SetLevel(name, value):
                self._animation.set_face("level", name, value, t_s)
            case MoveOpponent(point):
                self._move_opponent(t_s, point)
            case Talk():
                if command.person is not None and command.person not in self._known:
                    self._face(command.person)
                if message := self.conversation.report(command, t_s):
                    self._messages.append(message)
                self._converse(t_s)
            case Renew(who=who):
                talks = self.conversation.renew(who, t_s)
                if not self.lead.renew(who, t_s) and not talks:
                    return CommandReply(f"the head is no longer controlled by {who or 'you'}")
            case Stop():
                self.stop.halt(command, t_s)
                self.lead.end(f"stopped: {command.why}")
                self._animation.tracks.end("the torque is switched off", t_s, fades=False)
            case Resume() if self.stop.reason:
                goals = self.stop.resume(command, t_s)
                if isinstance(goals, CommandReply):
                    return goals
                self._guard.reset(t_s, goals)
                self._taken_over = True
            case Tune():
                self._messages += self._tune(command, t_s)
        return None

    def end_expired(self, t_s: float) -> None:
        """End a client's control that was not renewed or has expired, and expired levels."""
        messages = self._messages
        self._move_opponent(t_s)
        if why := self.lead.expiry_reason(t_s):
            client = self.lead.state.client
            messages.append(f"{client}: {why}, so the gaze models are in control again")
            self._change_control(lambda: self.lead.end(why))
        if why := self.conversation.expiry_reason(t_s):
            state = self.conversation.state
            messages.append(f"conversation: {state.state} of {state.who or 'a client'} ends: {why}")
            self.conversation.end(why, t_s)
            self._converse(t_s)
        for name in self._animation.drop_lapsed(t_s):
            messages.append(f"level {name}: not set any more, so it returns to 0")

    def remember(self, detections: Detections | None, percept: Percept | None) -> None:
        """Remember a frame and its people, whom commands may name although they are out of view."""
        self._detections, self._percept = detections, percept
        if percept is not None:
            self._known |= {face.id: face.p_world_m for face in percept.faces}

    def _choose(self, menu: str, choice: str, t_s: float) -> None:
        if menu == "behaviour":
            self._attention.top_down.behave(choice)
        elif menu == "conversation":
            self._gaze.choose_mode(choice, t_s)
            self._lids.set_conversation(self._gaze.converses)
        elif menu == "expression":
            self._animation.set_face("expression", choice, 1.0, t_s)
        else:
            self._lids.wink("left" if choice == "wink left" else "right", t_s)

    def _converse(self, t_s: float) -> None:
        """Let gaze and lids follow the state of conversation; when idle, the chosen mode."""
        state, gaze = self.conversation.state, self._gaze
        gaze.enter(state.state, state.partner, state.ends_s, state.confidence, t_s)
        self._lids.set_conversation(gaze.converses)

    def _look(self, command: Look, t_s: float) -> CommandReply:
        """Give a client control of the gaze, or free it."""
        if isinstance(command, LookAtPerson):
            face, captured_s = self._face(command.id)
            self._change_control(lambda: self.lead.look(command, t_s, face=face, seen_s=captured_s))
        elif isinstance(command, Find):
            place = self._known.get(command.sought) if isinstance(command.sought, int) else None
            search = self._gaze.search(command.sought, place, t_s)
            self._change_control(lambda: self.lead.look(command, t_s, search=search))
        else:
            point = self._point(command)
            self._change_control(lambda: self.lead.look(command, t_s, point))
        return self._control_reply()

    def _control_reply(self) -> CommandReply:
        state = self.lead.state
        return CommandReply(control_number=state.number if state.active else 0)

    def _point(self, command: Look) -> Vec3 | None:
        """Return the point in the world to look at, None to free the gaze.

        Raises:
            ValueError: The point cannot be found now; the message gives the reason.
        """
        R, p = self._poses.head_pose(inf)
        match command:
            case LookAt(point):
                return point
            case LookAtDirection(angles, frame, distance_m):
                ahead = scale(direction(angles), distance_m)
                return add(p, rotate(R, ahead) if frame == "head" else ahead)
            case LookAtPixel(p_world_m=point) if point is not None:
                return point
        raise ValueError("there is no camera frame yet")

    def _face(self, number: int) -> tuple[Face, float]:
        """Return the face of a person and the time of its frame.

        Raises:
            ValueError: No visible person has that number; the message lists the visible people.
        """
        percept = self._percept
        faces = percept.faces if percept is not None else ()
        for face in faces:
            if face.id == number and percept is not None:
                return face, percept.captured_s
        visible = [str(face.id) for face in faces]
        raise ValueError(unknown_text("visible person", str(number), visible, "nobody"))

    def _jog(self, command: Jog, t_s: float) -> CommandReply:
        """Move the given joints and hold the others; without any, free the joints."""
        if command.angles_rad:
            self._animation.tracks.end("a client controls the joints", t_s, fades=False)
        self._change_control(lambda: self.lead.jog(command, self.commanded_rad, t_s))
        if command.angles_rad:
            self._guard.start_gently()  # a slider may jump from end to end
        return self._control_reply()

    def _change_control(self, change: Callable[[], None]) -> None:
        """Change the client in control; the models start slowly if they take over joints."""
        held, active = bool(self.lead.pose_rad), self.lead.state.active
        change()
        if held and not self.lead.pose_rad:
            self._taken_over = True
            self._guard.start_gently()
        if self.lead.state.active and not active:
            self._messages.append(f"controlled by {self.lead.state.client}")

    def _move_opponent(self, t_s: float, point: Vec3 | None = None) -> None:
        """Advance a boxer of the emulated world, or move its fist; a repeated run has none."""
        if self.opponent is None:
            return
        opponent, start_s = self.opponent[0], self.opponent[1]()
        if start_s is None:
            return
        if point is not None:
            opponent.move(point, t_s - start_s)
        else:
            opponent.update(t_s - start_s)

    def _play(self, command: Play, t_s: float) -> CommandReply:
        """Play a track on top of the gaze, unless a client holds the joints."""
        if self.lead.pose_rad:
            return CommandReply(f"{self.lead.state.client}: the joints are held at their angles")
        reply = self.tracks.play(command, t_s)
        by = f" for {command.who}" if command.who else ""
        self._messages.append(f"track{by}: {reply.text()}")
        return reply

    # --- tracks that no client has asked for

    def follow_turn(self, t_s: float) -> None:
        """Let the gaze follow the present turn, and play a listener's nod."""
        if self.conversation.active and (name := self._gaze.step(t_s)):
            self._play_unasked(Play(name, who="conversation"), t_s)

    def react_by_track(
        self, target: Target, percept: Percept | None, pose: GazeState, t_s: float
    ) -> None:
        """Play the track of the present rule when the gaze reaches the rule's target.

        That of the startle is played when something flies at the face.

        Args:
            target: Target that attention has chosen.
            percept: Visible people.
            pose: Measured poses of head and eyes.
            t_s: Present time.
        """
        top_down = self._attention.top_down
        name = self._trigger.step(
            top_down.behaviour, top_down.rule, target, t_s, top_down.named_ids
        )
        if name:
            self._play_unasked(Play(name, who=f"rule {top_down.behaviour}"), t_s)
        startles = top_down.startles and not top_down.plans  # a boxer watches the fists
        if startles and self._startle.step(percept, pose.p_world_head_m, t_s):
            self._play_unasked(Play(FLINCH, who="startle"), t_s)

    def _play_unasked(self, command: Play, t_s: float) -> None:
        """Play a track unless a client or a show moves the head."""
        shows = any(one.state.owns for one in self._animation.tracks.playing)
        if self.stop.reason or self.lead.state.active or shows:
            return
        try:
            self._play(self.tracks.prepare(command), t_s)
        except ValueError as error:
            self._messages.append(f"track for {command.who}: refused: {error}")


def refuse_out_of_range(command: Jog, joints: Sequence[str], limits: Sequence[JointLimit]) -> None:
    """Refuse angles outside the joints' present ranges.

    Raises:
        ValueError: The message names each such joint and its range.
    """
    ranges: Mapping[str, JointLimit] = dict(zip(joints, limits, strict=True))
    outside = []
    for name, angle in command.angles_rad:
        low, high = ranges[name][:2] if name in ranges else (angle, angle)
        if not low - _NEAR_END_RAD <= angle <= high + _NEAR_END_RAD:
            outside.append(
                f"{name} {degrees(angle):.1f} deg is outside its range, "
                f"{degrees(low):g}..{degrees(high):g} deg"
            )
    if outside:
        raise ValueError("; ".join(outside))


def _put_first(present: str, names: tuple[str, ...]) -> tuple[str, ...]:
    return (present, *(name for name in names if name != present))

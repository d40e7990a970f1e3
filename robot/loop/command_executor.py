"""Execution of commands at the beginning of a tick, with a reply to each."""

from collections.abc import Callable

from msgspec import structs

from gazerig.gaze.attention.conversation import ConversationGaze
from gazerig.gaze.attention.startle import FLINCH, Startle
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.track.animation import Animation
from gazerig.gaze.track.track_trigger import TrackTrigger
from gazerig.gaze.types import GazeState, Percept, Target
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.chooser import TargetChooser
from gazerig.robot.loop.command_choices import Menus
from gazerig.robot.loop.look_point import LookPoints
from gazerig.robot.loop.reachability import jog_reply, look_reply
from gazerig.robot.loop.stop_control import StopControl
from gazerig.robot.loop.track_choices import TrackChoices
from gazerig.robot.model.client_control import ClientControl
from gazerig.robot.model.commands import (
    Ask,
    Command,
    ControlCommand,
    EndTrack,
    Express,
    Jog,
    Look,
    LookAtPerson,
    MoveOpponent,
    Play,
    Renew,
    Resume,
    SetLevel,
    Speak,
    Stop,
    SyncTrack,
    Talk,
    Tune,
)
from gazerig.robot.model.conversation import Conversation
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.moved_opponent import TickClockOpponent
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.model.types import JointAngles
from gazerig.robot.safety.guard import Guard


class CommandExecutor:
    """The executor of commands on the components of one robot.

    Attributes:
        commanded_rad: Joint angles last sent to the servos; joints are held from there.
        opponent: Boxer in the emulated world, None without one.

    Args:
        body: The joints on their bus.
        lead: Control of gaze or joints by a client.
        stop: Switches the torque off and on.
        menus: Menus of the models.
        attention: Target chooser with the behaviours.
        oculomotor: Computes how far eyes and head can follow.
        animation: Expressions and levels.
        tracks: Tracks that can be played.
        kinematics: Gaze to joint angles.
        guard: Guard, which moves slowly after a change of control.
        tune: Changes parameters and returns messages about it.
        messages: Receives a line about each event.
        looks: Finds the points and faces in commands.
        conversation: State that a voice agent reports.
    """

    def __init__(
        self,
        body: Body,
        lead: ClientControl,
        stop: StopControl,
        menus: Menus,
        attention: TargetChooser,
        oculomotor: Oculomotor,
        animation: Animation,
        tracks: TrackChoices,
        kinematics: Kinematics,
        guard: Guard,
        tune: Callable[[Tune, float], tuple[str, ...]],
        messages: list[str],
        looks: LookPoints,
        conversation: Conversation,
    ) -> None:
        self._body, self._lead, self._stop, self._menus = body, lead, stop, menus
        self._attention, self._oculomotor, self._kinematics = attention, oculomotor, kinematics
        self._animation, self._tracks = animation, tracks
        self._guard, self._tune, self._messages, self._looks = guard, tune, messages, looks
        self._conversation = conversation
        self._taken_over = False
        self._trigger, self._startle = TrackTrigger(), Startle()
        self.commanded_rad: JointAngles = ()
        self.opponent: TickClockOpponent | None = None

    def reset(self) -> None:
        """Forget the tracks that rules have played."""
        self._trigger.reset()
        self._startle = Startle()

    def models_took_over(self) -> bool:
        """Return once whether the gaze models take control again, from the present pose."""
        taken_over, self._taken_over = self._taken_over, False
        return taken_over

    def end_expired(self, t_s: float) -> None:
        """End a client's control that was not renewed or has expired, and expired levels."""
        if self.opponent is not None:
            self.opponent.update(t_s)
        lead = self._lead
        if lead.controlled_by and (why := lead.expiry_reason(t_s)):
            self._messages.append(
                f"{lead.controlled_by}: {why}, so the gaze models are in control again"
            )
            self._change_control(lambda: lead.end(why))
        if talk := self._conversation.expiry_reason(t_s):
            state = self._conversation.state
            self._messages.append(
                f"conversation: {state.state} of {state.who or 'a client'} ends: {talk}"
            )
            self._conversation.end(talk, t_s)
            self._menus.converse(self._conversation.state, t_s)
        for name in self._animation.drop_lapsed(t_s):
            self._messages.append(f"level {name}: not set any more, so it returns to 0")

    def execute(self, command: Command, t_s: float) -> CommandReply:
        """Execute a command; return its reply."""
        match command:
            case Ask():
                self._menus.choose(command, self._attention.top_down, t_s)
            case ControlCommand():
                if self._stop.stop_reason:
                    return CommandReply(f"stopped ({self._stop.stop_reason}): resume first")
                reply = self._take_control(command, t_s)
                number = self._lead.state.number * self._lead.state.active
                return structs.replace(reply, control_number=number)
            case Play() | Speak():
                if self._stop.stop_reason:
                    return CommandReply(f"stopped ({self._stop.stop_reason}): resume first")
                return self._play(command, t_s)
            case EndTrack():
                return self._tracks.end(command, t_s)
            case SyncTrack():
                self._tracks.sync(command, t_s)
            case Express(name, strength):
                return _call_or_refuse(lambda: self._animation.express(name, strength))
            case SetLevel(name, value):
                return _call_or_refuse(lambda: self._animation.set_level(name, value, t_s))
            case MoveOpponent(p):
                if self.opponent is not None:  # a repeated run has no world
                    self.opponent.move(p, t_s)
            case Talk():
                return self._talk(command, t_s)
            case Renew():
                talks = self._conversation.renew(command.who, t_s)
                if not self._lead.renew(command, t_s) and not talks:
                    return CommandReply(
                        f"the head is no longer controlled by {command.who or 'you'}"
                    )
            case Stop():
                self._lead.end(f"stopped: {command.why}")
                self._tracks.drop_present(t_s)
                self._stop.halt(command, self._body, t_s)
            case Resume():
                return self._resume(command, t_s)
            case Tune():
                self._messages += self._tune(command, t_s)
        return CommandReply()

    def _take_control(self, command: ControlCommand, t_s: float) -> CommandReply:
        """Give a client control of gaze or joints."""
        if isinstance(command, Jog):
            return self._jog(command, t_s)
        try:
            if isinstance(command, LookAtPerson):
                face, captured_s = self._looks.face(command.id)
                self._change_control(lambda: self._lead.follow(command, face, captured_s, t_s))
            elif isinstance(command, Look):
                point = self._looks.point(command)
                self._change_control(lambda: self._lead.look(command, point, t_s))
        except ValueError as error:
            return CommandReply(str(error))
        target = self._lead.chosen_target(None, t_s)
        if target is None:  # the gaze is free again
            return CommandReply()
        return look_reply(target, self._oculomotor, self._kinematics, self._guard.limits)

    def _jog(self, command: Jog, t_s: float) -> CommandReply:
        """Move the given joints and hold the others; without any, free the joints."""
        names = self._body.names
        if command.angles_rad and (dropped := self._tracks.drop_present(t_s)):
            self._messages.append(f"track {dropped} ends: a client controls the joints")
        self._change_control(lambda: self._lead.jog(command, names, self.commanded_rad, t_s))
        if command.angles_rad:
            # A slider may jump from end to end.
            self._guard.start_gently()
        return jog_reply(command, names, self._guard.limits)

    def _talk(self, command: Talk, t_s: float) -> CommandReply:
        """Enter the state of conversation that a client reports."""
        try:
            if command.person is not None:
                self._looks.refuse_unknown(command.person)
            message = self._conversation.report(command, t_s)
        except ValueError as error:
            return CommandReply(str(error))
        if message:
            self._messages.append(message)
        self._menus.converse(self._conversation.state, t_s)
        return CommandReply()

    def _play(self, command: Play | Speak, t_s: float) -> CommandReply:
        """Play a track on top of the gaze, unless a client holds the joints."""
        starts = isinstance(command, Speak) or bool(command.track)
        if starts and self._lead.pose_rad:
            return CommandReply(f"{self._lead.controlled_by}: the joints are held at their angles")
        reply = self._tracks.play(command, t_s, self.commanded_rad, self._guard.limits)
        if starts:
            by = f" for {command.who}" if command.who else ""
            self._messages.append(f"track{by}: {reply.text()}")
        return reply

    def follow_turn(self, gaze: ConversationGaze, t_s: float) -> None:
        """Let the gaze follow the present turn, and play a listener's nod."""
        if name := gaze.step(t_s):
            self._play_by_itself(Play(name, who="conversation"), t_s)

    def _play_by_itself(self, command: Play, t_s: float) -> None:
        """Play a track that no client has asked for, unless a client or a show moves the head."""
        if (
            self._stop.stop_reason
            or self._lead.active
            or self._tracks.ends_show(command, self._guard.limits)
        ):
            return
        reply = self._play(self._tracks.complete(command, self._guard.limits), t_s)
        if reply.refused:
            self._messages.append(f"track for {command.who} {reply.text()}")

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
            self._play_by_itself(Play(name, who=f"rule {top_down.behaviour}"), t_s)
        startles = top_down.startles and not top_down.plans  # a boxer watches the fists
        if startles and self._startle.step(percept, pose.p_world_head_m, t_s):
            self._play_by_itself(Play(FLINCH, who="startle"), t_s)

    def _change_control(self, change: Callable[[], None]) -> None:
        """Change the client in control; the models start slowly if they take over joints."""
        held, text = bool(self._lead.pose_rad), self._lead.controlled_by
        change()
        if held and not self._lead.pose_rad:
            self._taken_over = True
            self._guard.start_gently()
        if self._lead.controlled_by and not text:
            self._messages.append(f"controlled by {self._lead.controlled_by}")

    def _resume(self, command: Resume, t_s: float) -> CommandReply:
        """Switch the torque on at the present angles; it stays off if a servo refuses."""
        if not self._stop.stop_reason:
            return CommandReply()
        resumed = self._stop.resume(command, self._body, t_s)
        if isinstance(resumed, CommandReply):
            return resumed
        self._guard.reset(t_s, resumed)
        self._taken_over = True
        return CommandReply()


def _call_or_refuse(act: Callable[[], None]) -> CommandReply:
    """Call ``act`` and return its refusal: parameters may have changed since the first check."""
    try:
        act()
    except ValueError as error:
        return CommandReply(str(error))
    return CommandReply()

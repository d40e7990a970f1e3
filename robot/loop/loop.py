"""The tick of a robot, and the loop that keeps its time."""

import contextlib
from collections.abc import Callable
from math import inf, radians
from typing import Any, NamedTuple

from gazerig.drivers.camera.capture_loop import CLOSING
from gazerig.drivers.errors import DriverError
from gazerig.drivers.plugins import describe_error, plugin_error
from gazerig.drivers.types import Camera
from gazerig.gaze.attention.addressing import AddressingModel
from gazerig.gaze.attention.conversation import ConversationGaze
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.scanpath.scanpath import Scanpath
from gazerig.gaze.track.animation import Animation
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.chooser import TargetChooser
from gazerig.robot.loop.commands import CommandExecutor, CommandQueue, refuse_out_of_range
from gazerig.robot.loop.tick import Tick as Tick
from gazerig.robot.loop.tick import stopped_result
from gazerig.robot.loop.timing import freeze_objects
from gazerig.robot.model.clock import Clock, LoopParams, RealClock
from gazerig.robot.model.commands import (
    AnyCommand,
    Ask,
    Command,
    Jog,
    MoveOpponent,
    check_command,
)
from gazerig.robot.model.frames import PoseHistory
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.reply import Ticket, TrackState
from gazerig.robot.model.scene import MovableOpponent
from gazerig.robot.model.types import GuardResult, JointAngles, JointState
from gazerig.robot.perception.perception import Perception
from gazerig.robot.safety.guard import Guard

PARK_S = 4.0
"""Longest time for parking before torque is switched off."""


class LoopCount(NamedTuple):
    """Counts of a loop: ticks, overrun slots, and the reason for the end."""

    ticks: int
    overruns: int
    stopped_by: str


class Robot:
    """One head, which reads, decides and writes in each tick.

    Args:
        body: The joints on their bus.
        kinematics: Joint angles to head pose and gaze, and back.
        camera: Source of detections.
        perception: Detections to people and things in the world.
        poses: History of the head's pose.
        attention: Chooses the target.
        scanpath: Chooses the part of a face.
        conversation: Looks away from faces, and follows reported turns.
        oculomotor: Target to eyes, head and lids; reports whether the gaze has arrived.
        animation: Tracks and expressions on top of the gaze.
        guard: Guard between desired angles and the bus.
        commands: Executes commands on these components.
        messages: Lines for the events of the next tick; other components add theirs.

    Attributes:
        newest: The newest tick, None before the first.
        closing_events: The camera's messages as it was closed.
    """

    def __init__(
        self,
        body: Body,
        kinematics: Kinematics,
        camera: Camera,
        perception: Perception,
        poses: PoseHistory,
        attention: TargetChooser,
        scanpath: Scanpath,
        conversation: ConversationGaze,
        oculomotor: Oculomotor,
        animation: Animation,
        guard: Guard,
        commands: CommandExecutor,
        messages: list[str],
    ) -> None:
        self.body, self.kinematics = body, kinematics
        self.camera, self.perception = camera, perception
        self.poses, self.attention, self.conversation_gaze = poses, attention, conversation
        self.oculomotor, self.animation = oculomotor, animation
        self.guard, self.messages = guard, messages
        self.newest: Tick | None = None
        self.closing_events: tuple[str, ...] = ()
        self._scanpath, self._addressing = scanpath, AddressingModel()
        self._gaze_m: Vec3 | None = None
        self._commands, self._executor = CommandQueue(), commands

    @property
    def stopped(self) -> str:
        """Return the reason for a stop, "" while the robot moves."""
        return self._executor.stop.reason

    def command(self, command: Command) -> Ticket:
        """Queue a command for the next tick. Thread-safe.

        Returns:
            The ticket of the reply, which the loop gives when it executes the command.

        Raises:
            ValueError: The command is invalid, or the queue is full; the message lists the
                available choices.
        """
        command = check_command(command)
        if isinstance(command, Jog):
            refuse_out_of_range(command, self.body.names, self.guard.limits)
        if isinstance(command, MoveOpponent) and self._executor.opponent is None:
            raise ValueError("no opponent to move: the run is in no world with a boxer")
        return self.replay_command(command)

    def replay_command(self, command: Command) -> Ticket:
        """Queue a command that a recorded run accepted, without a check of the present ranges.

        Raises:
            ValueError: As ``command``.
        """
        return self._commands.add(self._executor.prepare(check_command(command)))

    def set_opponent(self, opponent: MovableOpponent, start_s: Callable[[], float | None]) -> None:
        """Let commands move a boxer of the emulated world.

        Args:
            opponent: The boxer.
            start_s: Returns the start of its scene, None before.
        """
        self._executor.opponent = opponent, start_s

    def report(self, line: str) -> None:
        """Add a line to the events of the next tick; only for the loop's thread."""
        self.messages.append(line)

    def ask(self, menu: str, choice: str) -> None:
        """Choose from a menu from the next tick on. Thread-safe.

        Raises:
            ValueError: There is no such menu or choice; the message lists the available ones.
        """
        self.command(Ask(menu, choice))

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return the choices of ``Ask``: menu -> choices, the present one first."""
        return self._executor.menus()

    def tracks(self) -> tuple[TrackState, ...]:
        """Return all tracks as this rig plays them."""
        return self._executor.tracks.states()

    def start(self, clock: Clock, ready: Callable[[], None] | None = None) -> None:
        """Open camera and bus, switch the torque on and start from the present angles.

        Args:
            clock: Clock of the loop.
            ready: Called just before torque is switched on; its exception cancels the start.

        Raises:
            SetupError: A device is missing or does not match the configuration.
        """
        if isinstance(clock, RealClock):
            freeze_objects()
        try:
            self._open(clock, ready)
        except Exception as error:
            if (named := plugin_error(error)) is not None:
                raise named from error
            raise

    def _open(self, clock: Clock, ready: Callable[[], None] | None) -> None:
        self.camera.open()
        try:
            if ready is not None:
                ready()
            goals = self.body.start(clock)
        except BaseException:
            self._close_camera()
            raise
        try:
            self._initialize(clock.now_s(), goals)
        except BaseException:
            with contextlib.suppress(DriverError):
                self.stop()
            raise

    def _initialize(self, t_s: float, goals: JointAngles) -> None:
        """Initialize every component with the present angles of the joints."""
        self.guard.reset(t_s, goals)
        joints = self.body.read(t_s)
        pose = self.kinematics.forward(joints)
        self.poses.remember(t_s, pose.head_rad, pose.R_world_head)
        self.attention.reset(t_s)
        self.conversation_gaze.reset(t_s)
        self._scanpath.reset(t_s)
        self.oculomotor.reset(t_s, pose)
        self._executor.commanded_rad = goals

    def tick(self, t_s: float, dt_s: float, watch: Callable[[Tick], object] | None = None) -> Tick:
        """Read, perceive, choose, plan, guard, write; then reply to the commands.

        Args:
            t_s: Present time.
            dt_s: Time since the last tick.
            watch: Called with the tick before the replies, so that a client that has its reply
                finds the tick, or a newer one.

        Raises:
            DriverError: The bus or the camera is lost, or a part of another package fails.
        """
        try:
            tick = self._tick(t_s, dt_s)
            if watch is not None:
                watch(tick)
            return tick
        except Exception as error:
            if (named := plugin_error(error)) is not None:
                raise named from error
            raise
        finally:
            self._commands.give_replies(t_s)

    def _tick(self, t_s: float, dt_s: float) -> Tick:
        executor = self._executor
        commands = self._execute_commands(t_s)
        lead, stop, conversation = executor.lead, executor.stop, executor.conversation
        joints = self.body.read(t_s)
        pose = self.kinematics.forward(joints)
        self.poses.remember(t_s, pose.head_rad, pose.R_world_head)
        if executor.models_took_over():
            self.oculomotor.reset(t_s, pose)
        detections = self.camera.latest(t_s)
        percept = self.perception.see(detections, self.poses)
        executor.follow_turn(t_s)
        chosen = self.attention.choose(percept, pose, t_s)
        executor.react_by_track(chosen, percept, pose, t_s)
        target = lead.target(chosen, percept, t_s)
        rests_s = self._scanpath.rests_until_s
        target = self.conversation_gaze.look(
            target, pose.p_world_head_m, t_s, lead.state.active, rests_s, percept
        )
        # What appears delays the saccades under way (Reingold & Stampe 2002), so the gaze stays.
        settled = self.oculomotor.has_arrived and not self.attention.reacts
        target = self._scanpath.wander(
            target, percept, t_s, settled, pose.p_world_head_m, self._gaze_m
        )
        offset = self.animation.step(t_s)
        loudness = self.animation.loudness
        if loudness is None and conversation.state.state == "speaking":
            loudness = 1.0
        self.oculomotor.speak(loudness)
        gaze = self.oculomotor.step(target, pose, t_s, dt_s, offset)
        self._gaze_m = gaze.gaze_point_world_m
        desired = lead.pose_rad or self.kinematics.inverse(gaze, offset.joints_rad)
        if stop.reason:
            stop.keep_released(joints, t_s)
            guard_result = stopped_result(joints, desired, stop.reason, self.body.names)
        else:
            guard_result = self.guard.check(desired, joints, self._frame_age_s(percept, t_s), t_s)
            self.body.write(guard_result.command_rad)
        executor.commanded_rad = guard_result.command_rad
        executor.remember(detections, percept)
        converges = not self.kinematics.one_pan
        events = (*self.messages, *self.body.bus.events(), *self.camera.events())
        self.messages.clear()
        self.newest = Tick(
            t_s, joints, pose, detections, percept, target, gaze, desired, guard_result, events,
            commands, stop.reason,
            lead.measure(target, pose, gaze, joints.position_rad, converges, t_s),
            self.animation.tracks.states(t_s),
            conversation=conversation.state,
            addressed=self._addressing.step(percept, pose.p_world_head_m, t_s),
        )  # fmt: skip
        return self.newest

    def park(
        self,
        pose_rad: JointAngles,
        clock: Clock,
        params: LoopParams,
        again: Callable[[], bool] | None = None,
        watch: Callable[[Tick], object] | None = None,
    ) -> bool:
        """Move slowly to the parking pose; return whether it was reached in time.

        A user's stop ends parking with the torque off. Other commands no longer get a reply.

        Args:
            pose_rad: Joint angles of the parking pose.
            clock: Clock of the loop.
            params: Rate of the loop.
            again: Returns whether to skip the rest; called at every step.
            watch: Called at every step with the last tick and the changes since.
        """
        self.guard.start_gently()
        newest = self.newest
        rate_hz, start_s, slot = params.rate_hz, clock.now_s(), 0

        def show(joints: JointState, result: GuardResult) -> None:
            if watch is not None and newest is not None:
                pose, events = self.kinematics.forward(joints), self.body.bus.events()
                watch(newest.parking_tick(t_s, joints, pose, result, events, self.stopped))

        end_s = start_s + PARK_S + 0.5 / rate_hz
        last = int(PARK_S * rate_hz)
        while (slot := max(slot, int((clock.now_s() - start_s) * rate_hz + 1e-6)) + 1) <= last:
            clock.sleep_until(start_s + slot / rate_hz)
            t_s = clock.now_s()
            # A slow bus must not prolong parking; missed slots are skipped.
            if t_s > end_s or (again is not None and again()):
                return False
            if stops := self._commands.take_stops():
                for command, ticket in stops:
                    self._commands.reply(ticket, self._executor.execute(command, t_s))
                if newest is not None:
                    joints = newest.joints
                    show(joints, stopped_result(joints, pose_rad, self.stopped, self.body.names))
                self._commands.give_replies(t_s)
                return False
            joints = self.body.read(t_s)
            result = self.guard.check(pose_rad, joints, 0.0, t_s)
            self.body.write(result.command_rad)
            show(joints, result)
            errors = zip(pose_rad, joints.position_rad, strict=True)
            if max(abs(desired - now) for desired, now in errors) < radians(2.0):
                return True
        return False

    def stop(self) -> tuple[str, ...]:
        """Switch the torque off, close bus and camera; return the bus's messages."""
        try:
            return self.body.stop()
        finally:
            self._close_camera()

    def _close_camera(self) -> None:
        """Close the camera; its error must not hide the reason of the end."""
        try:
            self.camera.close()
            self.closing_events = tuple([e for e in self.camera.events() if e.startswith(CLOSING)])
        except Exception as error:
            named = plugin_error(error) or describe_error(error)
            self.closing_events = (f"{CLOSING}: {named}",)

    def _execute_commands(self, t_s: float) -> tuple[AnyCommand, ...]:
        """Execute and return the queued commands, and end a control that was not renewed."""
        taken: list[Any] = []
        for queued, ticket in self._commands.take():
            command = self._executor.complete(queued)
            taken.append(command)
            self._commands.reply(ticket, self._executor.execute(command, t_s))
        self._executor.end_expired(t_s)
        return tuple(taken)

    def _frame_age_s(self, percept: Percept | None, t_s: float) -> float:
        """Return the age of the frame that the gaze depends on.

        A target chosen by a client, and the neck of a track, do not depend on the camera.
        """
        if not self._executor.lead.needs_camera or self.animation.tracks.replaces_gaze:
            return 0.0
        return t_s - percept.captured_s if percept is not None else inf


class TickLoop:
    """A loop of ticks at absolute slots, one per call of ``step``.

    Slots that a long tick overruns are counted and skipped, never caught up in a burst.

    Args:
        robot: Reads, decides and writes once per tick.
        clock: The host's clock or a simulated one.
        params: Rate of the loop.
        stop: Takes the seconds since the start; returns the reason to stop, or None.
        watch: Called with every tick.
    """

    def __init__(
        self,
        robot: Robot,
        clock: Clock,
        params: LoopParams,
        stop: Callable[[float], str | None],
        watch: Callable[[Tick], object],
    ) -> None:
        self._robot, self._clock, self._stop, self._watch = robot, clock, stop, watch
        self._period_s = 1.0 / params.rate_hz
        self._start_s = self._last_s = clock.now_s()
        self._slot = self._ticks = self._overruns = 0

    def step(self) -> str | None:
        """Wait for the next slot and tick; return the reason for the end, otherwise None."""
        clock, period = self._clock, self._period_s
        self._slot += 1
        clock.sleep_until(self._start_s + self._slot * period)
        t_s = clock.now_s()
        reason = self._stop(t_s - self._start_s)
        if reason is not None:
            return reason
        try:
            tick = self._robot.tick(t_s, t_s - self._last_s, self._watch)
        except DriverError as error:
            return f"fault: {error}"
        if tick.guard_result.level == "torque_off" and not tick.stopped:
            return f"fault: {'; '.join(tick.guard_result.critical_reasons)}"
        self._last_s = t_s
        self._ticks += 1
        late = int((clock.now_s() - self._start_s) / period) - self._slot
        if late > 0:
            self._overruns += late
            self._slot += late
        return None

    def count(self, stopped_by: str) -> LoopCount:
        """Return the counts of the loop."""
        return LoopCount(self._ticks, self._overruns, stopped_by)


def run(
    robot: Robot,
    clock: Clock,
    params: LoopParams,
    stop: Callable[[float], str | None],
    watch: Callable[[Tick], object],
) -> LoopCount:
    """Tick until ``stop(seconds)`` returns a reason or a driver fails; see ``TickLoop``."""
    loop = TickLoop(robot, clock, params, stop, watch)
    while (reason := loop.step()) is None:
        pass
    return loop.count(reason)

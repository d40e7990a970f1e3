"""The tick, and the loop that keeps its time."""

import contextlib
from collections.abc import Callable
from math import inf, radians
from typing import NamedTuple

from gazerig.drivers.errors import DriverError
from gazerig.drivers.types import Camera
from gazerig.gaze.attention.aversion import Aversion
from gazerig.gaze.gesture.animation import Animation
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.scanpath.scanpath import Scanpath
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.control.body import Body
from gazerig.robot.control.chooser import TargetChooser
from gazerig.robot.control.command_choices import (
    Menus,
    refuse_impossible,
    refuse_out_of_range,
)
from gazerig.robot.control.command_executor import CommandExecutor
from gazerig.robot.control.command_queue import CommandQueue
from gazerig.robot.control.garbage import set_aside
from gazerig.robot.control.gesture_choices import GestureChoices, GestureInfo
from gazerig.robot.control.look_point import Known, LookPoints
from gazerig.robot.control.stop_control import StopControl
from gazerig.robot.control.tick import Tick as Tick
from gazerig.robot.control.tick import at_rest
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.model.command_checks import check
from gazerig.robot.model.commands import Ask, Command, Jog, Tune
from gazerig.robot.model.frames import PoseHistory
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.lead import Lead
from gazerig.robot.model.loop_params import LoopParams
from gazerig.robot.model.reply import Ticket
from gazerig.robot.model.types import JointAngles
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.pixel_to_world import PixelToWorld
from gazerig.robot.safety.guard import Guard


class LoopCount(NamedTuple):
    """How the loop kept its time."""

    ticks: int
    overruns: int
    stopped_by: str


class Robot:
    """One head: what it reads, decides and writes in a tick.

    Args:
        body: the joints on their bus.
        kinematics: joint angles to head pose and gaze, and back.
        camera: what is looked through.
        perception: detections to people and things in the world.
        poses: where the head was when.
        attention: chooses the target.
        scanpath: which part of a face.
        aversion: looking away in a conversation.
        oculomotor: target to eyes, head and lids; says whether the gaze has arrived.
        lids: their blinks can be asked for.
        animation: gestures and expressions laid over gaze.
        gestures: those that can be played.
        guard: between what is desired and the bus.
        tune: puts changed parameters in force and says what was done.
        pixels: places pixels of a camera frame in the world.
        messages: lines for the events of the next tick, to which other parts add theirs.
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
        aversion: Aversion,
        oculomotor: Oculomotor,
        lids: Lids,
        animation: Animation,
        gestures: GestureChoices,
        guard: Guard,
        tune: Callable[[Tune, float], tuple[str, ...]],
        pixels: PixelToWorld,
        messages: list[str] | None = None,
    ) -> None:
        self.body = body
        self.camera = camera
        self.perception = perception
        self.attention: TargetChooser = attention
        self._kinematics = kinematics
        self._poses = poses
        self._scanpath = scanpath
        self._aversion = aversion
        self._oculomotor = oculomotor
        self._menus = Menus(aversion, lids, animation.expressions, gestures)
        self._animation = animation
        self._gestures = gestures
        self._guard = guard
        self._gaze_m: Vec3 | None = None
        self._commands = CommandQueue()
        self._lead = Lead()
        self._messages: list[str] = messages if messages is not None else []
        self._stop = StopControl(self._messages)
        self._looks = LookPoints(pixels)
        self._executor = CommandExecutor(
            body, self._lead, self._stop, self._menus, attention, oculomotor, animation, gestures,
            kinematics, guard, tune, self._messages, self._looks,
        )  # fmt: skip

    @property
    def stopped(self) -> str:
        """Return why the robot was stopped, "" while it moves."""
        return self._stop.why

    @property
    def newest(self) -> Tick | None:
        """Return the last tick, None before the first."""
        known = self._looks.known
        return known if isinstance(known, Tick) else None

    def command(self, command: Command) -> Ticket:
        """Queue a command for the next tick; may be called from any thread.

        Returns:
            Where the reply comes, once the loop has taken the command up.

        Raises:
            ValueError: it cannot be done, or too many commands wait; the message says which,
                and what there is.
        """
        check(command)
        if isinstance(command, Jog):
            refuse_out_of_range(command, self.body.names, self._guard.limits)
        return self.replay_command(command)

    def replay_command(self, command: Command) -> Ticket:
        """Queue a command that was accepted in a recorded run, whatever the ranges are now.

        Raises:
            ValueError: as ``command``.
        """
        check(command)
        refuse_impossible(command, self.menus, self.body.names, self._animation, self._gestures)
        return self._commands.add(command)

    def report(self, line: str) -> None:
        """Add a line to the events of the next tick; for the loop's thread."""
        self._messages.append(line)

    def ask(self, menu: str, choice: str) -> None:
        """Choose a behaviour, a mode of conversation or a wink, from the next tick on.

        May be called from any thread.

        Raises:
            ValueError: there is no such menu or choice; the message lists what there is.
        """
        self.command(Ask(menu, choice))

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return what ``ask`` takes: menu -> choices, the present one first."""
        return self._menus.offered(self.attention.top_down)

    def gestures(self) -> tuple[GestureInfo, ...]:
        """Return the gestures there are, with what this rig can do of them."""
        return self._gestures.offered(self._guard.limits)

    def start(self, clock: Clock, ready: Callable[[], None] | None = None) -> None:
        """Open camera and bus, switch torque on where the joints are, begin from there.

        ready: called last before the torque comes on; what it raises ends the start

        Raises:
            SetupError: something is absent or not as configured.
        """
        if isinstance(clock, RealClock):
            set_aside()
        self.camera.open()
        try:
            if ready is not None:
                ready()
            goals = self.body.start()
        except BaseException:
            self.camera.close()
            raise
        try:
            self._begin(clock.now_s(), goals)
        except BaseException:
            with contextlib.suppress(DriverError):
                self.stop()
            raise

    def _begin(self, t_s: float, goals: JointAngles) -> None:
        """Initialise every component with the present angles of the joints."""
        self._guard.reset(t_s, goals)
        joints = self.body.read(t_s)
        pose = self._kinematics.forward(joints)
        self._poses.remember(t_s, pose.head_rad, pose.base_rad, pose.R_world_head)
        self._looks.known = Known(pose)
        self.attention.reset(t_s)
        self._aversion.reset(t_s)
        self._scanpath.reset(t_s)
        self._gaze_m = None
        self._oculomotor.reset(t_s, pose)
        self._animation.reset(t_s)
        self._executor.reset()
        self._executor.commanded_rad = goals

    def tick(self, t_s: float, dt_s: float) -> Tick:
        """Read, see, choose, plan, guard, write.

        Raises:
            DriverError: bus or camera are gone.
        """
        commands = self._obey(t_s)
        joints = self.body.read(t_s)
        pose = self._kinematics.forward(joints)
        self._poses.remember(t_s, pose.head_rad, pose.base_rad, pose.R_world_head)
        if self._executor.models_take_over():
            self._oculomotor.reset(t_s, pose)
        detections = self.camera.latest(t_s)
        percept = self.perception.see(detections, self._poses)
        chosen = self.attention.choose(percept, pose, t_s)
        self._executor.gesture_by_rule(chosen, t_s)
        target = self._lead.target(chosen, percept, t_s)
        rests_s = self._scanpath.rests_until_s
        target = self._aversion.step(target, pose.p_world_head_m, t_s, self._lead.active, rests_s)
        target = self._scanpath.wander(
            target, percept, t_s, self._oculomotor.settled, pose.p_world_head_m, self._gaze_m
        )
        offset = self._animation.step(t_s)
        gaze = self._oculomotor.step(target, pose, t_s, dt_s, offset)
        self._gaze_m = gaze.gaze_point_world_m
        desired = self._lead.pose_rad or self._kinematics.inverse(gaze, offset.joints_rad)
        if stopped := self._stop.why:
            self._stop.keep_released(self.body, joints, t_s)
            guard_result = at_rest(joints, desired, stopped, self.body.names)
        else:
            guard_result = self._guard.check(desired, joints, self._frame_age_s(percept, t_s), t_s)
            self.body.write(guard_result.command_rad)
        self._executor.commanded_rad = guard_result.command_rad
        converges = not self._kinematics.one_pan
        lead = self._lead.measure(target, pose, joints.position_rad, converges, t_s)
        events = (*self._messages, *self.body.bus.events(), *self.camera.events())
        self._messages.clear()
        tick = tuple.__new__(Tick, (
            t_s, joints, pose, detections, percept, target, gaze, desired, guard_result, events, commands,
            stopped, self._lead.words, lead, self._gestures.state, False,
        ))  # fmt: skip
        self._looks.known = tick
        return tick

    def park(
        self,
        pose_rad: JointAngles,
        clock: Clock,
        params: LoopParams,
        again: Callable[[], bool] | None = None,
        watch: Callable[[Tick], object] | None = None,
    ) -> bool:
        """Move slowly to the parking pose; return whether it was reached in time.

        A user's stop ends it: the torque is off then. Other commands wait for nothing any more.

        again: asked at every step, returns whether the rest is to be skipped
        watch: gets the last tick at every step, with what has changed since
        """
        self._guard.go_gently()
        newest = self._looks.known
        rate_hz, start_s, slot = params.rate_hz, clock.now_s(), 0
        end_s = start_s + params.park_s + 0.5 / rate_hz
        last = int(params.park_s * rate_hz)
        while (slot := max(slot, int((clock.now_s() - start_s) * rate_hz + 1e-6)) + 1) <= last:
            clock.sleep_until(start_s + slot / rate_hz)
            t_s = clock.now_s()
            # A bus that is slow to answer must not make it longer; missed slots are skipped.
            if t_s > end_s or (again is not None and again()):
                return False
            if stops := self._commands.stops():
                for stop in stops:
                    stop.ticket.answer(self._executor.execute(stop.command, t_s))
                return False
            joints = self.body.read(t_s)  # it goes home whatever the camera shows
            guard_result = self._guard.check(pose_rad, joints, 0.0, t_s)
            self.body.write(guard_result.command_rad)
            if watch is not None and isinstance(newest, Tick):
                pose, events = self._kinematics.forward(joints), self.body.bus.events()
                watch(newest.while_parking(t_s, joints, pose, pose_rad, guard_result, events))
            errors = zip(pose_rad, joints.position_rad, strict=True)
            if max(abs(desired - now) for desired, now in errors) < radians(2.0):
                return True
        return False

    def stop(self) -> tuple[str, ...]:
        """Torque off, close the bus and the camera; return what the bus says of the torque."""
        try:
            return self.body.stop()
        finally:
            self.camera.close()

    def _obey(self, t_s: float) -> tuple[Command, ...]:
        """Execute and return the commands that wait, and end a lead that is not renewed."""
        taken = []
        for waiting in self._commands.take() if self._commands else ():
            command = self._looks.resolved(waiting.command)
            taken.append(command)
            waiting.ticket.answer(self._executor.execute(command, t_s))
        self._executor.end_lapsed(t_s)
        return tuple(taken)

    def _frame_age_s(self, percept: Percept | None, t_s: float) -> float:
        """Return the age of the frame that the gaze rests on.

        What a person chose to look at is there whatever the camera shows.
        """
        if not self._lead.needs_camera:
            return 0.0
        return t_s - percept.captured_s if percept is not None else inf


class TickLoop:
    """Ticks at absolute slots, one at each call of ``step``.

    A tick that takes too long costs the slots it overran: they are counted and
    skipped, never caught up in a burst.

    Args:
        robot: reads, decides and writes once a tick.
        clock: the host's, or a simulated one.
        params: rate and slots; a function where the rate may change while running. Slots of another
            rate begin at the last tick's.
        stop: is given the seconds since the start, and returns why to stop, or None.
        watch: gets every tick.
    """

    def __init__(
        self,
        robot: Robot,
        clock: Clock,
        params: LoopParams | Callable[[], LoopParams],
        stop: Callable[[float], str | None],
        watch: Callable[[Tick], None],
    ) -> None:
        self._robot, self._clock, self._stop, self._watch = robot, clock, stop, watch
        self._params = params if callable(params) else lambda: params
        self._start_s = self._slots_s = self._last_s = clock.now_s()
        self._rate_hz = self._params().rate_hz
        self._slot = self._ticks = self._overruns = 0

    def step(self) -> str | None:
        """Wait for the next slot and tick; return why the loop ends, None while it goes on."""
        clock, rate_hz = self._clock, self._params().rate_hz
        if rate_hz != self._rate_hz:
            self._slots_s += self._slot * (1.0 / self._rate_hz)
            self._rate_hz, self._slot = rate_hz, 0
        period = 1.0 / rate_hz
        self._slot += 1
        clock.sleep_until(self._slots_s + self._slot * period)
        t_s = clock.now_s()
        reason = self._stop(t_s - self._start_s)
        if reason is not None:
            return reason
        try:
            tick = self._robot.tick(t_s, t_s - self._last_s)
        except DriverError as error:
            return f"fault: {error}"
        self._watch(tick)
        if tick.guard_result.level == "torque_off" and not tick.stopped:
            return f"fault: {'; '.join(tick.guard_result.critical_reasons)}"
        self._last_s = t_s
        self._ticks += 1
        late = int((clock.now_s() - self._slots_s) / period) - self._slot
        if late > 0:
            self._overruns += late
            self._slot += late
        return None

    def count(self, stopped_by: str) -> LoopCount:
        """Return ticks done, slots missed and why it ended."""
        return LoopCount(self._ticks, self._overruns, stopped_by)


def run(
    robot: Robot,
    clock: Clock,
    params: LoopParams | Callable[[], LoopParams],
    stop: Callable[[float], str | None],
    watch: Callable[[Tick], None],
) -> LoopCount:
    """Tick until ``stop(seconds)`` returns a reason or something fails; as ``TickLoop``."""
    loop = TickLoop(robot, clock, params, stop, watch)
    while (reason := loop.step()) is None:
        pass
    return loop.count(reason)

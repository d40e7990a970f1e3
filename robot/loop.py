"""The tick, and the loop that keeps its time."""

import gc
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, radians
from typing import NamedTuple, Protocol

from drivers.errors import DriverError
from drivers.types import Camera, Detections
from gaze.aversion import MODES, Aversion
from gaze.lids import Lids
from gaze.oculomotor import Oculomotor
from gaze.scanpath import Scanpath
from gaze.top_down import TopDown
from gaze.types import GazeCommand, GazeState, Percept, Target
from robot.body import Body
from robot.clock import Clock
from robot.frames import PoseHistory
from robot.kinematics import Kinematics
from robot.perception import Perception
from robot.safety import Guard
from robot.types import JointAngles, JointState, Verdict


class Tick(NamedTuple):
    """Everything one tick knew and decided; wish, permitted and measured side by side.

    events: what has happened on the bus and to the camera, in words
    """

    t_s: float
    joints: JointState
    pose: GazeState
    detections: Detections | None
    percept: Percept | None
    target: Target
    gaze: GazeCommand
    wish_rad: JointAngles
    verdict: Verdict
    events: tuple[str, ...] = ()


@dataclass(frozen=True)
class LoopParams:
    """The control rate."""

    rate_hz: float = field(
        default=200.0,
        metadata={"low": 20.0, "high": 1000.0, "unit": "Hz", "says": "control rate"},
    )
    park_s: float = field(
        default=4.0,
        metadata={
            "low": 0.0,
            "high": 30.0,
            "unit": "s",
            "says": "longest time for parking before torque goes off",
        },
    )


LID_COMMANDS: dict[str, Callable[[Lids, float], None]] = {
    "awake": lambda lids, t_s: lids.sleepy(0.0),
    "sleepy": lambda lids, t_s: lids.sleepy(0.7),
    "wink left": lambda lids, t_s: lids.wink("left", t_s),
    "wink right": lambda lids, t_s: lids.wink("right", t_s),
}
"""What can be asked of the lids."""


class LoopCount(NamedTuple):
    """How the loop kept its time."""

    ticks: int
    overruns: int
    stopped_by: str


class Chooser(Protocol):
    """Chooses what to look at, as gaze.attention.Attention does.

    top_down: the behaviours there are to choose from
    """

    top_down: TopDown

    def reset(self, t_s: float) -> None:
        """Forget everything seen."""
        ...

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Give the target in force at ``t_s``."""
        ...


class Robot:
    """All rooms of one head, wired."""

    def __init__(
        self,
        body: Body,
        kinematics: Kinematics,
        camera: Camera,
        perception: Perception,
        poses: PoseHistory,
        attention: Chooser,
        scanpath: Scanpath,
        aversion: Aversion,
        oculomotor: Oculomotor,
        lids: Lids,
        guard: Guard,
    ) -> None:
        """Take the parts, real or simulated."""
        self.body = body
        self.camera = camera
        self.perception = perception
        self.attention: Chooser = attention
        self._kinematics = kinematics
        self._poses = poses
        self._scanpath = scanpath
        self._aversion = aversion
        self._oculomotor = oculomotor
        self._lids = lids
        self._guard = guard
        self._settled = True
        self._asked: deque[tuple[str, str]] = deque()

    def ask(self, menu: str, choice: str) -> None:
        """Ask for a behaviour, a mode of conversation or a wink, from the next tick on.

        May be called from any thread.

        Raises:
            ValueError: there is no such menu or choice; the message lists what there is.
        """
        menus = self.menus()
        if menu not in menus:
            raise ValueError(f"nothing called {menu!r} to choose; there is {', '.join(menus)}")
        if choice not in menus[menu]:
            raise ValueError(f"no {menu} {choice!r}; there is {', '.join(menus[menu])}")
        self._asked.append((menu, choice))

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Give what ``ask`` takes: menu -> choices, the present one first."""
        top_down = self.attention.top_down
        return {
            "behaviour": _first(top_down.behaviour, top_down.behaviours),
            "conversation": _first(self._aversion.mode, MODES),
            "lids": tuple(LID_COMMANDS),
        }

    def start(self, clock: Clock) -> None:
        """Open camera and bus, switch torque on where the joints are, begin from there.

        Raises:
            drivers.errors.SetupError: something is absent or not as configured.
        """
        # A full pass of the garbage collector over all that start-up made takes 20 ms, four
        # slots; what is there now stays, so later passes need not look at it. Before torque
        # is on, as nothing may keep the servos waiting after.
        gc.collect()
        gc.freeze()
        self.camera.open()
        try:
            goals = self.body.start()
        except BaseException:
            self.camera.close()
            raise
        t_s = clock.now_s()
        self._guard.reset(t_s, goals)
        joints = self.body.read(t_s)
        pose = self._kinematics.forward(joints)
        self._poses.remember(t_s, pose.head_rad)
        self.attention.reset(t_s)
        self._scanpath.reset(t_s)
        self._aversion.reset(t_s)
        self._oculomotor.reset(t_s, pose)

    def tick(self, t_s: float, dt_s: float) -> Tick:
        """Read, see, choose, plan, guard, write.

        Raises:
            drivers.errors.DriverError: bus or camera are gone.
        """
        self._obey(t_s)
        joints = self.body.read(t_s)
        pose = self._kinematics.forward(joints)
        self._poses.remember(t_s, pose.head_rad)
        detections = self.camera.latest(t_s)
        percept = self.perception.see(detections, self._poses)
        target = self.attention.choose(percept, pose, t_s)
        target = self._scanpath.wander(target, percept, t_s, self._settled, pose.p_world_head_m)
        target = self._aversion.step(target, pose.p_world_head_m, t_s)
        gaze = self._oculomotor.step(target, pose, t_s, dt_s)
        self._settled = gaze.phase != "saccade"
        wish = self._kinematics.inverse(gaze)
        age_s = percept.age_s(t_s) if percept is not None else inf
        verdict = self._guard.check(wish, joints, age_s, t_s)
        self.body.write(verdict.command_rad)
        events = (*self.body.bus.events(), *self.camera.events())
        return Tick(t_s, joints, pose, detections, percept, target, gaze, wish, verdict, events)

    def park(self, pose_rad: JointAngles, clock: Clock, params: LoopParams) -> bool:
        """Move slowly to the parking pose; tell whether it was reached in time."""
        self._guard.go_gently()
        start_s = clock.now_s()
        for slot in range(1, int(params.park_s * params.rate_hz) + 1):
            clock.sleep_until(start_s + slot / params.rate_hz)
            t_s = clock.now_s()
            joints = self.body.read(t_s)
            # Parking goes home whatever the camera shows.
            self.body.write(self._guard.check(pose_rad, joints, 0.0, t_s).command_rad)
            errors = zip(pose_rad, joints.position_rad, strict=True)
            if max(abs(wish - now) for wish, now in errors) < radians(2.0):
                return True
        return False

    def stop(self) -> None:
        """Torque off, close the bus and the camera."""
        try:
            self.body.stop()
        finally:
            self.camera.close()

    def _obey(self, t_s: float) -> None:
        """Put in force what was asked for."""
        while self._asked:
            menu, choice = self._asked.popleft()
            if menu == "behaviour":
                self.attention.top_down.behave(choice)
            elif menu == "conversation":
                mode = next(mode for mode in MODES if mode == choice)
                self._aversion.converse(mode, t_s)
                self._lids.mode("rest" if mode == "none" else "conversation")
            else:
                LID_COMMANDS[choice](self._lids, t_s)


def _first(present: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """Put the present choice before the others."""
    return (present, *(name for name in names if name != present))


def run(
    robot: Robot,
    clock: Clock,
    params: LoopParams,
    stop: Callable[[float], str | None],
    watch: Callable[[Tick], None],
) -> LoopCount:
    """Tick at absolute slots until ``stop(seconds)`` gives a reason or something fails.

    A tick that takes too long costs the slots it overran: they are counted and
    skipped, never caught up in a burst.
    """
    period = 1.0 / params.rate_hz
    start_s = clock.now_s()
    last_s = start_s
    slot, ticks, overruns = 0, 0, 0
    while True:
        slot += 1
        clock.sleep_until(start_s + slot * period)
        t_s = clock.now_s()
        reason = stop(t_s - start_s)
        if reason is not None:
            return LoopCount(ticks, overruns, reason)
        try:
            tick = robot.tick(t_s, t_s - last_s)
        except DriverError as error:
            return LoopCount(ticks, overruns, f"fault: {error}")
        watch(tick)
        if tick.verdict.level == "limp":
            return LoopCount(ticks, overruns, f"fault: {'; '.join(tick.verdict.gravest)}")
        last_s = t_s
        ticks += 1
        late = int((clock.now_s() - start_s) / period) - slot
        if late > 0:
            overruns += late
            slot += late

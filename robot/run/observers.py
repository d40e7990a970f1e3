"""Observers and remote controls of a run, outside the control loop.

The page, the status line, other programs, the rig's files and the recording: each is optional, has
its own thread or process, and receives each tick with hardly any delay.
"""

import contextlib
import os
from collections.abc import Callable
from math import dist, isfinite
from typing import Any

from gazerig.drivers.vision.model_files import detector_status
from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.door.token_file import hide_token
from gazerig.robot.dashboard.feed.page_process import PageProcess
from gazerig.robot.dashboard.feed.publisher import Publisher
from gazerig.robot.dashboard.feed.rig_feed import LiveRig
from gazerig.robot.dashboard.feed.status_line import StatusLine, health_text
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.tick import Tick
from gazerig.robot.loop.tick_stream import Observers, TickStream, failure_text
from gazerig.robot.loop.timing import LoopTiming, busy_text
from gazerig.robot.model.commands import Talk
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.net.client import rig_name
from gazerig.robot.net.socket_server import RemoteServer
from gazerig.robot.net.topics import JointInfo, RigInfo, RunState
from gazerig.robot.run.doors import DoorProcesses
from gazerig.robot.run.options import level_text
from gazerig.robot.run.requests import RequestHandler
from gazerig.robot.run.rig_limits import limits
from gazerig.robot.run.run import Run
from gazerig.robot.safety.health import HOT_C, LASTING_LOAD, VOLTAGE_MARGIN_V, WARM_C
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.scenes.script import AgentAct


class RunObservers:
    """All observers of a run and all its remote controls, opened and closed together.

    In simulated time, which is faster than a page or a line can show, only the recording and the
    scene's agent observe. They must be created before the robot starts.

    Args:
        run: the run.
        say: prints a line.
        status: Rewrites the status line; None for none.
        browse: opens the page in the user's browser.
    """

    def __init__(
        self,
        run: Run,
        say: Callable[[str], None],
        status: Callable[[str], None] | None = None,
        browse: Callable[[str], object] | None = None,
    ) -> None:
        options, self._run, self._say = run.options, run, say
        self._stream = run.recorder.stream if run.recorder is not None else TickStream(say)
        self._parking = TickStream(say)
        self._timing, self._stopped_by = LoopTiming(run.loop.rate_hz), ""
        self._page: PageProcess | None = None
        self._publisher: Publisher | None = None
        self._feed: TickFeed | None = None
        self._status: StatusLine | None = None
        self._parts: list[tuple[str, Callable[[], object], Callable[[], object]]] = []
        if run.recorder is not None:
            self._parts.append(("the recording", lambda: None, self._close_recording))
        if not options.fast:
            self._feed = TickFeed()
            programs = self._server(self._feed)
            self._parts.append(("the remote control", programs.open, programs.close))
            if status is not None:
                health = run.robot.body.bus.health
                self._status = StatusLine(status, health, self._timing.figures)
            if options.page_address is not None:
                # Apart from programs of this computer, so that neither uses up the other's time.
                visitors = self._server(self._feed, confined=True)
                self._parts.append(("the page's requests", lambda: None, visitors.close))
                self._page, self._publisher = self._make_page(visitors, browse)
                self._parts.append(("the page", self._page.open, self._page.close))
            doors = DoorProcesses(run.rig.doors, os.getpid(), say)
            self._parts.append(("the doors", doors.open, doors.close))
        has_sound = not options.fast and any(one.sound for one in run.tracks.states())
        opened = run.voice.open if has_sound else lambda: None
        self._parts.append(("the voice", opened, run.voice.close))

    def _server(self, feed: TickFeed, confined: bool = False) -> RemoteServer:
        options = self._run.options
        about = {"rig": options.rig, "name": options.name or rig_name(options.rig)}
        requests = RequestHandler(
            self._run,
            feed,
            {**about, "pid": os.getpid()},
            lambda: {"page": self._page.url() if self._page is not None else None},
            confined=confined,
        )
        return RemoteServer(requests.answer, self._say)

    def _make_page(
        self, visitors: RemoteServer, browse: Callable[[str], object] | None
    ) -> tuple[PageProcess, Publisher]:
        options, say, browser = self._run.options, self._say, self._run.browser
        assert options.page_address is not None
        take = browser.take if browser is not None else None
        page = PageProcess(*options.page_address, visitors.serve, take, options.page_token)
        # Who keeps a token does not want it in a log.
        tell = say if options.token_file is None else lambda line: say(hide_token(line))
        publisher = Publisher(page, self._live_rig, self._run_state, tell, browse)
        self._stream.sinks.add("the page", publisher.take)
        self._parking.sinks.add("the page", publisher.take)
        return page, publisher

    def _live_rig(self) -> LiveRig:
        run, options = self._run, self._run.options
        shapes = run.room.shapes() if run.room is not None else None
        computed = options.no_pictures or (run.scene is not None and not options.pixels)
        names = run.models.kinematics.names
        info = RigInfo(
            run.rig.name,
            str(run.params.path),
            options.mock,
            run.room is not None and run.room.world.scene.opponent is not None,
            "" if computed else str(detector_status(run.rig.detector)),
            level_text(options.computer) if options.computer is not None else "",
            dict(zip(names, map(_joint_info, limits(run.rig.joints)), strict=True)),
        )
        picture = DrawnScene(run.scene) if run.scene is not None else None
        return LiveRig(run.shown_rig(), info, picture, shapes)

    def _run_state(self) -> RunState:
        """Return the state of the run that is not in ticks."""
        robot, params, figures = self._run.robot, self._run.params, self._timing.figures()
        menus = robot.menus()
        return RunState(
            menus["behaviour"][0],
            menus["conversation"][0],
            params.character,
            menus.get("expression", ("",))[0],
            health_text(robot.body.bus.health()),
            params.version,
            figures,
            busy_text(figures),
            self._run.scene_start_s(),
        )

    def attach(self, observers: Observers[Tick]) -> None:
        """Add all of them as observers of the ticks; any that fails is dropped."""
        if self._run.recorder is not None:
            observers.add("the recording", self._run.recorder.record)
        elif self._publisher is not None:
            observers.add("the page", self._stream.update)
        if getattr(self._run.scene, "agent", ()):
            observers.add("the simulated voice agent", SceneAgent(self._run).update)
        if not self._run.options.fast:
            observers.add("the loop's time", lambda tick: self._timing.update(tick.t_s))
        if self._publisher is not None:
            observers.add("the page's view", self._follow)
        if self._status is not None:
            observers.add("the status line", self._status.update)
        if self._feed is not None:
            observers.add("the remote control", self._feed.update)
        observers.add("the voice", self._run.voice.update)

    def show_parking(self, tick: Tick) -> None:
        """Show a tick of the motion to the parking pose, which is not recorded."""
        with contextlib.suppress(Exception):  # nothing may prevent the head from parking
            self._run.voice.stop()
            if self._status is not None:
                self._status.update(tick)
            if self._feed is not None:
                self._feed.update(tick)
            self._parking.update(tick)

    def open(self) -> None:
        """Open the remote controls, once the robot has started; any that fails is dropped."""
        for name, begin, _ in self._parts:
            self._try(name, begin)

    def close(self, stopped_by: str) -> None:
        """Close everything, when the torque is off; the recording, which may take long, last."""
        self._stopped_by = stopped_by
        for name, _, end in reversed(self._parts):
            self._try(name, end)

    def _close_recording(self) -> None:
        assert self._run.recorder is not None
        digest = self._run.bus.sent_bytes_digest()
        self._say(self._run.recorder.close(self._stopped_by, digest))

    def _try(self, name: str, action: Callable[[], object]) -> None:
        """Report an error, and continue."""
        try:
            action()
        except Exception as error:
            self._say(failure_text(name, error))

    def _follow(self, tick: Tick) -> None:
        """Show the rig again after tuning or with another camera."""
        assert self._publisher is not None
        self._publisher.process_commands(tick.commands)
        if self._run.browser is not None and self._run.browser.update():
            self._publisher.resend_geometry()


def _joint_info(limit: JointLimit) -> JointInfo:
    highest_v = limit.highest_v - VOLTAGE_MARGIN_V
    return JointInfo(
        limit.low_rad,
        limit.high_rad,
        limit.hottest_c - WARM_C,
        limit.hottest_c - HOT_C,
        limit.lowest_v + VOLTAGE_MARGIN_V,
        highest_v if isfinite(highest_v) else None,
        LASTING_LOAD,
    )


_NEAR_M = 0.5


class SceneAgent:
    """A simulated voice agent: it reports the turns of a scene's script, as a real one does."""

    def __init__(self, run: Run) -> None:
        self._run, self._scene = run, run.scene
        self._done = 0
        self._seen: dict[int, Vec3] = {}

    def update(self, tick: Tick) -> None:
        """Report what has become due at the newest tick."""
        scene: Any = self._scene
        acts: tuple[AgentAct, ...] = scene.agent
        start_s = self._run.scene_start_s()
        if start_s is None:
            return
        if tick.percept is not None:
            self._seen |= {face.id: face.p_world_m for face in tick.percept.faces}
        rounds, since_s = divmod(tick.t_s - start_s, scene.round_s)
        due = int(rounds) * len(acts) + sum(act.at_s <= since_s for act in acts)
        while self._done < due:
            act = acts[self._done % len(acts)]
            self._done += 1
            person = self._person_id(scene.face(act.person, since_s)) if act.person else None
            self._run.robot.command(
                Talk(act.state, person, act.seconds, act.text, who="mock agent", stay=True)
            )

    def _person_id(self, place: Vec3) -> int | None:
        """Return perception's number of the person last seen at a place, None without one."""
        near = [(dist(seen, place), number) for number, seen in self._seen.items()]
        return min([one for one in near if one[0] < _NEAR_M], default=(0.0, None))[1]

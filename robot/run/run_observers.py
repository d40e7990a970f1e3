"""Observers and remote controls of a run, outside the control loop.

The page, the status line, other programs, the rig's files and the recording: each is optional, has
its own thread or process, and receives each tick with hardly any delay.
"""

import contextlib
import os
from collections.abc import Callable, Iterator
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from gazerig.drivers.vision.model_files import detector_status
from gazerig.robot.dashboard.door.token_file import hide_token
from gazerig.robot.dashboard.feed.page_process import PageProcess
from gazerig.robot.dashboard.feed.publisher import Publisher
from gazerig.robot.dashboard.feed.rig_feed import LiveRig
from gazerig.robot.dashboard.feed.status_line import StatusLine, health_text
from gazerig.robot.loop.loop import LoopCount
from gazerig.robot.loop.tick import Tick
from gazerig.robot.loop.tick_stream import Observers, TickStream, failure_text
from gazerig.robot.loop.timing import LoopTiming, busy_text
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.scene import has_opponent
from gazerig.robot.net.client import rig_name
from gazerig.robot.net.live_server import LiveServer
from gazerig.robot.net.topics import JointInfo, RigInfo, RunState
from gazerig.robot.run.assemble import Assembly
from gazerig.robot.run.camera_factory import scene_start_s
from gazerig.robot.run.computer import level_text
from gazerig.robot.run.door_processes import DoorProcesses
from gazerig.robot.run.mock_agent import AgentScene, MockAgent
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.param_store import ParamStore
from gazerig.robot.run.rig_limits import limits
from gazerig.robot.run.voice import RunVoice
from gazerig.robot.safety.health import HOT_C, LASTING_LOAD, VOLTAGE_MARGIN_V, WARM_C
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene

if TYPE_CHECKING:
    from gazerig.robot.recording.recorder import Recorder


class RunObservers:
    """All observers of a run and all its remote controls, opened and closed together.

    It must be created before the robot starts.

    Args:
        assembly: the robot and its surroundings.
        options: Define the page's address, and whether time is simulated (without a user).
        say: prints a line.
        status: Rewrites the status line; None for none.
        tuning: the parameters; None if they cannot be changed from outside.
        recorder: records the run.
        browse: opens the page in the user's browser.
        voice: Says sounds and texts; it is closed with the observers.
    """

    def __init__(
        self,
        assembly: Assembly,
        options: RunOptions,
        say: Callable[[str], None],
        status: Callable[[str], None] | None = None,
        tuning: ParamStore | None = None,
        recorder: "Recorder | None" = None,
        browse: Callable[[str], object] | None = None,
        voice: RunVoice | None = None,
    ) -> None:
        self._by_browser, self._voice = False, voice
        self._made, self._fast, self._say = assembly, options.fast, say
        self._agent = (
            MockAgent(assembly.robot.command, assembly.scene, self._scene_start_s)
            if isinstance(assembly.scene, AgentScene)
            else None
        )
        self._timing = LoopTiming(assembly.loop.rate_hz)
        self._emulated = options.mock
        computed = options.no_pictures or (assembly.scene is not None and not options.pixels)
        self._detector = "" if computed else str(detector_status(assembly.live_params.rig.detector))
        self._choice = level_text(options.computer) if options.computer is not None else ""
        self._tuning, self._recorder = tuning, recorder
        name = options.name or rig_name(options.rig)
        about = {"rig": options.rig, "name": name, "pid": os.getpid()}
        self._server: LiveServer | None = None
        doors: tuple[str, ...] = ()
        if not options.fast:
            self._server = LiveServer(
                assembly.robot,
                tuning,
                assembly.clock,
                about,
                say,
                assembly.inject_fault,
                lambda: {"page": self._page.url() if self._page is not None else None},
                tuning.confined if tuning is not None else None,
                voice,
            )
            doors = assembly.live_params.rig.doors if tuning is not None else ()
        self._doors = DoorProcesses(doors, os.getpid(), say)
        address = options.page_address
        self._page = self._make_page(address, options.page_token) if address is not None else None
        # Simulated time is faster than a page or a line can show.
        live = not options.fast
        # Who keeps a token does not want it in a log.
        tell = say if options.token_file is None else lambda line: say(hide_token(line))
        self._publisher = None
        if live and self._page:
            self._publisher = Publisher(self._page, self._live_rig, self._run_state, tell, browse)
        health = assembly.robot.body.bus.health
        self._status = (
            StatusLine(status, health, self._timing.figures)
            if live and status is not None
            else None
        )
        self._stream = recorder.stream if recorder is not None else TickStream(say)
        self._parking = TickStream(say)
        if self._publisher is not None:
            self._stream.sinks.add("the page", self._publisher.take)
            self._parking.sinks.add("the page", self._publisher.take)
        self._observers = Observers[Tick](say)
        self.attach(self._observers)

    def _make_page(self, address: tuple[str, int], token: str) -> PageProcess:
        browser = self._made.browser
        on_picture = browser.take if browser is not None else None
        serve = self._server.serve if self._server is not None else None
        return PageProcess(*address, serve, on_picture, token)

    def _live_rig(self) -> LiveRig:
        made, tuning = self._made, self._tuning
        rig = made.live_params.rig
        shapes = made.room.shapes() if made.room is not None else None
        names = made.live_params.parts.kinematics.names
        return LiveRig(
            made.shown_rig(),
            RigInfo(
                rig.name,
                str(tuning.path) if tuning is not None else "",
                self._emulated,
                has_opponent(shapes),
                self._detector,
                self._choice,
                dict(zip(names, map(_joint_info, limits(rig.joints)), strict=True)),
            ),
            DrawnScene(made.scene) if made.scene is not None else None,
            shapes,
        )

    def _run_state(self) -> RunState:
        """Return the state of the run that is not in ticks."""
        robot, tuning = self._made.robot, self._tuning
        menus = robot.menus()
        figures = self._timing.figures()
        return RunState(
            menus["behaviour"][0],
            menus["conversation"][0],
            tuning.character_name if tuning is not None else "",
            menus.get("expression", ("",))[0],
            health_text(robot.body.bus.health()),
            tuning.version if tuning is not None else 0,
            figures,
            busy_text(figures),
            self._scene_start_s(),
        )

    def attach(self, observers: Observers[Tick]) -> None:
        """Add all of them as observers of the ticks; any that fails is dropped."""
        if self._recorder is not None:
            observers.add("the recording", self._recorder.record)
        elif self._publisher is not None:
            observers.add("the page", self._stream.update)
        if self._agent is not None:
            observers.add("the simulated voice agent", self._agent.update)
        if not self._fast:
            observers.add("the loop's time", self._record_time)
        if self._page is not None:
            observers.add("the page's view", self._follow)
        if self._status is not None:
            observers.add("the status line", self._status.update)
        if self._server is not None:
            observers.add("the remote control", self._server.update)
        if self._voice is not None:
            observers.add("the voice", self._voice.update)

    def update(self, tick: Tick) -> None:
        """Update all observers with a tick; called by a loop that does not update them itself."""
        self._observers.update(tick)

    def busy_message(self) -> str:
        """Return a message if the computer is too busy, "" if not or if time is simulated."""
        return busy_text(self._timing.figures())

    def show_parking(self, tick: Tick) -> None:
        """Show a tick of the motion to the parking pose, which is not recorded."""
        with contextlib.suppress(Exception):  # nothing may prevent the head from parking
            if self._voice is not None:
                self._voice.stop()
            if self._status is not None:
                self._status.update(tick)
            if self._server is not None:
                self._server.update(tick)
            self._parking.update(tick)

    def wrap_stop(self, stop: Callable[[float], str | None]) -> Callable[[float], str | None]:
        """Return the loop's ``stop`` adapted for the recording."""
        return self._recorder.wrap_stop(stop) if self._recorder is not None else stop

    def open_files(self) -> None:
        """Create the output files, before anything moves.

        Raises:
            SetupError: a file exists already or cannot be created.
        """
        if self._recorder is not None:
            self._recorder.open()

    def open(self) -> None:
        """Open the remote controls, once the robot has started; any that fails is dropped."""
        with self._report_errors("the recording"):
            if self._recorder is not None:
                self._recorder.begin()
        with self._report_errors("the remote control"):
            if self._server is not None:
                self._server.open()
        with self._report_errors("the page"):
            if self._page is not None:
                self._page.open()
        with self._report_errors("the doors"):
            self._doors.open()

    @contextlib.contextmanager
    def _report_errors(self, name: str) -> Iterator[None]:
        """Report errors of the block, and continue."""
        try:
            yield
        except Exception as error:
            self._say(failure_text(name, error))

    def remove_files(self) -> None:
        """Remove the files of a robot that could not start."""
        if self._recorder is not None:
            self._recorder.close("it could not start")

    def events(self) -> tuple[str, ...]:
        """Report events to all observers."""
        return self._recorder.events() if self._recorder is not None else ()

    def incomplete_file(self) -> Path | None:
        """Return the requested file that is incomplete, None without one."""
        return self._recorder.unwritten if self._recorder is not None else None

    def close(self, count: LoopCount) -> None:
        """Close everything, when the torque is off."""
        with self._report_errors("the doors"):
            self._doors.close()
        with self._report_errors("the voice"):
            if self._voice is not None:
                self._voice.close()
        with self._report_errors("the page"):
            if self._page is not None:
                self._page.close()
        with self._report_errors("the remote control"):
            if self._server is not None:
                self._server.close()
        with self._report_errors("the recording"):
            if self._recorder is not None:
                self._say(self._recorder.close(count.stopped_by, self._made.sent_bytes_digest()))

    def _scene_start_s(self) -> float | None:
        """Return the start of the scene, None before or without one."""
        room = self._made.room
        return room.start_s() if room is not None else scene_start_s(self._made.robot.camera)

    def _record_time(self, tick: Tick) -> None:
        """Record the time of a tick."""
        self._timing.update(tick.t_s)

    def _follow(self, tick: Tick) -> None:
        """Show the rig again after tuning or with another camera."""
        browser = self._made.browser
        if browser is not None:
            browser.update()
        if self._publisher is None:
            return
        if tick.commands:
            self._publisher.process_commands(tick.commands)
        if browser is not None and self._by_browser != browser.in_use:
            self._by_browser = browser.in_use
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

"""Execution of one run of the command line, from start to torque off, and its figures."""

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.robot.loop.events import group_events, is_register_change
from gazerig.robot.loop.joint_faults import JointFaults
from gazerig.robot.loop.loop import LoopCount, Tick, TickLoop
from gazerig.robot.loop.power_down import Again, Interrupts, PowerDown
from gazerig.robot.loop.tick_stream import Observers
from gazerig.robot.loop.timing import SWITCH_INTERVAL, frozen_objects
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.scene import BoxingScene
from gazerig.robot.run.assemble import RIGS_OWN, Assembly, Substitutes, assemble
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.param_store import ParamStore
from gazerig.robot.run.run_observers import RunObservers
from gazerig.robot.run.run_rig import run_info, run_rig
from gazerig.robot.run.run_summary import Summary
from gazerig.robot.run.scene_score import BehaviourScore, PlannerScore
from gazerig.robot.run.voice import RunVoice
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.robot.recording.recorder import Recorder


class SceneScore:
    """Score of the responses to a scene's events, by the gaze and by the action planner."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.behaviours = BehaviourScore(scene.events(), scene.round_s)
        self.planner = PlannerScore(scene.events(), scene.round_s)

    def figures(self) -> dict[str, object]:
        """Return the scores; none if a person moved the opponent, who left the script then."""
        scene = self._scene
        if isinstance(scene, BoxingScene) and scene.opponent and scene.opponent.spans_s:
            return {}
        found = {"behaviours": self.behaviours.figures(), "planner": self.planner.figures()}
        return {name: figures for name, figures in found.items() if figures}


def run_figures(
    assembly: Assembly,
    summary: Summary | None,
    score: SceneScore | None,
    count: LoopCount,
    wall_s: float,
    faults: JointFaults,
) -> dict[str, object]:
    """Join the figures of the ticks (if summarised), the loop, the frames and the bus."""
    robot = assembly.robot
    health = robot.body.bus.health()
    bus: dict[str, object] = {
        "tx_bytes": health.tx_bytes,
        "rx_bytes": health.rx_bytes,
        "errors": {kind: n for kind, n in sorted(health.errors.items()) if n},
    }
    digest = assembly.sent_bytes_digest()
    if digest is not None:
        bus["tx_sha256"] = digest
    ticks = summary.figures() if summary is not None else {}
    if score is not None:
        ticks |= score.figures()
    seconds = {"seconds": ticks.pop("seconds")} if ticks else {}
    return {
        **seconds,
        "wall_seconds": round(wall_s, 3),
        "ticks": count.ticks,
        "overruns": count.overruns,
        "faces_seen": robot.perception.frames_with_face,
        "pictures": robot.perception.frames,
        **ticks,
        "joint_faults": faults.figures(),
        "bus": bus,
        "stopped_by": count.stopped_by,
    }


SECONDS = "seconds"
"""Reason of a run that ended after its duration."""


class ComposedRun(NamedTuple):
    """A robot assembled for one run, with its remote controls and its recorder.

    tuning: None if its parameters cannot be changed from outside
    voice: None if it cannot say anything
    """

    options: RunOptions
    assembly: Assembly
    tuning: ParamStore | None
    recorder: "Recorder | None"
    voice: RunVoice | None = None


def compose(options: RunOptions, substitutes: Substitutes = RIGS_OWN) -> ComposedRun:
    """Assemble one run; nothing moves.

    Args:
        options: Options of the run.
        substitutes: Parts of a program; a recorder wraps the body.

    Raises:
        gazerig.config.load.ConfigError: the rig, character, profile or walk is invalid.
        SetupError: a film or model file cannot be used.
    """
    rig = run_rig(options)
    if options.record is None:
        recorder = None
    else:
        from gazerig.robot.description.urdf import urdf
        from gazerig.robot.recording.recorder import Recorder  # imports file formats
        from gazerig.robot.run.rig_description import description_of  # with meshes

        info = run_info(rig, options)
        shown = urdf(description_of(rig), looks=False).xml
        recorder = Recorder(options.record, info, options.force, options.fast, shown)
        substitutes = substitutes._replace(body=recorder.wrap_body)
    assembly = assemble(rig, options, substitutes)
    names = (options.rig, options.character, options.profile)
    tuning = ParamStore(assembly.live_params, assembly.robot.command, *names)
    voice = RunVoice(
        assembly.robot.command,
        lambda: assembly.live_params.rig,
        assembly.clock,
        tuning.confined.folder,
        options.fast,
        assembly.robot.report,
    )
    return ComposedRun(options, assembly, tuning, recorder, voice)


def run(
    composed: ComposedRun,
    stopped: Callable[[], str | None],
    say: Callable[[str], None],
    status: Callable[[str], None] | None = None,
    watch: Callable[[Tick], object] | None = None,
    browse: Callable[[str], object] | None = None,
    summarised: bool = True,
) -> dict[str, object]:
    """Run until the time is over, a signal arrives or a part fails; return the figures.

    Args:
        composed: The composed run.
        stopped: returns the name of an arrived signal, None before.
        say: writes a line.
        status: Rewrites the status line; None for none.
        watch: Receives every tick.
        browse: Opens the page in the user's browser; None: the user does.
        summarised: also summarise every tick, for figures of the gaze and of a scene's events.

    Raises:
        SetupError: the run cannot start; nothing has moved.
    """
    try:
        session = Session(composed, stopped, say, status, watch, browse, summarised)
        return session.run()
    finally:
        composed.assembly.close()


class Session:
    """One run, with its observers; arguments as in ``run``.

    stopped_by: reason of its end; a fault unless the block of ``power_on`` sets another one
    """

    def __init__(
        self,
        composed: ComposedRun,
        stopped: Callable[[], str | None],
        say: Callable[[str], None],
        status: Callable[[str], None] | None = None,
        watch: Callable[[Tick], object] | None = None,
        browse: Callable[[str], object] | None = None,
        summarised: bool = True,
    ) -> None:
        options, assembly = composed.options, composed.assembly
        self._options, self._made = options, assembly

        def tried(line: str) -> None:  # a failed message must not end the run
            with contextlib.suppress(Exception):
                say(line)

        self._say = tried
        self._run_observers = RunObservers(
            assembly, options, tried, status, composed.tuning, composed.recorder, browse=browse,
            voice=composed.voice,
        )  # fmt: skip
        self._summary = Summary() if summarised else None
        self._faults = JointFaults(tried, self._run_observers.busy_message)
        scene = assembly.scene
        self._score = SceneScore(scene) if summarised and scene is not None else None
        self._start_s = 0.0
        self.stopped_by = "fault: unexpected error"
        self._count = LoopCount(0, 0, self.stopped_by)
        self._unreleased: tuple[str, ...] = ()
        observers = Observers[Tick](self._say)
        if self._summary is not None:
            observers.add("the summary", self._summary.update)
        observers.add("the watch for faults", self._faults.update)
        self._run_observers.attach(observers)
        if self._score is not None:
            observers.add("the scene's score", self._score.behaviours.update)
            if scene is not None and scene.behaviours:
                observers.add("the planner's score", self._score.planner.update)
        observers.add("the log", self._print_events)
        if watch is not None:
            observers.add("the program", watch)
        try:
            for menu, choice in options.initial_choices:
                assembly.robot.ask(menu, choice)
        except ValueError as error:
            raise SetupError(str(error)) from error
        self._observers = observers
        self._longest_s = _longest_s(assembly, options)
        self._interrupts = Interrupts.from_stop(stopped)

    def _print_events(self, tick: Tick) -> None:
        """Print the events of a tick."""
        events = tick.events
        if events:
            events = tuple(group_events(events))
        for event in (*events, *self._run_observers.events()):
            self._say(f"{tick.t_s - self._start_s:.2f} s: {event}")

    def _stop_reason(self, seconds: float) -> str | None:
        """Return the reason for ending the run now, None while it continues."""
        over = self._longest_s is not None and seconds >= self._longest_s - 1e-9
        return self._interrupts() or (SECONDS if over else None)

    def run(self) -> dict[str, object]:
        """Run from torque on to torque off; return the figures."""
        wall = RealClock()
        began_s = wall.now_s()
        with self.power_on() as loop:
            while (reason := loop.step()) is None:
                pass
            self.stopped_by = reason
        wall_s = wall.now_s() - began_s
        self._faults.close()
        figures = run_figures(
            self._made, self._summary, self._score, self._count, wall_s, self._faults
        )
        unwritten = self._run_observers.incomplete_file()
        if unwritten is not None:
            figures["not_written"] = str(unwritten)
        if self._unreleased:
            figures["torque_off_unconfirmed"] = self._unreleased
        return figures

    @contextlib.contextmanager
    def power_on(self) -> Iterator[TickLoop]:
        """Switch the torque on, run the block, which steps the loop, and shut down.

        Raises:
            SetupError: the run cannot start; nothing has moved.
        """
        assembly, run_observers, say = self._made, self._run_observers, self._say
        run_observers.open_files()
        begun = False
        try:
            with (
                frozen_objects() if self._options.fast else SWITCH_INTERVAL,
                self._interrupts,
                prepare_shutdown(
                    assembly, say, self._interrupts, run_observers.show_parking
                ) as leaving,
            ):
                leaving.switch_on(
                    lambda: assembly.robot.start(
                        assembly.clock, self._interrupts.raise_if_requested
                    )
                )
                begun = True
                self._start_s = assembly.clock.now_s()
                events, options = self._made.robot.body.bus.events(), self._options
                if options.mock and not options.verbose:  # omit registers of emulated servos
                    events = tuple([event for event in events if not is_register_change(event)])
                for note in (*assembly.notes, *group_events(events)):
                    say(note)
                run_observers.open()
                loop = TickLoop(
                    assembly.robot, assembly.clock, assembly.loop, run_observers.wrap_stop(self._stop_reason),
                    self._observers.update,
                )  # fmt: skip
                yield loop
                self._count = loop.count(self.stopped_by)
                leaving.cause = self.stopped_by
            self._unreleased = leaving.unreleased
        finally:
            if begun:
                run_observers.close(self._count)
            else:
                run_observers.remove_files()


def _longest_s(assembly: Assembly, options: RunOptions) -> float | None:
    """Return the duration of the run, s: the given one, or in simulated time that of a round."""
    if options.seconds is None and options.fast and assembly.scene is not None:
        return assembly.scene.round_s + 1.0  # includes the end of the round
    return options.seconds


def shut_down(
    assembly: Assembly,
    count: LoopCount,
    say: Callable[[str], None],
) -> None:
    """Park, switch the torque off, close, and report the results; every end uses it."""
    leaving = prepare_shutdown(assembly, say, Interrupts())
    leaving.cause = count.stopped_by
    leaving.shut_down()


def prepare_shutdown(
    assembly: Assembly,
    say: Callable[[str], None],
    interrupts: Interrupts,
    watch: Callable[[Tick], object] | None = None,
) -> PowerDown:
    """Return the shutdown of a run of this robot; watch: receives every tick of parking."""
    robot = assembly.robot

    def torque_off() -> tuple[str, ...]:
        try:
            return robot.stop()
        finally:
            for event in robot.closing_events:
                say(event)

    return PowerDown(
        lambda again: park_unless_stopped(assembly, again, watch),
        torque_off,
        say,
        interrupts,
    )


def park_unless_stopped(
    assembly: Assembly, again: Again, watch: Callable[[Tick], object] | None = None
) -> str:
    """Park a robot unless it was stopped; return the messages."""
    robot = assembly.robot
    if robot.stopped:
        return "not parked, as it was stopped"
    if robot.park(assembly.park_rad, assembly.clock, assembly.loop, again, watch):
        return "parked"
    return "not parked (interrupted)" if again() else "not parked"

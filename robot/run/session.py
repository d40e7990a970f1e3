"""One run from torque on to torque off: who watches it, and how it ends.

Every end passes ``prepare_shutdown``: the head parks, the torque is switched off, one line reports
it. Then the observers are closed, the recording last, and the processes of the run are ended.
"""

import contextlib
from collections import defaultdict
from collections.abc import Callable, Iterator
from datetime import datetime
from functools import partial

from gazerig.drivers.errors import SetupError
from gazerig.gaze.schedule import Schedule, seconds_of_day
from gazerig.robot.loop.events import group_events, is_register_change
from gazerig.robot.loop.joint_faults import JointFaults
from gazerig.robot.loop.loop import LoopCount, Tick, TickLoop
from gazerig.robot.loop.power_down import Again, Interrupts, PowerDown
from gazerig.robot.loop.tick_stream import Observers
from gazerig.robot.loop.timing import SWITCH_INTERVAL, frozen_objects
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import Play
from gazerig.robot.run.observers import RunObservers
from gazerig.robot.run.run import Run

SECONDS = "seconds"
"""Reason of a run that ended after its duration."""


class Session:
    """One run with its observers, until the time is over, a signal arrives or a part fails.

    Args:
        run: The run, which is closed at the end.
        stopped: returns the name of an arrived signal, None before.
        say: writes a line.
        status: Rewrites the status line; None for none.
        watch: Receives every tick.
        browse: Opens the page in the user's browser; None: the user does.

    Attributes:
        stopped_by: reason of its end; a fault unless the block of ``power_on`` sets another one
    """

    def __init__(
        self,
        run: Run,
        stopped: Callable[[], str | None],
        say: Callable[[str], None],
        status: Callable[[str], None] | None = None,
        watch: Callable[[Tick], object] | None = None,
        browse: Callable[[str], object] | None = None,
    ) -> None:
        self._run, self._write = run, say
        self._status, self._watch, self._browse = status, watch, browse
        self._interrupts = Interrupts.from_stop(stopped)
        self._target_s: defaultdict[str, float] = defaultdict(float)
        self._last: Tick | None = None
        self._longest_s = run.options.seconds
        if self._longest_s is None and run.options.fast and run.scene is not None:
            self._longest_s = run.scene.round_s + 1.0  # includes the end of the round
        self.stopped_by = "fault: unexpected error"
        self._figures: dict[str, object] = {}

    def run(self) -> dict[str, object]:
        """Run from torque on to torque off; return the figures.

        Raises:
            SetupError: the run cannot start; nothing has moved.
        """
        wall = RealClock()
        began_s = wall.now_s()
        with self.power_on() as loop:
            while (reason := loop.step()) is None:
                pass
            self.stopped_by = reason
        return {"wall_seconds": round(wall.now_s() - began_s, 3), **self._figures}

    @contextlib.contextmanager
    def power_on(self) -> Iterator[TickLoop]:
        """Switch the torque on, run the block, which steps the loop, and shut down.

        Raises:
            SetupError: the run cannot start; nothing has moved.
        """
        run, count = self._run, LoopCount(0, 0, self.stopped_by)
        with contextlib.ExitStack() as closed_last:
            closed_last.callback(run.close)
            people = RunObservers(run, self._say, self._status, self._browse)
            faults = JointFaults(self._say)
            observers = self._observers(people, faults)
            _choose(run)
            recorder, begun = run.recorder, False
            if recorder is not None:
                recorder.open()
            try:
                with (
                    frozen_objects() if run.options.fast else SWITCH_INTERVAL,
                    self._interrupts,
                    prepare_shutdown(run, self._say, self._interrupts, people.show_parking) as end,
                ):
                    ready = self._interrupts.raise_if_requested
                    end.switch_on(lambda: run.robot.start(run.clock, ready))
                    begun, self._start_s = True, run.clock.now_s()
                    self._print_start()
                    people.open()
                    stop: Callable[[float], str | None] = self._stop_reason
                    if recorder is not None:
                        stop = recorder.wrap_stop(stop)
                    loop = TickLoop(run.robot, run.clock, run.loop, stop, observers.update)
                    yield loop
                    count = loop.count(self.stopped_by)
                    end.cause = self.stopped_by
            finally:
                if begun:
                    people.close(count.stopped_by)
                elif recorder is not None:
                    recorder.close("it could not start")
            self._figures = self._collect_figures(count, faults)
            if recorder is not None and recorder.unwritten is not None:
                self._figures["not_written"] = str(recorder.unwritten)
            if end.unreleased:
                self._figures["torque_off_unconfirmed"] = end.unreleased

    def _say(self, line: str) -> None:
        with contextlib.suppress(Exception):  # a failed message must not end the run
            self._write(line)

    def _observers(self, people: RunObservers, faults: JointFaults) -> Observers[Tick]:
        observers = Observers[Tick](self._say)
        observers.add("the summary", self._summarise)
        observers.add("the watch for faults", faults.update)
        people.attach(observers)

        def print_events(tick: Tick) -> None:
            events = group_events(tick.events) if tick.events else ()
            lost = self._run.recorder.events() if self._run.recorder is not None else ()
            for event in (*events, *lost):
                self._say(f"{tick.t_s - self._start_s:.2f} s: {event}")

        observers.add("the log", print_events)
        if starts := self._run.rig.schedule:
            observers.add("the schedule", partial(self._start_tracks, Schedule(starts)))
        if self._watch is not None:
            observers.add("the program", self._watch)
        return observers

    def _summarise(self, tick: Tick) -> None:
        """Count the time of each kind of target."""
        if self._last is not None:
            self._target_s[tick.target.kind] += tick.t_s - self._last.t_s
        self._last = tick

    def _start_tracks(self, schedule: Schedule, tick: Tick) -> None:
        """Order the tracks that start now, unless a client or another show leads.

        In simulated time a run begins at midnight: the same seed gives the same bytes.
        """
        robot, since_s = self._run.robot, tick.t_s - self._start_s
        day_s = since_s if self._run.options.fast else seconds_of_day(datetime.now())
        source = tick.control_source
        for name in schedule.due(tick.percept, tick.t_s, day_s):
            if source.overrides_gaze or source.joints:
                continue
            try:
                robot.command(Play(name, who="schedule"))
            except ValueError as error:
                robot.report(f"schedule: {error}")

    def _stop_reason(self, seconds: float) -> str | None:
        """Return the reason for ending the run now, None while it continues."""
        over = self._longest_s is not None and seconds >= self._longest_s - 1e-9
        return self._interrupts() or (SECONDS if over else None)

    def _print_start(self) -> None:
        events = self._run.robot.body.bus.events()
        if self._run.options.mock:  # omit registers of emulated servos
            events = tuple(event for event in events if not is_register_change(event))
        for note in (*self._run.notes, *group_events(events)):
            self._say(note)

    def _collect_figures(self, count: LoopCount, faults: JointFaults) -> dict[str, object]:
        """Return the figures of gaze, loop, frames and bus."""
        perception, health = self._run.robot.perception, self._run.robot.body.bus.health()
        bus: dict[str, object] = {
            "tx_bytes": health.tx_bytes,
            "rx_bytes": health.rx_bytes,
            "errors": {kind: n for kind, n in sorted(health.errors.items()) if n},
        }
        digest = self._run.bus.sent_bytes_digest()
        if digest is not None:
            bus["tx_sha256"] = digest
        seconds, gaze = sum(self._target_s.values()), self._last.gaze if self._last else None
        return {
            "seconds": round(seconds, 6),
            "fixations": gaze.fixations if gaze else 0,
            "saccades": gaze.saccades if gaze else 0,
            "blinks": gaze.blinks if gaze else 0,
            "target_share": {
                kind: round(time_s / seconds, 4)
                for kind, time_s in sorted(self._target_s.items(), key=lambda item: -item[1])
            },
            "ticks": count.ticks,
            "overruns": count.overruns,
            "faces_seen": perception.frames_with_face,
            "pictures": perception.frames,
            "joint_faults": faults.counts,
            "bus": bus,
            "stopped_by": count.stopped_by,
        }


def _choose(run: Run) -> None:
    """Choose the state of a conversation that the command line names.

    Raises:
        SetupError: there is no such state.
    """
    try:
        if run.options.conversation is not None:
            run.robot.ask("conversation", run.options.conversation)
    except ValueError as error:
        raise SetupError(str(error)) from error


def prepare_shutdown(
    run: Run,
    say: Callable[[str], None],
    interrupts: Interrupts,
    watch: Callable[[Tick], object] | None = None,
) -> PowerDown:
    """Return the end of a run: park, torque off, one line; watch: receives ticks of parking."""
    robot = run.robot

    def park(again: Again) -> str:
        if robot.stopped:
            return "not parked, as it was stopped"
        if robot.park(run.park_rad, run.clock, run.loop, again, watch):
            return "parked"
        return "not parked (interrupted)" if again() else "not parked"

    def torque_off() -> tuple[str, ...]:
        try:
            return robot.stop()
        finally:
            for event in robot.closing_events:
                say(event)

    return PowerDown(park, torque_off, say, interrupts)

"""Presentation of a study's conditions on the head in the room by changing parameters of its run.

A condition with its own rig needs another run: the head parks and restarts with that rig. The run
and its camera pictures are each recorded only with the participant's consent.
"""

import threading
from collections.abc import Callable
from dataclasses import replace
from math import nan
from pathlib import Path

from gazerig.drivers.errors import DriverError
from gazerig.features.study.pages.experimenter_line import HeadReport
from gazerig.features.study.run.head_process import HeadProcess
from gazerig.features.study.run.study_file import LoadedStudy
from gazerig.features.study.study_run import HeadLost, PresentationData
from gazerig.features.study.study_session import ShownTrial
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.head_state import HeadState
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Value

_LOOKS_S, _LATE_S, _HELD_S = 0.2, 1.0, 1.0
_MOST_REASONS = 3
_PICTURES_HZ = 2.0

Agreed = Callable[[], tuple[bool, bool]]
"""Returns whether the run may be recorded, and camera pictures with it."""


class HeadPresenter:
    """Shows conditions on a head, and reports its health to the experimenter's page.

    Attributes:
        head: The process, None while none runs.

    Args:
        study: a checked study.
        options: of a run of the study's rig.
        folder: folder of the participant, for recordings and logs.
        agreed: called whenever the head starts.
        clock: the host's.
    """

    def __init__(
        self, study: LoadedStudy, options: RunOptions, folder: Path, agreed: Agreed, clock: Clock
    ) -> None:
        self._study, self._options, self._folder = study, options, folder
        self._agreed, self._clock = agreed, clock
        self.head: HeadProcess | None = None
        self._rig: str | None = None
        self._condition: str | None = None
        self._recording = ""
        self._from_s = nan
        self._report = HeadReport("none")
        self._ended = threading.Event()
        self._watching = threading.Thread(target=self._watch, name="head watch", daemon=True)
        self._watching.start()

    def begin(self, shown: ShownTrial) -> None:
        """Show a condition from now on; the head is started if necessary.

        Raises:
            HeadLost: it cannot be shown.
        """
        head = self._head_for(shown.condition)
        before, changes = self._condition, dict[str, Value]()
        try:
            if not self._rig:
                changes = self._study.changes(before, shown.condition)
            elif before is None:
                changes = self._study.changes_of_own_rig(shown.condition)
            if changes:
                head.client.set_many(changes)
        except DriverError as error:
            raise HeadLost(f"the condition cannot be shown: {error}") from error
        self._condition = shown.condition
        self._from_s = head.state().t_s

    def end(self) -> PresentationData:
        """End the presentation; return its place in the recording."""
        try:
            to_s = nan if self.head is None else self.head.state().t_s
        except HeadLost:
            to_s = nan
        return PresentationData(self._recording, (self._from_s, to_s))

    def fault(self) -> str:
        """Return why conditions cannot be shown, "" without a fault or a run."""
        report = self._report
        if report.state == "stopped":
            return f"stopped: {report.says}"
        return report.says if report.state == "fault" else ""

    def restart(self) -> None:
        """Restart the head; ``fault`` reports the result."""
        condition = self._condition
        self.close_head()
        self._report = HeadReport("none")
        if condition is not None:
            try:
                self._head_for(condition)
            except HeadLost as lost:
                self._report = HeadReport("fault", str(lost))

    def report(self) -> HeadReport:
        """Return the head's health immediately."""
        return self._report

    def stop(self, why: str) -> str:
        """Switch its torque off; return the reason of a failure, "" on success."""
        return self._call_head(lambda head: head.client.stop(why))

    def resume(self) -> str:
        """Switch its torque on again; return the reason of a failure, "" on success."""
        return self._call_head(lambda head: head.client.resume(confirmed=True))

    def close(self) -> None:
        """Park the head and end its process."""
        self._ended.set()
        self._watching.join()
        self.close_head()

    def close_head(self) -> None:
        """Park the head and end its process; it may be started again."""
        head, self.head = self.head, None
        self._rig, self._condition = None, None
        if head is not None:
            head.end()

    def _call_head(self, what: Callable[[HeadProcess], object]) -> str:
        head = self.head
        if head is None:
            return "the head does not run"
        try:
            what(head)
        except DriverError as error:
            return str(error)
        return ""

    def _head_for(self, condition: str) -> HeadProcess:
        """Return the head with a condition's rig; it is started if necessary."""
        one = self._study.design.conditions[condition]
        rig = condition if one.rig is not None else ""
        if self.head is not None and self.head.alive and self._rig == rig:
            return self.head
        self.close_head()
        options = self._options
        if one.rig is not None:
            own = {"rig": one.rig, "profile": one.profile, "character": one.character}
            options = replace(options, **own)  # type: ignore[arg-type]
        number = len(list(self._folder.glob("run-*.log"))) + 1
        name = f"run-{number:02d}"
        recorded, pictures = self._agreed()
        self._recording = f"{name}.mcap" if recorded else ""
        if recorded:
            hz = _PICTURES_HZ if pictures else 0.0
            path = self._folder / self._recording
            options = replace(options, record=path, record_pictures=hz)
        self.head = HeadProcess(options, self._folder / f"{name}.log", self._clock)
        self._rig = rig
        return self.head

    def _watch(self) -> None:
        """Keep the report up to date; the target of the watching thread."""
        judge = _HealthMonitor(self._clock)
        while not self._ended.wait(_LOOKS_S):
            head = self.head
            if head is None:
                continue
            try:
                report = judge.report(head.state())
            except HeadLost as lost:
                report = HeadReport("fault", str(lost))
            if head is self.head:
                self._report = report


class _HealthMonitor:
    """Derives a head's health from its newest ticks."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._tick_s, self._seen_s = nan, clock.now_s()
        self._free_s = self._seen_s

    def report(self, state: HeadState) -> HeadReport:
        """Return the head's health.

        A head that is held for longer than a moment no longer shows its condition.
        """
        now_s = self._clock.now_s()
        if state.t_s != self._tick_s:
            self._tick_s, self._seen_s = state.t_s, now_s
        if state.level not in ("hold", "torque_off"):
            self._free_s = now_s
        if state.stopped:
            return HeadReport("stopped", state.stopped)
        if now_s - self._free_s > _HELD_S:
            more = len(state.reasons) - _MOST_REASONS
            held = "; ".join(state.reasons[:_MOST_REASONS]) + f" and {more} more" * (more > 0)
            return HeadReport("fault", f"the joints are held: {held}")
        if now_s - self._seen_s > _LATE_S:
            return HeadReport("late", "the head's control loop is not running")
        return HeadReport("alive")

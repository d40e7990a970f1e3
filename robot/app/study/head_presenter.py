"""The head in the room shows the conditions of a study: it runs on, and its parameters change.

A condition with a rig of its own needs another run: the head parks and starts as that rig. What
happens is recorded where the participant agreed to it; camera pictures only where they agreed to
these.
"""

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import nan
from pathlib import Path

from gazerig.config.study_file import LoadedStudy
from gazerig.drivers.errors import DriverError
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.study.head_process import HeadProcess
from gazerig.robot.dashboard.study.head_link import HeadReport
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Value
from gazerig.robot.study.presenter import HeadLost, Presented
from gazerig.robot.study.session import ShownTrial

_LOOKS_S, _LATE_S = 0.2, 1.0
_PICTURES_HZ = 2.0

Agreed = Callable[[], tuple[bool, bool]]
"""Returns whether the run may be recorded, and camera pictures with it."""


class HeadPresenter:
    """Shows conditions on a head; also what the experimenter's page knows of it.

    Args:
        study: a checked one.
        options: of a run of the study's rig.
        folder: of the participant, for recordings and logs.
        agreed: asked whenever the head starts.
        clock: the host's.
    """

    def __init__(
        self, study: LoadedStudy, options: RunOptions, folder: Path, agreed: Agreed, clock: Clock
    ) -> None:
        self._study, self._options, self._folder = study, options, folder
        self._agreed, self._clock = agreed, clock
        self._head: HeadProcess | None = None
        self._rig: str | None = None
        self._condition: str | None = None
        self._recording = ""
        self._from_s = nan
        self._report = HeadReport("none")
        self._ended = threading.Event()
        self._watching = threading.Thread(target=self._watch, name="head watch", daemon=True)
        self._watching.start()

    def begin(self, shown: ShownTrial) -> None:
        """Show a condition from now on; a head that does not run yet is started.

        Raises:
            HeadLost: it cannot.
        """
        head = self._head_for(shown.condition)
        try:
            changes = self._changes(shown.condition)
            if changes:
                head.client.set_many(changes)
        except DriverError as error:
            raise HeadLost(f"the condition cannot be shown: {error}") from error
        self._condition = shown.condition
        self._from_s = head.state().t_s

    def end(self) -> Presented:
        """Return where in the recording the presentation is that ends now."""
        try:
            to_s = nan if self._head is None else self._head.state().t_s
        except HeadLost:
            to_s = nan
        return Presented(self._recording, (self._from_s, to_s))

    def fault(self) -> str:
        """Return why nothing can be shown, "" while all is well or nothing runs yet."""
        report = self._report
        return report.says if report.state in ("fault", "stopped") else ""

    def restart(self) -> None:
        """Start the head again; what is wrong then ``fault`` says."""
        condition = self._condition
        self.close_head()
        self._report = HeadReport("none")
        if condition is not None:
            try:
                self._head_for(condition)
            except HeadLost as lost:
                self._report = HeadReport("fault", str(lost))

    def report(self) -> HeadReport:
        """Return how the head is, at once."""
        return self._report

    def stop(self, why: str) -> str:
        """Take its torque off; return why that was not done, "" where it was."""
        return self._asked(lambda head: head.client.stop(why))

    def resume(self) -> str:
        """Put its torque on again; return why that was not done, "" where it was."""
        return self._asked(lambda head: head.client.resume(confirmed=True))

    def close(self) -> None:
        """Park the head and end its process."""
        self._ended.set()
        self._watching.join()
        self.close_head()

    def close_head(self) -> None:
        """Park the head and end its process; it may be started again."""
        head, self._head = self._head, None
        self._rig, self._condition = None, None
        if head is not None:
            head.end()

    def _asked(self, what: Callable[[HeadProcess], object]) -> str:
        head = self._head
        if head is None:
            return "the head does not run"
        try:
            what(head)
        except DriverError as error:
            return str(error)
        return ""

    def _head_for(self, condition: str) -> HeadProcess:
        """Return the head as the rig that a condition needs, started if need be."""
        one = self._study.design.conditions[condition]
        rig = condition if one.rig is not None else ""
        if self._head is not None and self._head.alive and self._rig == rig:
            return self._head
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
        self._head = HeadProcess(options, self._folder / f"{name}.log", self._clock)
        self._rig = rig
        return self._head

    def _changes(self, condition: str) -> Mapping[str, Value]:
        """Return what turns the running head into a condition, by dotted key."""
        before = self._condition
        if self._rig:
            return self._study.changes_of_own_rig(condition) if before is None else {}
        return self._study.changes(before, condition)

    def _watch(self) -> None:
        """Keep the report new; the thread of that."""
        seen_s, at_s = nan, self._clock.now_s()
        while not self._ended.wait(_LOOKS_S):
            head = self._head
            if head is None:
                continue
            try:
                state = head.state()
            except HeadLost as lost:
                if head is self._head:
                    self._report = HeadReport("fault", str(lost))
                continue
            now_s = self._clock.now_s()
            if state.t_s != seen_s:
                seen_s, at_s = state.t_s, now_s
            if head is not self._head:
                continue
            if state.stopped:
                self._report = HeadReport("stopped", f"stopped: {state.stopped}")
            elif state.level == "torque_off":
                self._report = HeadReport("fault", "; ".join(state.reasons) or "its torque is off")
            elif now_s - at_s > _LATE_S:
                self._report = HeadReport("late", "the head does not tick")
            else:
                faults = [f"{name}: {one.fault}" for name, one in state.joints.items() if one.fault]
                self._report = HeadReport("alive", "; ".join(faults))

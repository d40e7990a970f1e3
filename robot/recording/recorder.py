"""Records a run without ever making the control loop wait.

A process of its own writes the file (gazerig.robot.recording.writer_process); a tick is handed
over as plain tuples and the loop goes on at once. The process outlives this program by
as long as it takes to close the file.
"""

import os
import secrets
import shutil
from collections.abc import Callable
from math import inf
from pathlib import Path

from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import BusHealth
from gazerig.gaze.types import Percept
from gazerig.robot.control.body import Body
from gazerig.robot.control.tick import Tick
from gazerig.robot.recording import writer_process as writer
from gazerig.robot.recording.frame_encoder import FrameEncoder
from gazerig.robot.recording.joint_recorder import JointRecorder
from gazerig.robot.recording.run_info import RunEnd, RunInfo, as_text, started_ns
from gazerig.robot.recording.tick_record import BodyRecord, MeasuredJoints, flat, flat_percept
from gazerig.robot.recording.writer_client import WriterClient

_HEALTH_S = 1.0
_SEND_S = 0.05


class Recorder:
    """A recording of one run as the control loop sees it.

    lost: ticks that could not be kept
    """

    def __init__(
        self,
        path: Path,
        info: RunInfo,
        over: bool = False,
        patient: bool = False,
    ) -> None:
        """Prepare a recording; nothing is touched yet.

        over: an existing file is written over
        patient: wait for the writer where it is behind, as a run in simulated time may
        """
        self._path = path
        self._info = info
        self._health: Callable[[], BusHealth] = _no_counts
        self._over = over
        self._link = WriterClient(patient)
        self._frames = FrameEncoder(info.pictures_hz, at_once=patient)
        self._body_records: list[BodyRecord] = []
        self._percept: Percept | None = None
        self._percepts = 0
        self._last_s: float | None = None
        self._seconds: float | None = None
        self._checked_s = self._sent_s = -inf
        self._beside: Path | None = None
        self._opened = self._said = False
        self.lost = 0

    def open(self) -> None:
        """Create the file and start the process that writes it; returns at once.

        Raises:
            SetupError: the file exists or cannot be made.
        """
        if self._over and self._path.is_file():
            target = Path(os.path.realpath(self._path))
            self._beside = target.with_name(f".{target.name[:80]}-{secrets.token_hex(4)}")
        file_fd = _created(self._beside or self._path, self._over)
        self._opened = True
        try:
            self._link.open(file_fd)
        finally:
            os.close(file_fd)
        self._link.post(writer.BEGIN, (as_text(self._info), started_ns(self._info)))
        self._link.flush()
        self._frames.start()

    def begin(self) -> None:
        """Replace an older recording, now that the run has begun.

        Raises:
            OSError: that is refused; the older one stays.
        """
        if self._beside is None:
            return
        target = Path(os.path.realpath(self._path))
        shutil.copymode(target, self._beside)
        os.replace(self._beside, target)
        self._beside = None

    def recorded(self, body: Body) -> Body:
        """Return a body to take the place of a robot's, so that all it says is recorded."""
        self._health = body.bus.health
        return JointRecorder(body, self._body_records.append)

    def timed(self, stop: Callable[[float], str | None]) -> Callable[[float], str | None]:
        """Return a loop's ``stop`` that notes the time since the loop began."""

        def noted(seconds: float) -> str | None:
            self._seconds = seconds
            return stop(seconds)

        return noted

    def record(self, tick: Tick) -> None:
        """Record a tick; called by the loop."""
        before = tuple(
            [
                h
                for h in self._body_records
                if not (type(h) is MeasuredJoints and h.joints is tick.joints)
            ]
        )
        self._body_records.clear()
        dt_s = tick.t_s - self._last_s if self._last_s is not None else self._seconds or 0.0
        self._last_s = tick.t_s
        if not self._link.alive or self._link.failed:
            return
        number = self._number(tick.percept)
        known = number is not None or tick.percept is None
        if not known or not self._link.post(writer.TICK, flat(tick, number, dt_s, before)):
            self.lost += 1
        self._frames.look(tick)
        self._post_frames()
        if tick.t_s - self._checked_s >= _HEALTH_S:
            self._checked_s = tick.t_s
            self._link.post(writer.HEALTH, (tuple(self._health()), self.lost))
            self._link.listen()
        if tick.t_s - self._sent_s >= _SEND_S:
            self._sent_s = tick.t_s
            self._link.flush()

    def events(self) -> tuple[str, ...]:
        """Return, once, the event that the recording cannot go on."""
        if self._said or not self._link.failed:
            return ()
        self._said = True
        return (f"recording stopped ({self._link.failed}); the run goes on without it",)

    def close(self, stopped_by: str = "", tx_sha256: str | None = None) -> str:
        """End the recording, wait for its file, and say in one line what is in it.

        To be called when the torque is off: on a slow disk it takes seconds. Where the run
        did not come as far as a tick, no file is left.

        stopped_by: what ended the run; tx_sha256: of all bytes on an emulated bus
        """
        self._frames.stop()
        self._post_frames()
        self._link.drain()  # there is always room for how it ended
        end = RunEnd(stopped_by, self.lost, self._seconds, tx_sha256 or "")
        self._link.post(writer.END, {name: getattr(end, name) for name in RunEnd.__slots__})
        self._link.close()
        if self._last_s is None:
            if self._beside is not None:
                self._beside.unlink(missing_ok=True)
                return f"nothing was recorded: {self._path} is as it was"
            if self._opened:  # else it is another program's
                self._path.unlink(missing_ok=True)
            return f"nothing was recorded: {self._path} is not made"
        done = self._link.done
        if done is None:
            return f"recording in {self._path} is not whole: {self._link.failed}"
        frames = f", {done.frames} frames" if done.frames else ""
        lost = f"; {self.lost} ticks could not be kept" if self.lost else ""
        size_mb = done.size / 1e6
        return f"{done.ticks} ticks{frames} ({size_mb:.1f} MB) recorded in {self._path}{lost}"

    @property
    def unwritten(self) -> Path | None:
        """Return the file that is not as it was asked for, None where all is well."""
        return self._path if self._opened and self._link.failed else None

    def _number(self, percept: Percept | None) -> int | None:
        """Return a percept's number, handing it over where it is new; None where it is lost."""
        if percept is None:
            return None
        if percept is not self._percept:
            if not self._link.post(writer.PERCEPT, flat_percept(self._percepts + 1, percept)):
                return None
            self._percept, self._percepts = percept, self._percepts + 1
        return self._percepts

    def _post_frames(self) -> None:
        for frame in self._frames.taken():
            self._link.post(writer.FRAME, frame)


def _no_counts() -> BusHealth:
    return BusHealth(0, 0, {})


def _created(path: Path, over: bool) -> int:
    """Create the file to be written.

    Raises:
        SetupError: it exists or cannot be made.
    """
    flags = os.O_WRONLY | os.O_CREAT | (os.O_TRUNC if over else os.O_EXCL)
    try:
        return os.open(path, flags, 0o644)
    except FileExistsError:
        raise SetupError(f"{path} already exists: choose another name or --force") from None
    except OSError as error:
        raise SetupError(
            f"cannot write {path} ({error.strerror}): choose a folder you may write to"
        ) from None

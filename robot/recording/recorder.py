"""Recorder of a run that never makes the control loop wait.

A separate process writes the file (gazerig.robot.recording.writer_process). The loop sends it
ticks in batches and continues immediately. The process outlives this program until it has
closed the file.
"""

import os
import secrets
import shutil
from collections import deque
from collections.abc import Callable
from math import inf
from pathlib import Path

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing
from gazerig.drivers.process.passed_image import copy_image
from gazerig.drivers.types import BusHealth, Detections
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.tick import BodyRecord, MeasuredJoints, Tick
from gazerig.robot.loop.tick_stream import LIVE_S, SIMULATED_S, TickBatch, TickStream, encode
from gazerig.robot.recording import writer_process as writer
from gazerig.robot.recording.joint_recorder import JointRecorder
from gazerig.robot.recording.run_format import Health
from gazerig.robot.recording.run_info import RunEnd, RunInfo
from gazerig.robot.recording.writer_client import WriterClient

_HEALTH_S = 1.0
_EARLY_S = 1e-3  # a frame may be this early, as times are rounded


class FramePicker:
    """A selector of frames at a given rate.

    Args:
        rate_hz: Rate of the selected frames, 0 for none.
    """

    def __init__(self, rate_hz: float) -> None:
        self._every_s = 1.0 / rate_hz if rate_hz > 0.0 else inf
        self._due_s = -inf
        self._number = 0

    def is_due(self, found: Detections | None) -> bool:
        """Return whether the frame is new and due."""
        if found is None or found.number == self._number:
            return False
        self._number = found.number
        if found.captured_s < self._due_s - _EARLY_S or self._every_s == inf:
            return False
        if found.image is None:  # checked last, as reading the image may copy it
            return False
        # A late frame does not delay those that follow.
        late_s = found.captured_s - self._due_s
        began_s = self._due_s if late_s < self._every_s else found.captured_s
        self._due_s = began_s + self._every_s
        return True


class Recorder:
    """A recording of one run, fed by the control loop.

    Attributes:
        lost: Number of ticks that were not recorded.
        stream: Stream of the ticks to other processes; further receivers may be added.
    """

    def __init__(
        self,
        path: Path,
        info: RunInfo,
        over: bool = False,
        patient: bool = False,
        urdf: str = "",
    ) -> None:
        """Prepare a recording without creating the file.

        Args:
            path: The file.
            info: Settings of the run.
            over: Overwrite an existing file.
            patient: Whether to wait for a slow writer, as in simulated time.
            urdf: Description of the rig for viewers; "" for none.
        """
        self._path, self._target = path, Path(os.path.realpath(path))
        self._info, self._urdf = info, urdf
        self._health: Callable[[], BusHealth] = lambda: BusHealth(0, 0, {})
        self._over = over
        self._link = WriterClient(patient)
        self._frames = FramePicker(info.pictures_hz)
        self._body_records: list[BodyRecord] = []
        self._messages: deque[str] = deque()
        self.stream = TickStream(self._messages.append, SIMULATED_S if patient else LIVE_S)
        self.stream.sinks.add("the recording", self._take)
        self._last_s: float | None = None
        self._seconds: float | None = None
        self._checked_s = -inf
        self._temporary: Path | None = None
        self._opened = self._failure_reported = False
        self.lost = 0

    def open(self) -> None:
        """Create the file and start the process that writes it, without waiting.

        Raises:
            SetupError: The file exists or cannot be created.
        """
        if self._over and self._path.is_file():
            beside = f".{self._target.name[:80]}-{secrets.token_hex(4)}"
            self._temporary = self._target.with_name(beside)
        path, over = self._temporary or self._path, self._over
        refuse_existing(path, force=over)
        try:
            flags = os.O_WRONLY | os.O_CREAT | (os.O_TRUNC if over else os.O_EXCL)
            file_fd = os.open(path, flags, 0o644)
        except OSError as error:
            raise SetupError(
                f"cannot write {path} ({error.strerror}): choose a folder with write permission"
            ) from None
        self._opened = True
        try:
            self._link.open(file_fd)
        finally:
            os.close(file_fd)
        self._link.post(writer.BEGIN, encode((self._info, self._urdf)))

    def begin(self) -> None:
        """Replace an older recording; call it when the run has started.

        Raises:
            OSError: The replacement failed; the older recording stays.
        """
        if self._temporary is None:
            return
        shutil.copymode(self._target, self._temporary)
        os.replace(self._temporary, self._target)
        self._temporary = None

    def wrap_body(self, body: Body) -> Body:
        """Return a body that wraps a robot's body and records its readings."""
        self._health = body.bus.health
        return JointRecorder(body, self._body_records.append)

    def wrap_stop(self, stop: Callable[[float], str | None]) -> Callable[[float], str | None]:
        """Return a loop's ``stop`` that records the time since the loop started."""

        def record_time(seconds: float) -> str | None:
            self._seconds = seconds
            return stop(seconds)

        return record_time

    def record(self, tick: Tick) -> None:
        """Record a tick; called by the loop."""
        # The tick has its own joints.
        before = tuple(
            [
                one
                for one in self._body_records
                if not (isinstance(one, MeasuredJoints) and one.joints is tick.joints)
            ]
        )
        self._body_records.clear()
        dt_s = tick.t_s - self._last_s if self._last_s is not None else self._seconds or 0.0
        self._last_s = tick.t_s
        self.stream.append(tick, dt_s, before)
        if self._frames.is_due(tick.detections):
            self._post_frame(tick.detections)
        if tick.t_s - self._checked_s >= _HEALTH_S:
            self._checked_s = tick.t_s
            self.stream.flush()
            sent, received, errors = self._health()
            health = Health(sent, received, dict(errors), self.lost)
            self._link.post(writer.HEALTH, encode(health))
            self._link.listen()

    def _take(self, batch: TickBatch) -> bool:
        """Send ticks to the writer; return False if they are lost."""
        if not self._link.alive or self._link.failed:
            return True  # the failure is reported; no remaining receiver could miss a percept
        if self._link.post(writer.TICKS, batch.data):
            return True
        self.lost += batch.ticks
        return False

    def _post_frame(self, found: Detections | None) -> None:
        """Send the frame to the writer, after the ticks before it."""
        self.stream.flush()
        if found is None or found.image is None or self._link.failed:
            return
        try:
            image = copy_image(found.image)
        except OSError:  # no memory or no file descriptor: the run has priority
            return
        about = encode((found.captured_s, image.shape, image.dtype))
        self._link.post_image(about, image.fd, found.image.nbytes)

    def events(self) -> tuple[str, ...]:
        """Return once that the recording, or another receiver of its ticks, has stopped."""
        if self._messages:
            return (self._messages.popleft(),)
        if self._failure_reported or not self._link.failed:
            return ()
        self._failure_reported = True
        return (f"recording stopped ({self._link.failed}); the run continues without it",)

    def close(self, stopped_by: str = "", tx_sha256: str | None = None) -> str:
        """End the recording and wait for its file; return a summary of one line.

        Call it when the torque is off: on a slow disk it takes seconds. A run without a tick
        leaves no file.

        Args:
            stopped_by: Reason for the end of the run.
            tx_sha256: Hash of all bytes sent on an emulated bus.
        """
        self.stream.flush()
        self._link.drain()  # makes room for the record of the end
        end = RunEnd(stopped_by, self.lost, self._seconds, tx_sha256 or "")
        self._link.post(writer.END, encode(end))
        self._link.close()
        if self._last_s is None:
            if self._temporary is not None:
                self._temporary.unlink(missing_ok=True)
                return f"nothing was recorded: {self._path} is unchanged"
            # Otherwise it belongs to another program, or is a device.
            if self._opened and self._target.is_file():
                self._target.unlink()
            return f"nothing was recorded: {self._path} was not created"
        done = self._link.done
        if done is None:
            return f"recording in {self._path} is incomplete: {self._link.failed}"
        frames = f", {done.frames} frames" if done.frames else ""
        lost = f"; {self.lost} ticks were not recorded" if self.lost else ""
        size_mb = done.size / 1e6
        return f"{done.ticks} ticks{frames} ({size_mb:.1f} MB) recorded in {self._path}{lost}"

    @property
    def unwritten(self) -> Path | None:
        """Return the incomplete file, None if the recording is complete."""
        return self._path if self._opened and self._link.failed else None

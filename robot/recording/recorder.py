"""Recorder of a run that never makes the control loop wait.

A separate process writes the file (gazerig.robot.recording.writer). A thread sends it the ticks
of the loop in batches. The process outlives this program until it has closed the file.
"""

import os
import select
import subprocess
from collections import deque
from collections.abc import Callable
from math import inf
from pathlib import Path

import msgspec

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing
from gazerig.drivers.process import child_process
from gazerig.drivers.process.work_queue import WorkQueue
from gazerig.drivers.types import Detections
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.tick import BodyRecord, MeasuredJoints, Tick
from gazerig.robot.loop.tick_stream import LIVE_S, SIMULATED_S, TickBatch, TickStream, encode
from gazerig.robot.recording import writer
from gazerig.robot.recording.body_playback import JointRecorder
from gazerig.robot.recording.run_info import RunEnd, RunInfo

QUEUE_BYTES = 64_000_000
"""Limit of the queue: some minutes of a run; frames get half of it, half a minute of a webcam's."""
_DIED = "its writer has died"
_TIMEOUT_S = 15.0
_EARLY_S = 1e-3  # a frame may be this early, as times are rounded


class WriterLink:
    """The process that writes a recording, and the queue of its messages.

    A thread sends the messages, so that no call waits for the process.

    Args:
        file_fd: Descriptor of the file to write to.
        patient: Whether to wait for a slow writer.

    Attributes:
        process: The process.
        failed: Reason why nothing more is written, or "".
        closed: Report of the closed file, None before.
    """

    def __init__(self, file_fd: int, patient: bool) -> None:
        self._patient = patient
        self._queue = WorkQueue("recording")
        self._posted_bytes = self._sent_bytes = 0
        self.failed = ""
        self.closed: writer.Report | None = None
        self.process = child_process.start(
            writer.__name__,
            str(file_fd),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            pass_fds=(file_fd,),
        )
        assert self.process.stdin is not None and self.process.stdout is not None
        self._input, self._output = self.process.stdin, self.process.stdout

    def post(self, kind: bytes, body: bytes, pixels: bytes = b"") -> bool:
        """Queue a message; return False if it is lost.

        Each message wakes the writer, which takes the loop longer than creating the message. So one
        large message is better than several small ones.
        """
        most = QUEUE_BYTES // 2 if kind == writer.FRAME else QUEUE_BYTES
        if self.failed or self._posted_bytes - self._sent_bytes > most:
            return False
        self._posted_bytes += len(body) + len(pixels)
        self._queue.add(lambda: self._send(kind, body, pixels))
        if self._patient:
            self.drain()
        return True

    def drain(self) -> None:
        """Wait until the writer has accepted everything, with a timeout."""
        if not self.failed and not self._queue.wait_idle(_TIMEOUT_S):
            self.failed = "its writer does not respond"

    def listen(self, timeout_s: float = 0.0) -> None:
        """Receive a report of the writer, if there is one."""
        if self.closed is not None or not select.select([self._output], [], [], timeout_s)[0]:
            return
        line = self._output.readline()
        report = msgspec.json.decode(line, type=writer.Report) if line else writer.Report(_DIED)
        if report.failed:
            self.failed = self.failed or report.failed
        else:
            self.closed = report

    def close(self) -> None:
        """End the recording, and wait until the writer has closed the file."""
        self.drain()
        if not self.failed:
            self._input.close()
            self.listen(_TIMEOUT_S)
        if self.closed is None:
            self.failed = self.failed or "its writer does not end"
            self.process.kill()
        self.process.wait()
        self._output.close()

    def _send(self, kind: bytes, body: bytes, pixels: bytes) -> None:
        """Send a message; called by the queue's thread."""
        try:
            for part in (writer.PREFIX.pack(kind, len(body), len(pixels)), body, pixels):
                self._input.write(part)
            self._input.flush()
        except (OSError, ValueError):  # it has ended: listen gets its reason
            return
        self._sent_bytes += len(body) + len(pixels)


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
        keeps_pace = found.captured_s - self._due_s < self._every_s
        self._due_s = (self._due_s if keeps_pace else found.captured_s) + self._every_s
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
        self._path = path
        self._info, self._urdf = info, urdf
        self._over = over
        self._patient = patient
        self._link: WriterLink | None = None
        self._frames = FramePicker(info.pictures_hz)
        self._body_records: list[BodyRecord] = []
        self._messages: deque[str] = deque()
        self.stream = TickStream(self._messages.append, SIMULATED_S if patient else LIVE_S)
        self.stream.sinks.add("the recording", self._take)
        self._last_s: float | None = None
        self._seconds: float | None = None
        self._failure_reported = False
        self.lost = 0

    def open(self) -> None:
        """Create the file and start the process that writes it, without waiting.

        Raises:
            SetupError: The file exists or cannot be created.
        """
        path, over = self._path, self._over
        refuse_existing(path, force=over)
        try:
            flags = os.O_WRONLY | os.O_CREAT | (os.O_TRUNC if over else os.O_EXCL)
            file_fd = os.open(path, flags, 0o644)
        except OSError as error:
            raise SetupError(
                f"cannot write {path} ({error.strerror}): choose a folder with write permission"
            ) from None
        try:
            self._link = WriterLink(file_fd, self._patient)
        finally:
            os.close(file_fd)
        self._link.post(writer.BEGIN, encode((self._info, self._urdf)))

    def wrap_body(self, body: Body) -> Body:
        """Return a body that wraps a robot's body and records its readings."""
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

    def _take(self, batch: TickBatch) -> bool:
        """Send ticks to the writer; return False if they are lost."""
        if self._link is not None:
            self._link.listen()
        if self._link is None or self._link.failed:
            return True  # the failure is reported; no remaining receiver could miss a percept
        if self._link.post(writer.TICKS, batch.data):
            return True
        self.lost += batch.ticks
        return False

    def _post_frame(self, found: Detections | None) -> None:
        """Send the frame to the writer, after the ticks before it."""
        self.stream.flush()
        if self._link is not None and found is not None and found.image is not None:
            frame = encode(writer.Frame(found.captured_s, found.image.shape))
            self._link.post(writer.FRAME, frame, found.image.tobytes())

    def events(self) -> tuple[str, ...]:
        """Return once that the recording, or another receiver of its ticks, has stopped."""
        if self._messages:
            return (self._messages.popleft(),)
        if self._failure_reported or self._link is None or not self._link.failed:
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
        if self._link is not None:
            self._link.drain()  # makes room for the record of the end
            end = RunEnd(stopped_by, self.lost, self._seconds, tx_sha256 or "")
            self._link.post(writer.END, encode(end))
            self._link.close()
        if self._link is None or self._last_s is None:
            # Otherwise it belongs to another program, or is a device.
            if self._link is not None and self._path.is_file():
                self._path.unlink()
            return f"nothing was recorded: {self._path} was not created"
        closed = self._link.closed
        if closed is None:
            return f"recording in {self._path} is incomplete: {self._link.failed}"
        frames = f", {closed.frames} frames" if closed.frames else ""
        lost = f"; {self.lost} ticks were not recorded" if self.lost else ""
        size_mb = self._path.stat().st_size / 1e6
        return f"{closed.ticks} ticks{frames} ({size_mb:.1f} MB) recorded in {self._path}{lost}"

    @property
    def unwritten(self) -> Path | None:
        """Return the incomplete file, None if the recording is complete."""
        return self._path if self._link is not None and self._link.failed else None

"""Detection in a separate process, which can neither delay nor end the control loop.

Python runs one thread of a process at a time, so a face detector would sometimes delay a loop in
the same process by milliseconds; and on few cores the loop's process needs priority. Detections
return through a pipe, frames through shared memory, from which they are copied on request. A
process that crashes, or is blocked in a camera's driver, is restarted while the loop continues
without frames: the last detections stay, and their age shows the loss.
"""

import multiprocessing
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Literal, NamedTuple

from gazerig.drivers.camera.capture_loop import BACK, LOST
from gazerig.drivers.camera.params import RECOVERY, CameraRecovery
from gazerig.drivers.camera.shared_frames import SharedDetections, SlotReader
from gazerig.drivers.camera.worker import (
    LONGEST_END_S,
    CameraParts,
    DetectionMessage,
    ProcessEnd,
    run,
)
from gazerig.drivers.errors import CameraError, SetupError
from gazerig.drivers.process.child_process import hide_script
from gazerig.drivers.types import SCENES_OF_A_PROCESS, Detections

FIRST_FRAME_S = 15.0
"""Longest time to the first frame: exposure settles, networks are loaded."""

BUSY_SHARE = 0.5
"""Share of a silence for which a process runs, or waits for a processor, if this computer is too
busy: one that waits for its camera sleeps."""

BUSY_RESTART_S = 30.0
"""Silence after which a process that still runs is restarted, which costs a busy computer more."""

BUSY = "this computer is too busy"
"""Words of events about pictures that are not processed in time."""

LOST_PERIODS, HUNG_PERIODS = 5.0, 15.0
"""Smallest number of usual frame periods before either: films and weak computers are slow."""

_SHARE = 0.2

Silence = Literal["", "lost", "hung"]


class FrameWatchdog:
    """Watchdog that compares the time since the last frame with the usual period.

    Args:
        recovery: Time limits.
        now_s: Start of the wait for the first frame, monotonic seconds.
    """

    def __init__(self, recovery: CameraRecovery, now_s: float) -> None:
        self._recovery = recovery
        self._last_s = now_s
        self._period_s: float | None = None
        self._first = True

    def record_frame(self, now_s: float) -> None:
        """Record a frame."""
        period_s = now_s - self._last_s
        if self._first:
            self._first = False
        elif self._period_s is None:
            self._period_s = period_s
        elif period_s < self._lost_after_s():
            self._period_s += _SHARE * (period_s - self._period_s)
        self._last_s = now_s

    def silent_s(self, now_s: float) -> float:
        """Return the time since the last frame."""
        return now_s - self._last_s

    def record_activity(self, now_s: float) -> None:
        """Record that the process is busy with other tasks than frames."""
        self._last_s = now_s

    def verdict(self, now_s: float) -> Silence:
        """Return "lost" if no frame has arrived for too long, "hung" if none is expected."""
        silent_s = self.silent_s(now_s)
        if self._first:
            return "hung" if silent_s >= FIRST_FRAME_S else ""
        lost_s = self._lost_after_s()
        hung_s = max(lost_s, self._recovery.restart_s, HUNG_PERIODS * (self._period_s or 0.0))
        return "hung" if silent_s >= hung_s else "lost" if silent_s >= lost_s else ""

    def _lost_after_s(self) -> float:
        return max(self._recovery.silent_s, LOST_PERIODS * (self._period_s or 0.0))


class ProcessorDemand:
    """Demand of a silent process for a processor.

    Args:
        read_s: Returns the time for which the process has run or waited for a processor; None if
            that is unknown.
    """

    def __init__(self, read_s: Callable[[], float | None]) -> None:
        self._read_s = read_s
        self._begin: tuple[float, float] | None = None

    def forget(self) -> None:
        """Begin anew with the next call, after a frame."""
        self._begin = None

    def is_busy(self, now_s: float) -> bool:
        """Return whether the process has wanted to run for most of its silence."""
        wanted_s = self._read_s()
        if wanted_s is None:
            return False
        if self._begin is None:
            self._begin = now_s, wanted_s
        began_s, before_s = self._begin
        return now_s > began_s and wanted_s - before_s >= BUSY_SHARE * (now_s - began_s)


def wanted_s(pid: int | None) -> float | None:
    """Return the time for which a process's main thread has run or waited for a processor.

    The result is None except on Linux, and if the process has ended.
    """
    try:
        run_ns, waited_ns = Path(f"/proc/{pid}/schedstat").read_text("ascii").split()[:2]
        return 1e-9 * (int(run_ns) + int(waited_ns))
    except (OSError, ValueError):
        return None


_LONGEST_START_S = 60.0
_POLL_S = 0.1
_RELIEF = "close other programs, or lower detector.work_width_px"
_AGAIN = "pictures are processed again"
_STABLE_S = 10.0
"""Lifetime after which a process counts as stable: its next end is reported and it is restarted
quickly."""
_MOST_EVENTS = 100
_BLOB_IDS = 1_000_000
"""Ids of things reserved for each process; the next process starts above them."""


class _End(NamedTuple):
    """Reason why a process delivers no more frames; final: no other one is started."""

    reason: str
    final: bool = False


class CameraProcess:
    """A camera, or a film paced by the real clock, watched from another process.

    It has the methods of a camera thread. While a lost source is reopened the last detections stay,
    and their age shows the loss.

    Args:
        parts: Factories of source and detectors; nothing starts yet.
        now_s: The host's monotonic clock, picklable; all processes share its zero.
        recovery: Times of reopening a lost camera.
        before: Number of earlier camera processes of the same loop; the scenes of this one differ
            from theirs.

    frames, frames_with_face: counts of analysed frames since open
    """

    def __init__(
        self,
        parts: CameraParts,
        now_s: Callable[[], float],
        recovery: CameraRecovery = RECOVERY,
        before: int = 0,
    ) -> None:
        self._parts = parts
        self._now_s, self._before = now_s, before
        self._recovery = recovery
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._thread: threading.Thread | None = None
        self._newest: Detections | None = None
        self._failure = ""
        self._closing = threading.Event()
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self._forget()

    def _forget(self) -> None:
        """Reset the state to frame 1."""
        self.frames = self.frames_with_face = 0
        self._counted = self._number = 0
        self._starts = self._before
        self._lost_s: float | None = None
        self._back_s = 0.0
        self._losses = 0  # losses without a stable period between them
        self._owes_back = False
        self._over = BACK

    def open(self) -> None:
        """Start the process and wait until its source is open.

        Raises:
            CameraError: the source cannot be opened, or is open already.
            SetupError: the detector cannot be created.
        """
        if self._process is not None:
            raise CameraError(
                "the camera process is already running: close() it before opening it again"
            )
        self._newest, self._failure = None, ""
        self._closing.clear()
        self._events.clear()
        self._forget()
        error = self._start()
        if error is not None:
            self.close()
            raise error
        self._thread = threading.Thread(target=self._supervise, name="camera", daemon=True)
        self._thread.start()

    def latest(self, now_s: float) -> Detections | None:
        """Return the detections of the newest frame, or None before the first.

        Raises:
            CameraError: the source has been lost for longer than ``give_up_s``.
        """
        if self._failure:
            raise CameraError(self._failure)
        return self._newest

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        messages = []
        while self._events:
            messages.append(self._events.popleft())
        return tuple(messages)

    def close(self) -> None:
        """End the process; safe to call twice."""
        self._closing.set()
        if self._pipe is not None:
            with suppress(OSError):  # it may have ended already
                self._pipe.send("stop")
        if self._thread is not None:
            self._thread.join()
        self._end(LONGEST_END_S)
        self._thread = None

    # --- a single process

    def _start(self) -> SetupError | None:
        """Start a process and wait for its first message; return its error, if any."""
        context = multiprocessing.get_context("spawn")
        pipe, theirs = context.Pipe()
        process = context.Process(
            target=run,
            args=(theirs, self._parts, self._now_s, self._recovery),
            name="camera",
            daemon=True,
        )
        with hide_script():
            process.start()
        theirs.close()
        self._process, self._pipe = process, pipe
        self._starts += 1
        end_s = self._now_s() + _LONGEST_START_S
        try:
            while not pipe.poll(_POLL_S):
                if self._closing.is_set() or self._now_s() >= end_s:
                    return _no_reply()
            message = pipe.recv()
        except (EOFError, OSError):
            return _no_reply()
        return message if isinstance(message, SetupError) else None

    def _end(self, timeout_s: float) -> None:
        """End the process, by force if it does not end in time; safe to call twice."""
        process, pipe = self._process, self._pipe
        if process is None or pipe is None:
            return
        process.join(timeout_s)
        if process.is_alive():
            process.kill()
            process.join()
        self._process = self._pipe = None
        pipe.close()

    # --- successive processes, in a thread

    def _supervise(self) -> None:
        """Receive results of a process and restart it when it ends, until the time limit."""
        wait_s = self._recovery.retry_s
        while not self._closing.is_set():
            began_s = self._now_s()
            end = self._receive()
            if self._closing.is_set():
                return
            if self._now_s() - began_s >= _STABLE_S:
                wait_s = self._recovery.retry_s
            while not self._closing.is_set():
                if self._lost_s is None:
                    self._lose(f"({end.reason})", "starting its process again")
                gone_s = self._now_s() - (self._lost_s or 0.0)
                if end.final or gone_s >= self._recovery.give_up_s:
                    self._failure = end.reason
                    return
                self._end(0.0)
                if self._closing.wait(wait_s):
                    return
                wait_s = min(2.0 * wait_s, self._recovery.longest_retry_s)
                error = self._start()
                if error is None:
                    break
                end = _End(str(error))

    def _lose(self, reason: str, remedy: str, fault: str = LOST, over: str = BACK) -> None:
        """Record that no frames arrive; losses in quick succession are reported once.

        fault, over: first words of the events about the loss and its end
        """
        self._over = over
        self._lost_s = self._now_s()
        self._losses += 1
        if self._recovery.give_up_s > 0.0 and self._losses == 1:
            self._owes_back = True
            self._events.append(f"{fault} {reason}: {remedy}")
        elif self._losses == 2:
            self._events.append(f"{fault} again {reason}: further attempts are not reported")

    def _receive(self) -> _End:
        """Receive results of a process until it ends or hangs; return the reason."""
        pipe = self._pipe
        assert pipe is not None
        slots = SlotReader(), SlotReader()
        silence = FrameWatchdog(self._recovery, self._now_s())
        process = self._process
        demand = ProcessorDemand(partial(wanted_s, process.pid if process is not None else None))
        retrying = False  # the process itself keeps reopening a lost source
        self._counted = self._number
        try:
            while True:
                if not pipe.poll(_POLL_S):
                    if self._closing.is_set() and (process is None or not process.is_alive()):
                        return _End("closed")
                    busy = demand.is_busy(self._now_s())
                    if not retrying and self._is_hung(silence, busy):
                        return _End(BUSY if busy else "no new frame, and its process hangs")
                    continue
                message = pipe.recv()
                demand.forget()
                if isinstance(message, ProcessEnd):
                    return _End(message.reason, message.final)
                if isinstance(message, str):
                    retrying = message.startswith(LOST) or (
                        retrying and not message.startswith(BACK)
                    )
                    silence.record_activity(self._now_s())
                    self._events.append(message)
                else:
                    retrying = False
                    silence.record_frame(self._now_s())
                    self._publish(message, slots)
        except (EOFError, OSError):
            return _End("the camera process has ended")
        finally:
            for slot in slots:
                slot.forget()

    def _is_hung(self, silence: FrameWatchdog, busy: bool) -> bool:
        """Report a camera without new frames; return whether its process must be ended.

        busy: whether the process wants to run, so that no picture is processed in time
        """
        now_s = self._now_s()
        verdict, silent_s = silence.verdict(now_s), silence.silent_s(now_s)
        hung = verdict == "hung" and (not busy or silent_s >= BUSY_RESTART_S)
        if verdict and self._lost_s is None and busy:
            self._lose(
                f"for the camera: no picture processed for {silent_s:.1f} s", _RELIEF, BUSY, _AGAIN
            )
        elif verdict and self._lost_s is None:
            self._lose("(no new frame)", "waiting for it")
        if hung and self._owes_back:
            what = "still no picture processed" if busy else "still no frame"
            self._events.append(f"{what}: starting the camera's process again")
        return hung

    def _publish(self, message: DetectionMessage, slots: tuple[SlotReader, SlotReader]) -> None:
        """Publish detections, which copy the frame from its slot on request."""
        found = message.detections
        self.frames += 1
        self.frames_with_face += bool(found.faces)
        self._number = self._counted + found.number
        if self._starts > 1:
            found = offset_ids(found, self._starts - 1)
        slots[0].record_memory(message.image)
        slots[1].record_memory(message.depth)
        found = replace(found, number=self._number)
        self._newest = SharedDetections(found, message.image, message.depth, slots)
        now_s = self._now_s()
        if self._lost_s is not None:
            if self._owes_back:
                self._events.append(f"{self._over} after {now_s - self._lost_s:.1f} s")
            self._lost_s, self._owes_back, self._back_s = None, False, now_s
        elif self._losses and now_s - self._back_s >= _STABLE_S:
            self._losses = 0


def offset_ids(found: Detections, starts: int) -> Detections:
    """Return detections with ids that differ from those of earlier processes.

    Its things and its scene are new: what was in front of the camera meanwhile is unknown, as is
    whether it is the same camera.

    Args:
        found: Detections of the process.
        starts: Number of earlier processes.
    """
    located, first = found.located, starts * _BLOB_IDS
    if located is not None:
        things = [
            thing
            if thing.detector_id is None
            else thing._replace(detector_id=first + thing.detector_id)
            for thing in located.things
        ]
        located = located._replace(things=tuple(things))
    blobs = tuple([replace(blob, id=first + blob.id) for blob in found.blobs])
    scene = starts * SCENES_OF_A_PROCESS + found.scene
    return replace(found, blobs=blobs, located=located, scene=scene)


def _no_reply() -> SetupError:
    return CameraError("the camera process did not start: start it again")

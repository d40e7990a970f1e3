"""Detection in a separate process, which can neither delay nor end the control loop.

Python runs one thread of a process at a time, so a face detector would sometimes delay a loop in
the same process by milliseconds; and on few cores the loop's process needs priority. Detections
return through a pipe, frames through shared memory. A process that crashes, or is blocked in a
camera's driver, is restarted while the loop continues without frames: the last detections stay,
and their age shows the loss.
"""

import multiprocessing
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from gazerig.drivers.camera.capture_loop import BACK, LOST, CameraParts
from gazerig.drivers.camera.params import RECOVERY, CameraRecovery
from gazerig.drivers.camera.shared_frames import SlotReader
from gazerig.drivers.camera.worker import (
    LONGEST_END_S,
    DetectionMessage,
    ProcessEnd,
    ProcessStart,
    run,
)
from gazerig.drivers.errors import CameraError, SetupError
from gazerig.drivers.process.child_process import hide_script
from gazerig.drivers.types import SCENES_OF_A_PROCESS, Detections

_FIRST_FRAME_S = 15.0
"""Longest time to the first frame: exposure settles, networks are loaded."""
_LOST_PERIODS, _HUNG_PERIODS, _SHARE = 5.0, 15.0, 0.2
"""Least numbers of usual frame periods before either; share of a new period in the usual one."""
_LONGEST_START_S = 60.0
_POLL_S = 0.1
_MOST_EVENTS = 100
_BLOB_IDS = 1_000_000
"""Ids of things reserved for each process; the next process starts above them."""


class CameraProcess:
    """A camera, or a film paced by the real clock, watched from another process.

    While a lost source is reopened the last detections stay, and their age shows the loss.

    Args:
        parts: Source and detectors; nothing starts yet.
        now_s: The host's monotonic clock, picklable; all processes share its zero.
        recovery: Times of reopening a lost camera.
        before: Number of earlier camera processes of the same loop; the scenes of this one differ
            from theirs.
        tell: Called with the time of each call of ``latest``, None for none.

    frames, frames_with_face: counts of analysed frames since open
    """

    def __init__(
        self,
        parts: CameraParts,
        now_s: Callable[[], float],
        recovery: CameraRecovery = RECOVERY,
        before: int = 0,
        tell: Callable[[float], None] | None = None,
    ) -> None:
        self._parts, self._now_s, self._recovery = parts, now_s, recovery
        self._before, self._tell = before, tell
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self._forget()

    def _forget(self) -> None:
        """Reset the state to frame 1."""
        self.frames = self.frames_with_face = 0
        self._newest: Detections | None = None
        self._failure = ""
        self._number, self._starts, self._is_file = 0, self._before, False
        self._lost_s: float | None = None

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
        if self._tell is not None:
            self._tell(now_s)
        if self._failure:
            raise CameraError(self._failure)
        return self._newest

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return tuple([self._events.popleft() for _ in range(len(self._events))])

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
        message: object = None
        with suppress(EOFError, OSError):
            while not self._closing.is_set() and self._now_s() < end_s:
                if pipe.poll(_POLL_S):
                    message = pipe.recv()
                    break
        if isinstance(message, ProcessStart):
            self._is_file = message.is_file
            return None
        if isinstance(message, SetupError):
            return message
        return CameraError("the camera process did not start: start it again")

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

    def _supervise(self) -> None:
        """Receive results of a process and restart it when it ends, until the time limit."""
        while not self._closing.is_set():
            end = self._receive()
            while not self._closing.is_set():
                lost_s = self._lose(f"{end.reason}): starting its process again")
                if end.final or self._now_s() - lost_s >= self._recovery.give_up_s:
                    self._failure = end.reason
                    return
                self._end(0.0)
                if self._closing.wait(self._recovery.retry_s):
                    return
                error = self._start()
                if error is None:
                    break
                end = ProcessEnd(str(error))

    def _lose(self, reason: str) -> float:
        """Record that no frames arrive; return since when."""
        if self._lost_s is None:
            self._lost_s = self._now_s()
            self._events.append(f"{LOST} ({reason}")
        return self._lost_s

    def _receive(self) -> ProcessEnd:
        """Receive results of a process until it ends or hangs; return the reason."""
        pipe, process = self._pipe, self._process
        assert pipe is not None and process is not None
        images, depths = SlotReader(), SlotReader()
        counted, is_first, is_retrying = self._number, True, False
        last_s, period_s = self._now_s(), 0.0
        try:
            while True:
                if not pipe.poll(_POLL_S):
                    if self._closing.is_set():
                        if not process.is_alive():
                            return ProcessEnd("closed")
                        continue
                    silent_s = self._now_s() - last_s
                    if self._is_hung(silent_s, period_s, is_first) and not is_retrying:
                        return ProcessEnd("no new frame, and its process hangs")
                    continue
                message = pipe.recv()
                now_s = self._now_s()
                if isinstance(message, ProcessEnd):
                    return message
                if isinstance(message, DetectionMessage):
                    if not is_first:
                        share = _SHARE if period_s else 1.0
                        period_s += share * (now_s - last_s - period_s)
                    is_first = is_retrying = False
                    self._publish(message, counted, images, depths)
                else:
                    # The process itself keeps reopening a lost source.
                    is_retrying = message.startswith(LOST) or (
                        is_retrying and not message.startswith(BACK)
                    )
                    self._events.append(message)
                last_s = now_s
        except (EOFError, OSError):
            return ProcessEnd("the camera process has ended")
        finally:
            images.close()
            depths.close()

    def _is_hung(self, silent_s: float, period_s: float, is_first: bool) -> bool:
        """Report a camera without new frames; return whether its process must be ended."""
        if is_first:
            return silent_s >= _FIRST_FRAME_S
        if self._is_file:  # a film may pause, and does not hang
            return False
        if silent_s >= max(self._recovery.silent_s, _LOST_PERIODS * period_s):
            self._lose("no new frame): waiting for it")
        return silent_s >= max(self._recovery.restart_s, _HUNG_PERIODS * period_s)

    def _publish(
        self, message: DetectionMessage, counted: int, images: SlotReader, depths: SlotReader
    ) -> None:
        """Publish detections with their frame."""
        found = message.detections
        self.frames += 1
        self.frames_with_face += bool(found.faces)
        self._number = counted + found.number
        if self._starts > 1:
            found = offset_ids(found, self._starts - 1)
        self._newest = replace(
            found,
            number=self._number,
            image=None if message.image is None else images.take(message.image),
            depth_m=None if message.depth is None else depths.take(message.depth),
        )
        if self._lost_s is not None:
            self._events.append(f"{BACK} after {self._now_s() - self._lost_s:.1f} s")
            self._lost_s = None


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

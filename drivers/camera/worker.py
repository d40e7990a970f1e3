"""Worker that keeps the newest detections of a camera, so that the control loop never waits.

Detection runs in a process of its own. Python runs one thread of a process at a time, so a face
detector would sometimes delay a loop in the same process by milliseconds; and on few cores the
loop's process needs priority. Detections return through a pipe, frames as memory that is passed
with them. A process that crashes, or is blocked in a camera's driver, is started again while the
loop continues without frames.

The newest detections are kept in one slot: they are an immutable value, and rebinding a Python name
is atomic. Frames that arrive while the detectors work are skipped.
"""

import multiprocessing
import os
import signal
import socket
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.reduction import recv_handle, send_handle
from typing import Any

from numpy.typing import NDArray

from gazerig.drivers.camera.capture_loop import (
    BACK,
    LOST,
    CameraParts,
    CaptureLoop,
    detection_error,
)
from gazerig.drivers.camera.params import RECOVERY, CameraRecovery
from gazerig.drivers.errors import CameraError, SetupError
from gazerig.drivers.process.child_process import hide_script
from gazerig.drivers.process.passed_image import PassedImage, copy_image, take_image
from gazerig.drivers.process.priority import lower_priority
from gazerig.drivers.types import SCENES_OF_A_PROCESS, Detections

LONGEST_END_S = 12.0
"""Time after which a stopped or orphaned process ends, even if it is blocked."""
_NICE = 10  # lower priority than the loop
_LONGEST_START_S = 60.0
_FIRST_FRAME_S = 15.0
"""Longest time to the first frame: exposure settles, networks are loaded."""
_POLL_S = 0.1
# Bytes of messages that wait in the pipe: if the loop is suspended, few frames wait in memory.
_WAITING_BYTES = 1 << 14


class CaptureProcess:
    """The methods of ``CaptureLoop``, executed in another process.

    Args:
        parts: Source and detectors; nothing starts yet.
        now_s: The host's monotonic clock, picklable; all processes share its zero.
        recovery: Times of reopening a lost source.
        report: Called with each event as one line, immediately.
    """

    def __init__(
        self,
        parts: CameraParts,
        now_s: Callable[[], float],
        recovery: CameraRecovery,
        report: Callable[[str], None],
    ) -> None:
        self._parts, self._now_s, self._recovery = parts, now_s, recovery
        self._report = report
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._is_retrying = False

    def open(self) -> None:
        """Start the process and wait until its source is open.

        Raises:
            CameraError: the source cannot be opened.
            SetupError: the detector cannot be created.
        """
        self._starts, self._number = self._parts.before, 0
        self._lost_s: float | None = None
        self._start()

    def next_detections(self, stop: threading.Event) -> Detections | None:
        """Return the detections in the next frame, None if ``stop`` was set meanwhile.

        Raises:
            CameraError: the source is lost permanently, or its process cannot be started again.
        """
        while not stop.is_set():
            pipe = self._pipe
            assert pipe is not None
            try:
                if not pipe.poll(_POLL_S):
                    self._judge_silence()
                    continue
                found = self._receive(pipe)
            except (EOFError, OSError):
                self._restart("the camera process has ended")
                continue
            if found is not None:
                return found
        return None

    def close(self, timeout_s: float = LONGEST_END_S) -> None:
        """End the process, by force if it does not end in time; safe to call twice."""
        process, pipe = self._process, self._pipe
        if process is None or pipe is None:
            return
        end_s = self._now_s() + timeout_s
        with suppress(OSError):  # it may have ended already
            pipe.send("stop")
        with suppress(EOFError, OSError, SetupError):  # what it still sends would block it
            while pipe.poll(max(0.0, end_s - self._now_s())):
                self._receive(pipe)
        process.join(max(0.0, end_s - self._now_s()))
        if process.is_alive():
            process.kill()
            process.join()
        pipe.close()
        self._process = self._pipe = None

    def _start(self) -> None:
        """Start a process and wait until its source is open.

        Raises:
            SetupError: sent by the process, or it did not start.
        """
        context = multiprocessing.get_context("spawn")
        pipe, theirs = context.Pipe()
        given = theirs, self._parts, self._now_s, self._recovery
        process = context.Process(target=run, args=given, daemon=True)
        with hide_script():
            process.start()
        theirs.close()
        self._process, self._pipe = process, pipe
        self._counted = self._number
        self._starts += 1
        message: object = CameraError("the camera process did not start: start it again")
        with suppress(EOFError, OSError):
            if pipe.poll(_LONGEST_START_S):
                message = pipe.recv()
        if isinstance(message, SetupError):
            self.close(0.0)
            raise message
        self._is_film, self._is_retrying = bool(message), False
        self._heard_s = self._now_s()

    def _judge_silence(self) -> None:
        """Report a camera without new frames, and restart a process that hangs."""
        silent_s = self._now_s() - self._heard_s
        is_first = self._number == self._counted
        # A film may pause; a process that reopens a lost source has reported that.
        if self._is_retrying or (self._is_film and not is_first):
            return
        if silent_s >= (_FIRST_FRAME_S if is_first else self._recovery.restart_s):
            self._restart("no new frame, and its process hangs")
        elif silent_s >= self._recovery.silent_s and not is_first:
            self._lose("no new frame): waiting for it")

    def _restart(self, reason: str) -> None:
        """Start another process.

        Raises:
            CameraError: the last one has delivered no frame either.
            SetupError: it cannot be started.
        """
        self.close(0.0)
        if self._number == self._counted:
            raise CameraError(f"{reason}: start it again")
        self._lose(f"{reason}): starting its process again")
        self._start()

    def _lose(self, reason: str) -> None:
        """Report once that no frames arrive."""
        if self._lost_s is None:
            self._lost_s = self._now_s()
            self._report(f"{LOST} ({reason}")

    def _receive(self, pipe: Connection) -> Detections | None:
        """Receive a message; return detections with their frame, None for an event.

        The scene is another one than that of earlier processes: what was in front of the camera
        meanwhile is unknown, as is whether it is the same camera.

        Raises:
            SetupError: sent by the process.
        """
        message = pipe.recv()
        self._heard_s = self._now_s()
        if isinstance(message, SetupError):
            raise message
        if isinstance(message, str):
            self._is_retrying = self._is_retrying or message.startswith(LOST)
            self._report(message)
            return None
        found: Detections
        found, image, depth = message
        self._number = self._counted + found.number
        self._is_retrying = False
        if self._lost_s is not None:
            self._report(f"{BACK} after {self._now_s() - self._lost_s:.1f} s")
            self._lost_s = None
        return replace(
            found,
            number=self._number,
            image=_receive_image(pipe, image),
            depth_m=_receive_image(pipe, depth),
            scene=(self._starts - 1) * SCENES_OF_A_PROCESS + found.scene,
        )


def run(
    pipe: Connection, parts: CameraParts, now_s: Callable[[], float], recovery: CameraRecovery
) -> None:
    """Run the process: open, detect and report, until it is stopped or the other side has ended.

    It sends whether the source is a film or a recording, then events and detections; or an error.
    """
    import cv2  # the control loop's process imports this module too, without OpenCV

    # Ctrl-C reaches all processes of a terminal; only the loop may end this one.
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    lower_priority(_NICE)
    # One core is left to the loop: if OpenCV uses all cores, the loop is later and no more frames
    # are analysed.
    cv2.setNumThreads(max(1, (os.cpu_count() or 1) - 1))
    try:
        camera = CaptureLoop(parts, now_s, recovery, pipe.send)
        camera.open()
    except SetupError as error:
        pipe.send(error)
        return
    from gazerig.drivers.camera.file_player import FilePlayer

    stop = threading.Event()
    with socket.fromfd(pipe.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as link:
        link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING_BYTES)
    pipe.send(isinstance(camera.source, FilePlayer))
    threading.Thread(target=_await_end, args=(pipe, stop), daemon=True).start()
    try:
        while (found := camera.next_detections(stop)) is not None:
            _send_detections(pipe, found)
    except OSError:  # the parent has ended
        pass
    except Exception as failure:
        pipe.send(detection_error(failure))
    finally:
        camera.close()


def _await_end(pipe: Connection, stop: threading.Event) -> None:
    """Wait for a stop request, or until the other side has ended."""
    with suppress(EOFError, OSError):
        pipe.recv()
    stop.set()
    # A thread that is blocked in a camera's driver would keep that camera busy forever.
    threading.Event().wait(LONGEST_END_S)
    os._exit(1)


def _send_detections(pipe: Connection, found: Detections) -> None:
    """Send detections, then the file descriptors of their image and depth."""
    passed = [
        None if array is None else copy_image(array) for array in (found.image, found.depth_m)
    ]
    pipe.send((replace(found, image=None, depth_m=None), *passed))
    for image in passed:
        if image is not None:
            send_handle(pipe, image.fd, None)
            os.close(image.fd)


def _receive_image(pipe: Connection, image: PassedImage | None) -> NDArray[Any] | None:
    return None if image is None else take_image(image._replace(fd=recv_handle(pipe)))


_MOST_EVENTS = 100


class CameraWorker:
    """A camera, or a film paced by the real clock, watched by a process or a thread of its own.

    While a lost source is reopened the last detections stay, and their age shows the loss.

    Args:
        parts: Source and detectors; nothing starts yet.
        now_s: The host's monotonic clock; for a process picklable, as all share its zero.
        recovery: Times of reopening a lost camera.
        in_thread: Whether the parts run in a thread of this process, for those of a program, which
            exist only there; otherwise they run in a process, which cannot delay the control loop.

    frames: count of analysed frames since open
    """

    def __init__(
        self,
        parts: CameraParts,
        now_s: Callable[[], float],
        recovery: CameraRecovery = RECOVERY,
        in_thread: bool = False,
    ) -> None:
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        make = CaptureLoop if in_thread else CaptureProcess
        self._frames: CaptureLoop | CaptureProcess = make(
            parts, now_s, recovery, self._events.append
        )
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._newest: Detections | None = None
        self._failure: BaseException | None = None
        self.frames = 0

    def open(self) -> None:
        """Open the source and start detection.

        Raises:
            CameraError: the source cannot be opened, or is open already.
            SetupError: the detector cannot be created.
        """
        if self._thread is not None:
            raise CameraError("the camera is already open: close() it before opening it again")
        self._events.clear()
        self._frames.open()
        self._stop.clear()
        self._newest, self._failure = None, None
        self.frames = 0
        self._thread = threading.Thread(target=self._watch, name="camera", daemon=True)
        self._thread.start()

    def latest(self, now_s: float) -> Detections | None:
        """Return the detections of the newest frame, or None before the first.

        Raises:
            CameraError: the source is lost permanently, or detection has failed.
        """
        if self._failure is not None:
            raise detection_error(self._failure) from self._failure
        return self._newest

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return tuple([self._events.popleft() for _ in range(len(self._events))])

    def close(self) -> None:
        """Stop detection and free the source; safe to call twice."""
        self._stop.set()
        if self._thread is not None:
            # A process that is blocked in a camera's driver is killed; a thread cannot be.
            self._thread.join(LONGEST_END_S + 1.0)
            if not self._thread.is_alive():
                self._thread = None

    def _watch(self) -> None:
        """Receive the detections of one frame after another until stopped."""
        try:
            while (found := self._frames.next_detections(self._stop)) is not None:
                self.frames += 1
                self._newest = found
        except BaseException as failure:  # raised to the loop by latest()
            self._failure = failure
        finally:
            # Freed by the thread that reads it, never while a frame is fetched.
            self._frames.close()

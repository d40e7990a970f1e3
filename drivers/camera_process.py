"""Pictures looked at in a process of its own: nothing of it can hold up the control loop.

Python runs one thread of a process at a time, so what finds faces would cost a loop in the
same process milliseconds now and then; and where processors are few, the loop's process is
to go first. What was found comes back through a pipe, pictures through shared memory.
"""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from select import select
from typing import NamedTuple

import cv2

from drivers.camera_look import Motion
from drivers.camera_params import CameraCareParams
from drivers.camera_slots import SlotReader, SlotWriter, Where
from drivers.camera_watch import CameraWatch, failed
from drivers.errors import CameraError, SetupError
from drivers.picture_source import PictureSource
from drivers.types import Detections, FaceDetector

_NICE = 10  # the loop goes first
_LONGEST_START_S = 60.0
_LONGEST_END_S = 12.0
_MOST_EVENTS = 100


class CameraParts(NamedTuple):
    """How to make the parts, in the process that uses them; all must be picklable.

    source, detector: functions without arguments; motion: the same, or None
    """

    source: Callable[[], PictureSource]
    detector: Callable[[], FaceDetector]
    motion: Callable[[], Motion] | None = None


class _Found(NamedTuple):
    """What the process tells of a picture."""

    detections: Detections  # without picture and depth
    picture: Where | None
    depth: Where | None


class _Retune(NamedTuple):
    """How to look from now on; None: as before. All must be picklable."""

    detector: Callable[[], FaceDetector] | None
    motion: Callable[[Motion | None], Motion | None] | None


class _Ended(NamedTuple):
    """Why the process ends."""

    reason: str


class CameraProcess:
    """A camera, or a film paced by the real clock, watched from another process.

    The same calls as a camera thread; while a lost source is tried again the last detections
    stay, and their age tells.

    pictures, pictures_with_face: counts of pictures looked at since open
    """

    def __init__(
        self,
        parts: CameraParts,
        now_s: Callable[[], float],
        care: CameraCareParams | None = None,
    ) -> None:
        """Take how to make what gives pictures and what finds things; nothing starts yet.

        now_s: the host's monotonic clock, picklable; all processes share its zero
        """
        self._parts = parts
        self._now_s = now_s
        self._care = care or CameraCareParams()
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._thread: threading.Thread | None = None
        self._newest: Detections | None = None
        self._failure = ""
        self._closing = False
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self.pictures = 0
        self.pictures_with_face = 0

    def open(self) -> None:
        """Start the process and wait until its source is open.

        Raises:
            drivers.errors.CameraError: the source cannot be opened, or is open already.
            drivers.errors.SetupError: the detector cannot be made.
        """
        if self._process is not None:
            raise CameraError("the camera process runs already: close() it before opening it anew")
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_run,
            args=(theirs, self._parts, self._now_s, self._care),
            name="camera",
            daemon=True,
        )
        self._newest, self._failure, self._closing = None, "", False
        self._events.clear()
        self.pictures = self.pictures_with_face = 0
        self._process.start()
        theirs.close()
        self._wait_until_open(self._pipe)
        self._thread = threading.Thread(
            target=self._receive, args=(self._pipe,), name="camera", daemon=True
        )
        self._thread.start()

    def latest(self, now_s: float) -> Detections | None:
        """Give what the newest picture showed, or None before the first.

        Raises:
            drivers.errors.CameraError: the source is gone for good, or the process has ended.
        """
        if self._failure:
            raise CameraError(self._failure)
        return self._newest

    def retune(
        self,
        detector: Callable[[], FaceDetector] | None,
        motion: Callable[[Motion | None], Motion | None] | None,
    ) -> bool:
        """Let the process look otherwise from one of the next pictures on.

        Never waits; tells whether the process has room for the word. A detector that cannot
        be made there is told of as an event, and the old one goes on.

        detector: makes another one; motion: gives what finds motion from what did; None: as is
        """
        if self._pipe is None or not select([], [self._pipe], [], 0.0)[1]:
            return False
        try:
            self._pipe.send(_Retune(detector, motion))
        except OSError:  # it has ended, which ``latest`` tells
            return False
        return True

    def events(self) -> tuple[str, ...]:
        """Say what has happened since the last call, one line each."""
        told = []
        while self._events:
            told.append(self._events.popleft())
        return tuple(told)

    def close(self) -> None:
        """End the process; safe to call twice."""
        process, pipe = self._process, self._pipe
        if process is None or pipe is None:
            return
        self._closing = True
        with suppress(OSError):  # it may have ended already
            pipe.send("stop")
        process.join(_LONGEST_END_S)
        if process.is_alive():
            process.kill()
            process.join()
        if self._thread is not None:
            self._thread.join()
        pipe.close()
        self._process = self._pipe = self._thread = None

    def _wait_until_open(self, pipe: Connection) -> None:
        """Wait for the first word of the process."""
        try:
            word = pipe.recv() if pipe.poll(_LONGEST_START_S) else _no_word()
        except (EOFError, OSError):
            word = _no_word()
        if word is not None:
            self.close()
            raise word

    def _receive(self, pipe: Connection) -> None:
        """Take what was found until the process ends."""
        slots = SlotReader(), SlotReader()
        try:
            while True:
                word = pipe.recv()
                if isinstance(word, _Ended):
                    self._failure = word.reason
                elif isinstance(word, str):
                    self._events.append(word)
                else:
                    self._note(word, slots)
        except (EOFError, OSError):
            if not self._closing and not self._failure:
                self._failure = (
                    "the process that looks at pictures has ended: start anew, and report it "
                    "if it comes back"
                )
        finally:
            for slot in slots:
                slot.forget()

    def _note(self, word: _Found, slots: tuple[SlotReader, SlotReader]) -> None:
        """Leave what was found in the slot, with the picture if it is still there."""
        self.pictures += 1
        self.pictures_with_face += bool(word.detections.faces)
        picture = slots[0].take(word.picture) if word.picture is not None else None
        depth = slots[1].take(word.depth) if word.depth is not None else None
        self._newest = replace(word.detections, picture=picture, depth_m=depth)


def _no_word() -> SetupError:
    return CameraError("the process that looks at pictures did not start: start anew")


def _run(
    pipe: Connection, parts: CameraParts, now_s: Callable[[], float], care: CameraCareParams
) -> None:
    """Be the process: open, look, tell, until told to stop or the other side is gone."""
    # Ctrl-C reaches all processes of a terminal; it is the loop's to end this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICE)
    # One processor stays the loop's: with all of them in OpenCV's hands the loop is later, and
    # no more pictures are looked at.
    cv2.setNumThreads(max(1, (os.cpu_count() or 1) - 1))
    try:
        motion = parts.motion() if parts.motion is not None else None
        camera = CameraWatch(parts.source(), parts.detector(), now_s, care, motion, pipe.send)
        camera.open()
    except SetupError as error:
        pipe.send(error)
        return
    stop = threading.Event()
    words: deque[_Retune] = deque()
    pipe.send(None)
    threading.Thread(target=_heed, args=(pipe, stop, words), daemon=True).start()
    slots = SlotWriter(), SlotWriter()
    try:
        while (found := camera.next(stop)) is not None:
            pipe.send(_told(found, slots))
            _retune(camera, words, pipe)
    except OSError:  # nobody listens any more
        pass
    except Exception as failure:
        pipe.send(_Ended(str(failed(failure))))
    finally:
        camera.close()
        for slot in slots:
            slot.close()


def _told(found: Detections, slots: tuple[SlotWriter, SlotWriter]) -> _Found:
    """Put picture and depth into shared memory, and the rest into words."""
    picture, depth = found.picture, found.depth_m
    return _Found(
        replace(found, picture=None, depth_m=None),
        slots[0].put(picture) if picture is not None else None,
        slots[1].put(depth) if depth is not None else None,
    )


def _heed(pipe: Connection, stop: threading.Event, words: deque[_Retune]) -> None:
    """Pass words on until the one to stop comes, or the other side is gone."""
    with suppress(EOFError, OSError):
        while isinstance(word := pipe.recv(), _Retune):
            words.append(word)
    stop.set()


def _retune(camera: CameraWatch, words: deque[_Retune], pipe: Connection) -> None:
    """Look otherwise, as asked for; of several detectors only the last is made."""
    detector: Callable[[], FaceDetector] | None = None
    while words:
        word = words.popleft()
        detector = word.detector or detector
        camera.retune(None, word.motion)
    if detector is None:
        return
    try:
        camera.retune(detector, None)
    except SetupError as error:
        pipe.send(f"the detector stays as it was: {error}")

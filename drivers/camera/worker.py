"""Main function of the camera's process (see ``process``)."""

import os
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import NamedTuple

from gazerig.drivers.camera.capture_loop import CameraParts, CaptureLoop, detection_error
from gazerig.drivers.camera.params import CameraRecovery
from gazerig.drivers.camera.shared_frames import SlotAddress, SlotWriter
from gazerig.drivers.errors import CameraError, SetupError
from gazerig.drivers.process.priority import lower_priority
from gazerig.drivers.types import Detections

NICE = 10  # lower priority than the loop
LONGEST_END_S = 12.0
"""Time after which a stopped or orphaned process ends, even if it is blocked."""


class DetectionMessage(NamedTuple):
    """Detections in one frame, and the address of the frame in shared memory."""

    detections: Detections  # without frame and depth
    image: SlotAddress | None
    depth: SlotAddress | None


class ProcessStart(NamedTuple):
    """Message that the source is open; is_file: its frames may be any time apart."""

    is_file: bool


class ProcessEnd(NamedTuple):
    """Reason for the end of the process.

    final: whether the time limit for reopening the camera has passed; otherwise a new process may
        succeed
    """

    reason: str
    final: bool = False


def run(
    pipe: Connection, parts: CameraParts, now_s: Callable[[], float], recovery: CameraRecovery
) -> None:
    """Run the process: open, detect and report, until it is stopped or the other side has ended."""
    import cv2  # the control loop's process imports this module too, without OpenCV

    # Ctrl-C reaches all processes of a terminal; only the loop may end this one.
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    lower_priority(NICE)
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
    pipe.send(ProcessStart(isinstance(camera.source, FilePlayer)))
    threading.Thread(target=_await_end, args=(pipe, stop), daemon=True).start()
    images, depths = SlotWriter(), SlotWriter()
    try:
        while (found := camera.next_detections(stop)) is not None:
            pipe.send(
                DetectionMessage(
                    replace(found, image=None, depth_m=None),
                    images.put(found.image) if found.image is not None else None,
                    depths.put(found.depth_m) if found.depth_m is not None else None,
                )
            )
    except OSError:  # the parent has ended
        pass
    except Exception as failure:
        pipe.send(ProcessEnd(str(detection_error(failure)), isinstance(failure, CameraError)))
    finally:
        camera.close()
        images.close()
        depths.close()


def _await_end(pipe: Connection, stop: threading.Event) -> None:
    """Wait for a stop request, or until the other side has ended."""
    with suppress(EOFError, OSError):
        pipe.recv()
    stop.set()
    # A thread that is blocked in a camera's driver would keep that camera busy forever.
    threading.Event().wait(LONGEST_END_S)
    os._exit(1)

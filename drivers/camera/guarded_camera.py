"""A camera of another package that can neither delay nor end the control loop."""

import threading
from collections.abc import Sequence
from math import isfinite
from typing import Any

from gazerig.drivers.camera.capture_loop import OffFrameReport
from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.plugins import describe_error
from gazerig.drivers.process.bounded_call import BoundedCall
from gazerig.drivers.types import Camera, DetectedFace, Detections, MovingBlob

LONGEST_S = 0.001
"""Longest wait for the camera in a tick; after that the loop uses the last detections."""

OPEN_S, OPEN_PROCESS_S = 20.0, 70.0
"""Longest time to open a camera, and to open a process that reads a camera with its own limit."""

CLOSE_S, CLOSE_PROCESS_S = 2.0, 15.0
"""Longest times to close them."""

SILENT_S = 1.0
"""Duration after which a call is reported."""


class GuardedCamera:
    """A camera that can only stop the rig's vision by a failure; implements ``Camera``.

    Its results are checked: anything other than detections, or a number that is not finite, is a
    failure. After a failure there are no more frames, and the rig continues without them.

    Args:
        camera: Camera of another package, or a process that reads another package's frames.
        label: Name of the camera in messages.
        longest_s: Longest wait in a tick, real seconds; None: to the end of the call, for simulated
            time.
        close_s: Longest wait for its closing, real seconds.
        open_s: Longest wait for its opening, real seconds.
    """

    def __init__(
        self,
        camera: Camera,
        label: str,
        longest_s: float | None = LONGEST_S,
        close_s: float = CLOSE_S,
        open_s: float = OPEN_S,
    ) -> None:
        self.camera = camera
        self._label = label
        self._longest_s, self._close_s, self._open_s = longest_s, close_s, open_s
        self._call = BoundedCall(label, longest_s)
        self._log = EventLog()
        self._off_frame = OffFrameReport()
        self._newest: Detections | None = None
        self._checked: object = None
        self._failed = False
        self._asked_s: float | None = None
        self._late = False

    def open(self) -> None:
        """Open the camera.

        Raises:
            SetupError: it cannot be opened.
            PluginError: the camera raises any other error.
        """
        self._call.close()
        self._call = BoundedCall(self._label, self._longest_s)
        given_up = threading.Event()

        def open_camera() -> None:
            self.camera.open()
            if given_up.is_set():
                self.camera.close()

        outcome = self._call.call_in_order(open_camera, self._open_s)
        if outcome is None:
            given_up.set()
            self._call.close()
            raise PluginError(f"{self._label} has not opened within {self._open_s:g} s")
        if isinstance(outcome.error, SetupError):
            raise outcome.error
        if outcome.error is not None:
            error = outcome.error
            raise PluginError(f"{self._label} cannot be opened: {outcome.error_text}") from error
        self._newest, self._failed, self._asked_s, self._late = None, False, None, False

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections, None before the first and after a failure."""
        if self._failed:
            return None

        def read_camera() -> tuple[Detections | None, str, tuple[str, ...]]:
            found = self.camera.latest(now_s)
            wrong = "" if found is self._checked else detections_fault(found)
            return found, wrong, tuple(map(str, self.camera.events()))

        outcome = self._call(read_camera)
        if outcome is None:
            if self._asked_s is None:
                self._asked_s = now_s
            elif not self._late and now_s - self._asked_s > SILENT_S:
                self._late = True
                self._log.add(f"{self._label} has not answered for {SILENT_S:g} s: no new frames")
            return self._newest
        if self._late:
            self._log.add(f"{self._label} answers again")
        self._asked_s, self._late = None, False
        if outcome.error is not None:
            self._fail(f"failed ({outcome.error_text})")
            return None
        found, wrong, events = outcome.value
        for line in events:
            self._log.add(line)
        if found is not self._checked:
            if wrong:
                self._fail(f"returned {wrong}")
                return None
            self._newest = self._checked = found
            if found is not None:
                size_px = found.width_px, found.height_px
                for line in self._off_frame.report(found.faces, *size_px):
                    self._log.add(f"{self._label}: {line}")
        return self._newest

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return self._log.drain()

    def close(self) -> None:
        """Close the camera without raising; safe to call twice."""
        self._call.close()
        closing = BoundedCall(f"close of {self._label}", self._close_s)
        outcome = closing(self.camera.close)
        closing.close()
        if outcome is None:
            self._log.add(f"{self._label} does not close: it is abandoned")
        elif outcome.error is not None:
            self._log.add(f"{self._label} failed while it was closed ({outcome.error_text})")

    def _fail(self, why: str) -> None:
        self._failed, self._newest = True, None
        self._call.close()
        self._log.add(f"{self._label} {why}: the rig continues without frames")


def detections_fault(found: Any) -> str:
    """Return the fault in the detections of a camera, "" for none."""
    try:
        return "" if found is None else _detections_fault(found)
    except Exception as error:  # its attributes may have any type
        return f"detections that cannot be read ({describe_error(error)})"


def _detections_fault(found: Any) -> str:
    if not isinstance(found, Detections):
        return f"a {type(found).__name__}, wanted Detections or None"
    if not _is_finite(found.captured_s) or not isinstance(found.number, int):
        return f"captured_s {found.captured_s!r} and number {found.number!r}"
    if not (_is_positive_int(found.width_px) and _is_positive_int(found.height_px)):
        return f"a frame of {found.width_px!r} x {found.height_px!r}"
    if found.turn is not None and not found.turn.is_rotation:
        return "a camera turn that is not a rotation"
    if not isinstance(found.faces, Sequence) or not isinstance(found.blobs, Sequence):
        raise TypeError("faces and blobs must be tuples")
    if not all(isinstance(line, str) for line in found.conditions):
        return f"conditions that are not lines of text: {found.conditions!r}"
    for person in found.people:
        if not (all(map(_is_finite, (*person.head_px, person.trunk_px))) and person.trunk_px > 0.0):
            return f"a person at {person.head_px!r} of {person.trunk_px!r} px"
    for palm in found.palms or ():
        if not (all(map(_is_finite, (*palm.centre_px, palm.size_px))) and palm.size_px > 0.0):
            return f"a palm at {palm.centre_px!r} of {palm.size_px!r} px"
    for face in found.faces:
        if wrong := face_fault(face):
            return wrong
    for blob in found.blobs:
        if not isinstance(blob, MovingBlob) or not all(
            map(_is_finite, (*blob.p_camera_m, blob.radius_m))
        ):
            return f"a thing {str(blob)[:60]!r}"
    return ""


def face_fault(face: Any) -> str:
    """Return the fault in a face, "" for none."""
    if not isinstance(face, DetectedFace):
        return f"a {type(face).__name__} as a face, wanted a DetectedFace"
    if (
        len(face.box_px) != 4
        or not all(map(_is_finite, face.box_px))
        or not _is_finite(face.confidence)
    ):
        return f"a face with the box {face.box_px!r} and confidence {face.confidence!r}"
    shape = getattr(face.landmarks_px, "shape", None)
    if shape != (5, 2) or not all(map(_is_finite, face.landmarks_px.ravel().tolist())):
        return "a face whose landmarks are not five finite points"
    gaze = face.gaze_camera
    if gaze is not None and (len(gaze) != 3 or not all(map(_is_finite, gaze)) or not any(gaze)):
        return f"a face with the gaze {gaze!r}, wanted a direction (x, y, z) or None"
    return ""


def _is_finite(value: Any) -> bool:
    try:
        return isfinite(value)
    except TypeError:
        return False


def _is_positive_int(value: Any) -> bool:
    return isinstance(value, int) and value > 0

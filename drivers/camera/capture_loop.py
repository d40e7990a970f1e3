"""Detection frame by frame, with reopening of a lost camera."""

import threading
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from math import isfinite
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

from gazerig.drivers.camera.orientation import AS_DELIVERED, FrameOrientation
from gazerig.drivers.camera.params import CameraRecovery
from gazerig.drivers.camera.source import FrameSource, Shot, to_bgr
from gazerig.drivers.errors import CameraError
from gazerig.drivers.plugins import describe_error, plugin_error
from gazerig.drivers.types import DetectedFace, Detections, FaceDetector, LocatedFrame, MovingBlob

if TYPE_CHECKING:
    from gazerig.drivers.camera.recorder import CameraRecorder

Motion = Callable[[Shot], tuple[MovingBlob, ...]]
"""Finds motion from one frame to the next."""
Locate = Callable[[Detections], LocatedFrame]
"""Locates detections in the camera's axes; picklable. A method ``fault``, if present, returns in
one line why its calibration is not used for a frame, "" if it is used. Each line is reported once.
"""


class CameraParts(NamedTuple):
    """Parts of a camera, created where they are used; all must be picklable for a process.

    source, detector: functions without arguments; motion: also a function without arguments, or
        None
    locate: locates detections in the camera's axes; None: their consumer does
    orientation: turns frames upright
    record: path of a new file for the frames as the source delivers them, None for none
    before: number of earlier camera processes of the same control loop; the scenes of this one
        differ from theirs
    """

    source: Callable[[], FrameSource]
    detector: Callable[[], FaceDetector]
    motion: Callable[[], Motion | None] | None = None
    locate: Locate | None = None
    orientation: FrameOrientation = AS_DELIVERED
    record: Path | None = None
    before: int = 0


def is_off_frame(face: DetectedFace, width_px: int, height_px: int) -> bool:
    """Return whether a face is outside the frame by its landmarks.

    A network may guess points of a face cut by the edge; a face whose centre is outside is not in
    view. If a face or a landmark is farther outside than the size of the face, the detector is
    wrong, usually because its pixels belong to another frame size.
    """
    points = face.landmarks_px.tolist()
    if not points or not isfinite(sum(map(sum, points))):
        return False  # the consumer reports points that are missing or not numbers
    columns = face.landmarks_px.T.tolist()
    points.append([sum(column) / len(column) for column in columns])
    *outside_px, centre_px = [
        max(-x, x - width_px + 1, -y, y - height_px + 1) - 0.5 for x, y in points
    ]
    return bool(centre_px > 0.0 or max(outside_px) > max(max(a) - min(a) for a in columns))


class FrameAnalyzer:
    """Runner of the detectors.

    Args:
        detector: Finds faces.
        motion: Finds motion; None for none.
        locate: Locates faces and things; None: their consumer does.
        orientation: Turns frames upright.
        turns_film: Whether frames whose faces are turned are turned upright; otherwise that is
            reported as a condition of the camera.
    """

    def __init__(
        self,
        detector: FaceDetector,
        motion: Motion | None = None,
        locate: Locate | None = None,
        orientation: FrameOrientation = AS_DELIVERED,
        turns_film: bool = False,
    ) -> None:
        self._detector, self._motion, self._locate = detector, motion, locate
        self._orientation, self._turns_film = orientation, turns_film
        self._turned_count = 0
        self._faults: dict[str, bool] = {}  # fault -> whether it has been reported
        # Imported here because the loop's process imports this module too, without OpenCV.
        from gazerig.drivers.camera.health import CameraHealth, TurnedFaceSearch
        from gazerig.drivers.vision.clothing import add_clothing
        from gazerig.drivers.vision.cut_detector import CutDetector

        self._cuts, self._add_clothing = CutDetector(), add_clothing
        self._health, self._turned = CameraHealth(orientation.rotation), TurnedFaceSearch()

    def analyze(self, shot: Shot) -> Detections:
        """Turn a frame upright, and find and locate faces, people, palms and motion in it."""
        began_s = perf_counter()
        shot = self._orientation.turn_shot(shot)
        height, width = shot.image.shape[:2]
        image, t_s = shot.image, shot.captured_s
        faces = tuple(
            [face for face in self._detector.find(image) if not is_off_frame(face, width, height)]
        )
        faces_s = perf_counter()
        find_people = getattr(self._detector, "people", None)
        people = () if find_people is None else find_people(image, t_s)
        find_palms = getattr(self._detector, "palms", None)
        palms = None if find_palms is None else find_palms(image, t_s, faces, people)
        faces, people = self._add_clothing(image, faces, people)
        bodies_s = perf_counter()
        blobs = self._motion(shot) if self._motion is not None else ()
        spent_s = {
            "faces": faces_s - began_s,
            "people and hands": bodies_s - faces_s,
            "motion": perf_counter() - bodies_s,
        }
        scene = self._cuts.scene(image) + self._turned_count
        self._judge_turn(shot, faces)
        found = Detections(
            t_s,
            shot.number,
            width,
            height,
            faces,
            blobs,
            image,
            shot.depth_m,
            shot.lens,
            scene=scene,
            people=people,
            palms=palms,
            conditions=self._health.assess(shot, spent_s),
        )
        if (fault := getattr(self._locate, "fault", None)) is not None and (line := fault(found)):
            self._faults.setdefault(line, False)
        return found.locate_in_camera(self._locate)

    def events(self) -> tuple[str, ...]:
        """Return events of detector and calibration since the last call, one line each."""
        faults = tuple(line for line, told in self._faults.items() if not told)
        self._faults = dict.fromkeys(self._faults, True)
        events = getattr(self._detector, "events", None)
        told = events() if events is not None else ()
        return (*faults, *self._health.events(), *told)

    def _judge_turn(self, shot: Shot, faces: tuple[DetectedFace, ...]) -> None:
        """Report a camera whose faces are turned; turn the next frames of such a film."""
        rotation = self._turned.find(shot.image, shot.captured_s, faces)
        if rotation is None:
            return
        if not self._turns_film:
            self._health.turned(rotation)
        elif rotation:
            self._orientation = self._orientation.turned_by(rotation)
            self._turned_count += 1
            line = f"the film is turned by {360 - rotation} deg, according to the faces: it is shown upright"
            self._faults[line] = False


LOST, BACK, CLOSING = "camera lost", "camera back", "closing the camera"
"""First words of events about the loss of a source, its reconnection, and an error at its end."""


class CaptureLoop:
    """A source of frames with the detectors of faces and motion.

    A lost source is reopened until it reconnects or ``recovery.give_up_s`` has passed. Frame
    numbers continue to count meanwhile.

    Args:
        parts: Source and detectors.
        now_s: The host's monotonic clock, seconds.
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
        self.source = parts.source()
        self._frames = FrameAnalyzer(
            parts.detector(),
            parts.motion() if parts.motion is not None else None,
            parts.locate,
            parts.orientation,
            getattr(self.source, "is_film", False),
        )
        self._now_s, self._recovery, self._report = now_s, recovery, report
        self._record = parts.record
        self._recorder: CameraRecorder | None = None
        self._counted = 0  # frames of the source before it was last reopened
        self._number = 0

    def open(self) -> None:
        """Open the source and begin at frame 1.

        Raises:
            CameraError: the source cannot be opened, or the recording cannot be created.
        """
        self.source.open()
        self._counted = self._number = 0
        if self._record is not None:
            from gazerig.drivers.camera.recorder import CameraRecorder

            try:
                self._recorder = CameraRecorder(unused_path(self._record))
            except BaseException:
                self.source.close()
                raise

    def next_detections(self, stop: threading.Event) -> Detections | None:
        """Return the detections in the next frame, None if ``stop`` was set meanwhile.

        Raises:
            CameraError: the source is lost permanently.
        """
        shot = self._take(stop)
        if shot is None:
            return None
        if self._recorder is not None:
            self._recorder.add(shot)
        self._number = self._counted + shot.number
        image = to_bgr(shot.image)
        if image is None:
            raise CameraError("the camera returned a frame that is not an image of 8 or 16 bits")
        found = self._frames.analyze(shot._replace(number=self._number, image=image))
        recorder_events = self._recorder.events() if self._recorder is not None else ()
        for line in (*self.source.events(), *recorder_events, *self._frames.events()):
            self._report(line)
        return found

    def close(self) -> None:
        """Free the source; safe to call twice. An error is reported: nothing can be done."""
        try:
            self.source.close()
        except Exception as error:
            named = plugin_error(error) or describe_error(error)
            with suppress(OSError):  # nobody listens any more
                self._report(f"{CLOSING}: {named}")
        if self._recorder is not None:
            self._recorder.finish()
            self._recorder = None

    def _take(self, stop: threading.Event) -> Shot | None:
        """Return the next frame, reopening a lost source; None if ``stop`` was set."""
        lost_s: float | None = None
        wait_s = self._recovery.retry_s
        while True:
            try:
                if lost_s is not None:
                    self.source.open()
                shot = self.source.take(self._now_s, stop)
            except CameraError as error:
                if lost_s is None:
                    self._counted = self._number
                    if self._recovery.give_up_s > 0.0:
                        self._report(f"{LOST} ({error}): trying it again")
                    lost_s = self._now_s()
                self.source.close()
                if self._now_s() - lost_s >= self._recovery.give_up_s:
                    raise
                if stop.wait(wait_s):
                    return None
                wait_s = min(2.0 * wait_s, self._recovery.longest_retry_s)
                continue
            if shot is not None and lost_s is not None:
                self._report(f"{BACK} after {self._now_s() - lost_s:.1f} s")
            # A source of another package may disregard ``stop``.
            return None if stop.is_set() else shot


def unused_path(file: Path) -> Path:
    """Return a path of which no file exists: after a restart of the camera FILE-2, and so on."""
    paths = (file.with_stem(f"{file.stem}-{n}") if n > 1 else file for n in count(1))
    return next(path for path in paths if not path.exists())


def detection_error(failure: BaseException) -> CameraError:
    """Return the error that ended the detection, as the control loop reports it."""
    named = failure if isinstance(failure, CameraError) else plugin_error(failure)
    if named:
        return CameraError(str(named))
    return CameraError(
        f"detection in the camera frames failed ({type(failure).__name__}: "
        f"{' '.join(str(failure).split())}): start it again, and report it if it recurs"
    )

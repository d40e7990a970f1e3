"""Detection frame by frame, with reopening of a lost camera."""

import threading
from collections.abc import Callable
from math import degrees, isnan
from time import perf_counter

from gazerig.drivers.camera.params import ASSUMED_FIELD_DEG, CameraRecovery
from gazerig.drivers.camera.source import FrameSource, Shot, to_bgr
from gazerig.drivers.errors import CameraError
from gazerig.drivers.plugins import describe_error, plugin_error
from gazerig.drivers.types import DetectedFace, Detections, FaceDetector, LocatedFrame, MovingBlob


def is_off_frame(face: DetectedFace, width_px: int, height_px: int) -> bool:
    """Return whether a face is outside the frame by its landmarks.

    A network may guess points of a face cut by the edge; a face whose centre is outside is not in
    view. If a face or a landmark is farther outside than the size of the face, the detector is
    wrong, usually because its pixels belong to another frame size; that is reported.
    """
    points: list[tuple[float, float]] = face.landmarks_px.tolist()
    if not points:
        return False  # a face without points: its consumer reports that
    x, y = sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)
    if isnan(x) or isnan(y):
        return False  # not numbers: the consumer reports that too
    outside = _distance_outside_px(x, y, width_px, height_px)
    return outside > 0.0 or _is_misplaced(points, width_px, height_px)


def _distance_outside_px(x: float, y: float, width_px: int, height_px: int) -> float:
    """Return the distance of a point outside the frame; negative inside."""
    return max(-0.5 - x, x - width_px + 0.5, -0.5 - y, y - height_px + 0.5)


def _is_misplaced(points: list[tuple[float, float]], width_px: int, height_px: int) -> bool:
    """Return whether a point is farther outside the frame than the size of the face."""
    size = max((max(along) - min(along) for along in zip(*points, strict=True)), default=0.0)
    return any(_distance_outside_px(x, y, width_px, height_px) > size for x, y in points)


class OffFrameReport:
    """One-time report that a detector returns faces outside the frame."""

    def __init__(self) -> None:
        self._reported = False

    def report(
        self, faces: tuple[DetectedFace, ...], width_px: int, height_px: int
    ) -> tuple[str, ...]:
        """Return the line about the faces of a frame, or an empty tuple."""
        if self._reported:
            return ()
        for face in faces:
            if _is_misplaced(face.landmarks_px.tolist(), width_px, height_px):
                self._reported = True
                x, y = face.landmarks_px.mean(axis=0).tolist()
                return (
                    f"a face with landmarks about ({x:.0f}, {y:.0f}), outside the frame of "
                    f"{width_px} x {height_px}, is ignored, as are all such faces: a detector "
                    "must return pixels of the frame that it was given",
                )
        return ()


Motion = Callable[[Shot], tuple[MovingBlob, ...]]
"""Finds motion from one frame to the next."""
Locate = Callable[[Detections], LocatedFrame]
"""Locates detections in the camera's axes; picklable. A method ``fault``, if present, returns in
one line why its calibration is not used for a frame, "" if it is used. Each line is reported once.
"""


class FrameAnalyzer:
    """Runner of the detectors.

    Args:
        detector: Finds faces.
        motion: Finds motion; None for none.
        locate: Locates faces and things; None: their consumer does.
        rotation_deg: Angle by which frames have been turned clockwise already.
        has_unknown_lens: Whether the camera does not report its field of view.
    """

    def __init__(
        self,
        detector: FaceDetector,
        motion: Motion | None = None,
        locate: Locate | None = None,
        rotation_deg: int = 0,
        has_unknown_lens: bool = False,
    ) -> None:
        self._detector, self._motion, self._locate = detector, motion, locate
        self._faults: dict[str, bool] = {}  # fault -> whether it has been reported
        self._has_unknown_lens = has_unknown_lens
        # Imported here because the loop's process imports this module too, without OpenCV.
        from gazerig.drivers.camera.health import CameraHealth
        from gazerig.drivers.vision.clothing import ClothingReader
        from gazerig.drivers.vision.cut_detector import CutDetector

        self._cuts, self._clothing = CutDetector(), ClothingReader()
        self._health = CameraHealth(rotation_deg)
        self._off_frame = OffFrameReport()

    def analyze(self, shot: Shot) -> Detections:
        """Find and locate faces, people, palms and motion."""
        began_s = perf_counter()
        height, width = shot.image.shape[:2]
        faces = self._detector.find(shot.image)
        for line in self._off_frame.report(faces, width, height):
            self._faults.setdefault(line, False)
        faces = tuple([face for face in faces if not is_off_frame(face, width, height)])
        faces_s = perf_counter()
        find_people = getattr(self._detector, "people", None)
        people = () if find_people is None else find_people(shot.image, shot.captured_s)
        find_palms = getattr(self._detector, "palms", None)
        seen = shot.image, shot.captured_s, faces, people
        palms = None if find_palms is None else find_palms(*seen)
        faces, people = self._clothing.add_clothing(shot.image, shot.captured_s, faces, people)
        bodies_s = perf_counter()
        blobs = self._motion(shot) if self._motion is not None else ()
        spent_s = {
            "faces": faces_s - began_s,
            "people and hands": bodies_s - faces_s,
            "motion": perf_counter() - bodies_s,
        }
        field_rad = getattr(self._locate, "field_rad", None)
        field_assumed = (
            self._has_unknown_lens
            and shot.lens is None
            and getattr(self._locate, "lens", None) is None
            and field_rad is not None
            and abs(degrees(field_rad) - ASSUMED_FIELD_DEG) < 1e-6
        )
        found = Detections(
            shot.captured_s,
            shot.number,
            width,
            height,
            faces,
            blobs,
            shot.image,
            shot.depth_m,
            shot.lens,
            scene=self._cuts.scene(shot.image),
            people=people,
            palms=palms,
            conditions=self._health.assess(shot, faces, spent_s, field_assumed),
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


LOST, BACK, CLOSING = "camera lost", "camera back", "closing the camera"
"""First words of events about the loss of a source, its reconnection, and an error at its end."""


class CaptureLoop:
    """A source of frames with the detectors of faces and motion.

    A lost source is reopened until it reconnects or ``recovery.give_up_s`` has passed. Frame
    numbers continue to count meanwhile.

    Args:
        source: Source of frames.
        detector: Finds faces.
        now_s: The host's monotonic clock, seconds.
        recovery: Times of reopening a lost source.
        motion: Finds motion, None for none.
        report: Called with each event as one line, immediately.
        locate: Locates detections in the camera's axes, None for none.
    """

    def __init__(
        self,
        source: FrameSource,
        detector: FaceDetector,
        now_s: Callable[[], float],
        recovery: CameraRecovery,
        motion: Motion | None,
        report: Callable[[str], None],
        locate: Locate | None = None,
    ) -> None:
        self._source = source
        self._frames = FrameAnalyzer(
            detector,
            motion,
            locate,
            getattr(source, "rotation", 0),
            getattr(source, "has_unknown_lens", False),
        )
        self._now_s = now_s
        self._recovery = recovery
        self._counted = 0  # frames of the source before it was last reopened
        self._number = 0
        self._report = report

    def open(self) -> None:
        """Open the source and begin at frame 1.

        Raises:
            CameraError: the source cannot be opened.
        """
        self._source.open()
        self._counted = self._number = 0

    def next_detections(self, stop: threading.Event) -> Detections | None:
        """Return the detections in the next frame, None if ``stop`` was set meanwhile.

        Raises:
            CameraError: the source is lost permanently.
        """
        shot = self._take(stop)
        if shot is None:
            return None
        self._number = self._counted + shot.number
        image = to_bgr(shot.image)
        if image is None:
            raise CameraError("the camera returned a frame that is not an image of 8 or 16 bits")
        found = self._frames.analyze(shot._replace(number=self._number, image=image))
        for line in (*self._source.events(), *self._frames.events()):
            self._report(line)
        return found

    def close(self) -> None:
        """Free the source; safe to call twice. An error is reported: nothing can be done."""
        try:
            self._source.close()
        except Exception as error:
            named = plugin_error(error) or describe_error(error)
            self._report(f"{CLOSING}: {named}")

    def _take(self, stop: threading.Event) -> Shot | None:
        """Return the next frame, reopening a lost source; None if ``stop`` was set."""
        lost_s: float | None = None
        wait_s = self._recovery.retry_s
        while True:
            try:
                if lost_s is not None:
                    self._source.open()
                shot = self._source.take(self._now_s, stop)
            except CameraError as error:
                if lost_s is None:
                    self._counted = self._number
                    if self._recovery.give_up_s > 0.0:
                        self._report(f"{LOST} ({error}): trying it again")
                    lost_s = self._now_s()
                self._source.close()
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


def detection_error(failure: BaseException) -> CameraError:
    """Return the error that ended the detection, as the control loop reports it."""
    if isinstance(failure, CameraError):
        return CameraError(str(failure))
    if (named := plugin_error(failure)) is not None:
        return CameraError(str(named))
    return CameraError(
        f"detection in the camera frames failed ({type(failure).__name__}: "
        f"{' '.join(str(failure).split())}): start it again, and report it if it recurs"
    )

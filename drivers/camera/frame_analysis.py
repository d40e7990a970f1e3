"""Analysis of a frame: faces, people, hands and motion."""

from collections.abc import Callable
from math import degrees
from time import perf_counter

from gazerig.drivers.camera.off_frame import OffFrameReport, is_off_frame
from gazerig.drivers.camera.params import ASSUMED_FIELD_DEG
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, Detections, FaceDetector, LocatedFrame, MovingBlob

Motion = Callable[[Shot], tuple[MovingBlob, ...]]
"""Finds motion from one frame to the next."""
Locate = Callable[[Detections], LocatedFrame]
"""Locates detections in the camera's axes; picklable. A method ``fault``, if present, returns in
one line why its calibration is not used for a frame, "" if it is used. Each line is reported once.
"""


class FrameAnalyzer:
    """Runner of the detectors, which may be changed between frames.

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
        self._faults: dict[str, bool] = {}  # with whether each has been reported
        self._has_unknown_lens = has_unknown_lens
        # Here, as the loop's process imports this module too, without OpenCV.
        from gazerig.drivers.camera.health import CameraHealth
        from gazerig.drivers.vision.clothing import ClothingReader
        from gazerig.drivers.vision.cut_detector import CutDetector

        self._cuts, self._clothing = CutDetector(), ClothingReader()
        self._health = CameraHealth(rotation_deg)
        self._off_frame = OffFrameReport()

    def look(self, shot: Shot) -> Detections:
        """Find and locate faces (unless the camera has found them), people, palms and motion."""
        began_s = perf_counter()
        height, width = shot.image.shape[:2]
        faces = self._faces(shot)
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
            turn=shot.turn,
            scene=self._cuts.scene(shot.image),
            people=people,
            palms=palms,
            conditions=self._health.look(shot, faces, spent_s, self._field_assumed(shot)),
        )
        if (fault := getattr(self._locate, "fault", None)) is not None and (line := fault(found)):
            self._faults.setdefault(line, False)
        return found.located_by(self._locate)

    def _field_assumed(self, shot: Shot) -> bool:
        """Return whether the field of view is not measured."""
        if not self._has_unknown_lens or shot.lens is not None:
            return False
        if getattr(self._locate, "lens", None) is not None:
            return False
        field_rad = getattr(self._locate, "field_rad", None)
        return field_rad is not None and abs(degrees(field_rad) - ASSUMED_FIELD_DEG) < 1e-6

    def _faces(self, shot: Shot) -> tuple[DetectedFace, ...]:
        if shot.faces is None:
            return self._detector.find(shot.image)
        add_meshes = getattr(self._detector, "add_meshes", None)
        return shot.faces if add_meshes is None else add_meshes(shot.image, shot.faces)

    def events(self) -> tuple[str, ...]:
        """Return events of detector and calibration since the last call, one line each."""
        faults = tuple(line for line, told in self._faults.items() if not told)
        self._faults = dict.fromkeys(self._faults, True)
        events = getattr(self._detector, "events", None)
        told = events() if events is not None else ()
        return (*faults, *self._health.events(), *told)

    def retune(
        self,
        detector: Callable[[], FaceDetector] | None,
        motion: Callable[[Motion | None], Motion | None] | None,
        locate: Locate | None = None,
    ) -> None:
        """Change the detectors and the calibration from the next frame on.

        Args:
            detector: Creates another detector; None: no change.
            motion: Returns a motion detector from the present one; None: no change.
            locate: Locates by another calibration; None: no change.

        Raises:
            SetupError: the detector cannot be created; the old one stays.
        """
        if locate is not None:
            self._locate, self._faults = locate, {}
        if motion is not None:
            self._motion = motion(self._motion)
        if detector is not None:
            self._detector = detector()

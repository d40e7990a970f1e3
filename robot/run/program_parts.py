"""A program's own camera, detector and attention rule, which replace those of the rig."""

from typing import NamedTuple

from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import Camera, FaceDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.robot.loop.chooser import Chooser, RuleChooser, TargetChooser


class ProgramParts(NamedTuple):
    """Objects of a program; None for the rig's own part.

    camera: returns detections, or frames for a detector
    detector: finds faces in frames
    chooser: chooses the target
    """

    camera: Camera | FrameSource | None = None
    detector: FaceDetector | None = None
    chooser: Chooser | None = None

    def make_detector(self, params: FaceDetectorParams) -> FaceDetector:
        """Return the detector: the program's, or the rig's."""
        if self.detector is None:
            return face_detector(params)
        require_method(self.detector, "detector", "find")
        return self.detector

    def make_chooser(self, own: TargetChooser) -> TargetChooser:
        """Return the chooser of the target: the program's rule before the rig's own."""
        if self.chooser is None:
            return own
        require_method(self.chooser, "attention", "choose")
        return RuleChooser(self.chooser, own, part_label("attention", self.chooser))


NO_PARTS = ProgramParts()


def require_method(part: object, what: str, method: str) -> None:
    """Refuse a part of a program that lacks a method.

    Raises:
        SetupError: it has no such method.
    """
    if not callable(getattr(part, method, None)):
        raise SetupError(f"{part_label(what, part)} has no method {method}")


def part_label(what: str, part: object) -> str:
    """Return the name of a program's part for messages."""
    return f"{what} {type(part).__name__} of the program"

"""A program's own camera, detector and rule of attention in the place of the rig's."""

from collections.abc import Callable
from typing import NamedTuple, cast

from gazerig.config.rig import Rig
from gazerig.drivers.camera.camera_plugins import CheckedSource, is_source
from gazerig.drivers.camera.frame_analysis import Locate, Motion
from gazerig.drivers.camera.guarded_camera import LONGEST_S as LONGEST_CAMERA_S
from gazerig.drivers.camera.guarded_camera import GuardedCamera
from gazerig.drivers.camera.orientation import FrameOrientation, UprightSource
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.thread import CameraThread
from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import Camera, FaceDetector
from gazerig.drivers.vision.face.detector import CheckedDetector, face_detector, mtcnn
from gazerig.robot.control.chooser import LONGEST_S, Chooser, GuardedChooser, TargetChooser
from gazerig.robot.model.clock import Clock


class ProgramParts(NamedTuple):
    """Objects that a program brings; None where the rig's own part does the work.

    camera: gives detections, or frames in which a detector looks
    detector: finds faces in frames
    chooser: says what to look at
    """

    camera: Camera | FrameSource | None = None
    detector: FaceDetector | None = None
    chooser: Chooser | None = None

    def find_faces(self, rig: Rig) -> FaceDetector:
        """Return the detector: the program's, with ours for after it has failed, or the rig's."""
        if self.detector is None:
            return face_detector(rig.detector)
        _require(self.detector, "detector", "find")
        label = _label("detector", self.detector)
        return CheckedDetector(self.detector, label, lambda: mtcnn(rig.detector))

    def choose(
        self, own: TargetChooser, say: Callable[[str], None], simulated: bool
    ) -> TargetChooser:
        """Return who chooses what to look at: the program's rule before the rig's own."""
        if self.chooser is None:
            return own
        _require(self.chooser, "attention", "choose")
        longest_s = None if simulated else LONGEST_S
        return GuardedChooser(self.chooser, own, _label("attention", self.chooser), say, longest_s)


NO_PARTS = ProgramParts()


def program_camera(
    rig: Rig,
    parts: ProgramParts,
    clock: Clock,
    motion: Callable[[], Motion | None],
    locate: Locate,
    fast: bool,
) -> Camera:
    """Return the program's own camera, checked and watched like another package's.

    Raises:
        SetupError: it is none, or gives frames in simulated time.
    """
    camera = parts.camera
    label = _label("camera", camera)
    if not is_source(camera):
        _require(camera, "camera", "latest")
        return GuardedCamera(cast(Camera, camera), label, None if fast else LONGEST_CAMERA_S)
    if fast:
        raise SetupError(f"{label} gives frames in real time: in simulated time give detections")
    source = CheckedSource(cast(FrameSource, camera), label)
    turned = UprightSource(source, FrameOrientation(rig.camera.rotation, rig.camera.mirrored))
    return GuardedCamera(watched(rig, parts, turned, clock, motion, locate), label)


def watched(
    rig: Rig,
    parts: ProgramParts,
    source: FrameSource,
    clock: Clock,
    motion: Callable[[], Motion | None],
    locate: Locate,
) -> CameraThread:
    """Return a source of frames with the detector looking in a thread of this program."""
    detector = parts.find_faces(rig)
    return CameraThread(source, detector, clock.now_s, rig.camera_recovery, motion(), locate)


def _require(part: object, what: str, method: str) -> None:
    if not callable(getattr(part, method, None)):
        raise SetupError(f"{_label(what, part)} has no method {method}")


def _label(what: str, part: object) -> str:
    return f"{what} {type(part).__name__} of the program"

"""Detection of faces, people without a visible face, and palms, depending on the model files."""

import numpy as np

from gazerig.drivers.camera.quiet_opencv import quiet_stderr
from gazerig.drivers.errors import ModelFileError, extra_hint
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.types import (
    DetectedFace,
    DetectedPalm,
    DetectedPerson,
    FaceDetector,
    ImageArray,
)
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.model_files import PALMS, PEOPLE, ModelFile
from gazerig.drivers.vision.palms import PalmDetector
from gazerig.drivers.vision.people import Floats, Network, PeopleDetector


class BodyDetector:
    """A face detector that also finds people whose face is not visible, and palms."""

    def __init__(
        self,
        detector: FaceDetector,
        people: PeopleDetector | None,
        palms: PalmDetector | None = None,
        faults: tuple[str, ...] = (),
    ) -> None:
        self._detector, self._people, self._palms = detector, people, palms
        self._log = EventLog()
        for fault in faults:
            self._log.add(fault)

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
        return self._detector.find(image)

    def people(self, image: ImageArray, captured_s: float) -> tuple[DetectedPerson, ...]:
        """Find people; see ``PeopleDetector.find``."""
        return () if self._people is None else self._people.find(image, captured_s)

    def palms(
        self,
        image: ImageArray,
        captured_s: float,
        faces: tuple[DetectedFace, ...],
        people: tuple[DetectedPerson, ...],
    ) -> tuple[DetectedPalm, ...] | None:
        """Find palms; see ``PalmDetector.find``."""
        return None if self._palms is None else self._palms.find(image, captured_s, faces, people)

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events = getattr(self._detector, "events", None)
        return (*self._log.drain(), *(events() if events is not None else ()))


def add_body_detection(detector: FaceDetector, params: FaceDetectorParams) -> FaceDetector:
    """Return a detector that also finds people and palms, or the given one without their files.

    A file that cannot be used is reported as an event.
    """
    networks: list[Network | None] = []
    faults: list[str] = []
    for file, rate_hz, without in (
        (PEOPLE, params.people_hz, "people without a visible face"),
        (PALMS, params.hands_hz, "hands that are held still"),
    ):
        try:
            networks.append(_load(file) if rate_hz > 0.0 else None)
        except ModelFileError as error:
            networks.append(None)
            faults.append(f"{error}; until then {without} are not found")
    people, palms = networks
    if people is palms is None and not faults:
        return detector
    return BodyDetector(
        detector,
        None if people is None else PeopleDetector(params, people),
        None if palms is None else PalmDetector(params, palms),
        tuple(faults),
    )


def _load(file: ModelFile) -> Network | None:
    """Return a network, None if the user has no file for it."""
    try:
        content = file.read()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise ModelFileError(f"cannot read {file.path} ({error.strerror})") from error
    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError as error:
        raise ModelFileError(extra_hint("ai-edge-litert", "people", error)) from error
    with quiet_stderr():  # LiteRT prints a banner
        net = Interpreter(model_content=content, num_threads=1)
        net.allocate_tensors()
    (given,), (boxes, scores) = net.get_input_details(), net.get_output_details()

    def run(square: Floats) -> tuple[Floats, Floats]:
        net.set_tensor(given["index"], square[np.newaxis])
        net.invoke()
        return net.get_tensor(boxes["index"])[0], net.get_tensor(scores["index"])[0, :, 0]

    return run

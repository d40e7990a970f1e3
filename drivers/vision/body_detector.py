"""All detectors of a picture: faces with meshes, people without a visible face, and palms."""

from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.types import (
    DetectedFace,
    DetectedPalm,
    DetectedPerson,
    FaceDetector,
    ImageArray,
)
from gazerig.drivers.vision.face.params import FaceDetectorParams

if TYPE_CHECKING:
    from gazerig.drivers.vision.face.mesh import MeshNetworks
    from gazerig.drivers.vision.palms import PalmDetector
    from gazerig.drivers.vision.people import PeopleDetector


class BodyDetector:
    """A face detector that also finds meshes, people whose face is not visible, and palms.

    Of a search of the whole picture for faces, one for people and one for palms, a picture gets two
    at most: palms wait for the next picture.
    """

    def __init__(
        self,
        faces: FaceDetector,
        people: "PeopleDetector | None" = None,
        palms: "PalmDetector | None" = None,
        meshes: "MeshNetworks | None" = None,
        faults: tuple[str, ...] = (),
    ) -> None:
        self._faces, self._people, self._palms, self._meshes = faces, people, palms, meshes
        self._searches = 0
        self._log = EventLog()
        for fault in faults:
            self._log.add(fault)

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first and with a mesh, in pixels of the image."""
        faces = self._faces.find(image)
        self._searches = int(getattr(self._faces, "searched", False))
        if self._meshes is None or not faces:
            return faces
        first, *others = faces
        return replace(first, mesh=self._meshes.mesh(image, first.landmarks_px)), *others

    def people(self, image: ImageArray, captured_s: float) -> tuple[DetectedPerson, ...]:
        """Return the people in the next part of a picture; none while no search is due."""
        if self._people is None or not self._people.is_due(captured_s):
            return ()
        self._searches += 1
        return self._people.find(image, captured_s)

    def palms(
        self,
        image: ImageArray,
        captured_s: float,
        faces: tuple[DetectedFace, ...],
        people: tuple[DetectedPerson, ...],
    ) -> tuple[DetectedPalm, ...] | None:
        """Return the palms of the nearest person, None while no search is due."""
        if self._palms is None:
            return None
        self._palms.watch(captured_s, faces, people)
        if self._searches == 2 or not self._palms.is_due(captured_s):
            return None
        return self._palms.find(image, captured_s)

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events = getattr(self._faces, "events", None)
        return (*self._log.drain(), *(events() if events is not None else ()))


def add_body_detection(faces: FaceDetector, params: FaceDetectorParams) -> FaceDetector:
    """Return a detector that also finds meshes, people and palms, as far as their files are there.

    A file that cannot be used is reported as an event.
    """
    faults: list[str] = []

    def loaded(module: str, name: str, without: str, *given: object) -> Any:
        try:
            return getattr(import_module(f"gazerig.drivers.vision.{module}"), name)(*given)
        except FileNotFoundError:
            return None
        except (ImportError, ModelFileError) as error:
            faults.append(f"{error}; until then {without} are not found")
            return None

    meshes = loaded("face.mesh", "MeshNetworks", "face meshes")
    people = palms = None
    if params.people_hz > 0.0:
        people = loaded("people", "PeopleDetector", "people without a visible face", params)
    if params.hands_hz > 0.0:
        palms = loaded("palms", "PalmDetector", "hands that are held still", params)
    if not (meshes or people or palms or faults):
        return faces
    return BodyDetector(faces, people, palms, meshes, tuple(faults))

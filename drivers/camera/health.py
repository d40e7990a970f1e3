"""Poor viewing conditions of a camera: each is reported once when it begins and once when it ends.

Once a second a frame is assessed: too dark, turned, of an unmeasured field of view,
or analysed too slowly. Only a lasting condition is reported, with its remedy. The statistics use at
most 640 pixels of width and take 2 ms. While no upright faces are found, a turned copy is searched
for faces every few seconds, which takes 10 ms.
"""

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from math import atan2, degrees, inf, isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.params import ASSUMED_FIELD_DEG
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, ImageArray

if TYPE_CHECKING:
    from gazerig.drivers.vision.face.mtcnn import MtcnnDetector

EVERY_S = 1.0
"""Time between two assessments; the durations below are counts of assessments."""
PROBE_S = 3.0
"""Time between two searches of a turned copy while no upright faces are found."""

_BEGINS, _ENDS = 5, 3
_WIDTH_PX = 640
# 95 % of the pixels are darker. MTCNN finds faces down to about 12 of 255 without noise; 32
# leaves room for the noise of a webcam in the dark.
_DARK, _LIT, _BLACK = 32.0, 45.0, 6.0
# Largest roll and lowest confidence of an upright face: MTCNN mistakes one of six upside-down faces
# for upright, with a lower confidence. Number of assessments in which upright faces are counted.
_UPRIGHT_DEG, _SURE, _SAMPLES = 25.0, 0.9, 15
# Number of searches that must agree, and their tolerance in degrees; width of the searched copy;
# factor by which the next search is delayed after one in all directions without a result.
_PROBES, _AGREE_DEG, _PROBE_PX, _FRUITLESS = 4, 30.0, 320, 10
# One degree of roll reduces a face's score by this share of its confidence: in a frame turned by
# 120 deg MTCNN also finds some faces, with lower confidence and wrong landmarks.
_PER_DEG = 0.003
# Largest deviation from a quarter turn that camera.rotation can correct.
_QUARTER_DEG = 30.0
# Analysis is too slow below this share of the frames and this rate, and in time again above the
# others.
_SHARE, _SLOW_HZ, _SHARE_AGAIN, _AGAIN_HZ = 0.5, 15.0, 0.6, 18.0

_OVER = {
    "dark": "camera: the picture is bright enough again",
    "turned": "camera: the picture is upright again",
    "field": "camera: the field of view is known now",
    "slow": "camera: frames are analysed in time again",
}
_REMEDIES = {
    "faces": "lower detector.work_width_px",
    "people and hands": "lower detector.people_hz and detector.hands_hz",
    "motion": "lower motion.work_px, or set motion.enabled: false",
    "reading": "lower the camera's rate_hz or width_px, or free the computer",
}
FIELD_TEXT = (
    f"the field of view is not measured and taken as {ASSUMED_FIELD_DEG:g} deg (a lens of 84 deg "
    "places people 1.3 times too far): gazerig calibrate camera measures it with a printed "
    "board"
)


class CameraObservation(NamedTuple):
    """Observations of a camera for one assessment; None: unknown.

    brightness: 95th percentile of the grey level, 0..255
    has_upright_face: whether a nearly upright face is found
    turned_deg: clockwise angle of the frame, from faces that are upright after turning it back; 0:
        it is upright
    delivered_frames, analysed_frames: counts since the last assessment
    duration_s: time since the last assessment
    spent_ms: time per frame by stage
    is_field_assumed: whether the field of view is not measured
    """

    brightness: float | None = None
    has_upright_face: bool = False
    turned_deg: float | None = None
    delivered_frames: int = 0
    analysed_frames: int = 0
    duration_s: float = 0.0
    spent_ms: Mapping[str, float] = {}
    is_field_assumed: bool = False


class _Condition:
    """A condition; it begins and ends after several consecutive equal assessments."""

    def __init__(self, over: str, begins: int = _BEGINS, ends: int = _ENDS) -> None:
        self._over, self._lasts = over, (begins, ends)
        self.text, self._run = "", 0

    def step(self, text: str | None) -> str:
        """Add an assessment, None if unknown; return the line to report, "" for none."""
        if text is None:
            return ""
        if bool(text) == bool(self.text):
            self._run = 0
            return ""
        self._run += 1
        if self._run < self._lasts[not text]:
            return ""
        self.text, self._run = text, 0
        return f"camera: {text}" if text else self._over


class HealthModel:
    """Model that converts observations to conditions; pure.

    rotation_deg: present camera.rotation, by which frames have been turned already
    """

    def __init__(self, rotation_deg: int = 0) -> None:
        self._rotation = rotation_deg
        self._on = {name: _Condition(over) for name, over in _OVER.items()}
        self._on["turned"] = _Condition(_OVER["turned"], 1)  # its evidence has already lasted
        self._on["field"] = _Condition(_OVER["field"], 1, 1)
        self._upright: deque[bool] = deque(maxlen=_SAMPLES)
        self._turned: deque[float] = deque(maxlen=_PROBES)

    @property
    def conditions(self) -> tuple[str, ...]:
        """Return the present conditions, each with its remedy."""
        return tuple([one.text for one in self._on.values() if one.text])

    @property
    def lacks_upright_faces(self) -> bool:
        """Return whether few upright faces are found, so that turned ones are worth a search."""
        few = len(self._upright) >= _BEGINS and 2 * sum(self._upright) < len(self._upright)
        return few and not self._on["turned"].text

    def step(self, seen: CameraObservation) -> tuple[str, ...]:
        """Add observations; return the lines to report."""
        texts = {
            "dark": self._dark_condition(seen.brightness),
            "turned": self._roll_condition(seen),
            "field": FIELD_TEXT if seen.is_field_assumed else "",
            "slow": self._slow_condition(seen),
        }
        return tuple([line for name, text in texts.items() if (line := self._on[name].step(text))])

    def _dark_condition(self, brightness: float | None) -> str | None:
        if brightness is None:
            return None
        if brightness >= (_LIT if self._on["dark"].text else _DARK):
            return ""
        if brightness < _BLACK:
            return "the picture is black: uncover the lens, switch on a light"
        return "the picture is too dark: switch on a light in front of the person"

    def _roll_condition(self, seen: CameraObservation) -> str | None:
        self._upright.append(seen.has_upright_face)
        if 2 * sum(self._upright) > len(self._upright):
            self._turned.clear()
            return ""
        if seen.turned_deg is None:
            return None
        self._turned.append(seen.turned_deg)
        if len(self._turned) < _PROBES or 0.0 in self._turned:
            return None
        if any(
            abs(_wrap_half_turn_deg(one - seen.turned_deg)) > _AGREE_DEG for one in self._turned
        ):
            return None
        deg = seen.turned_deg
        quarter = round(deg / 90.0) * 90 % 360
        off = abs(_wrap_half_turn_deg(deg - quarter))
        about = (
            f"{quarter} deg" if off < 0.5 * _QUARTER_DEG else f"about {5 * round(deg / 5.0)} deg"
        )
        cure = "turn it upright on its mount"
        if quarter and off < _QUARTER_DEG:
            cure = f"set camera.rotation: {(self._rotation - quarter) % 360}"
        return f"the camera is turned by {about}, according to the faces: {cure}"

    def _slow_condition(self, seen: CameraObservation) -> str | None:
        if seen.duration_s <= 0.0 or seen.delivered_frames <= 0:
            return None
        was = bool(self._on["slow"].text)
        share, hz = (_SHARE_AGAIN, _AGAIN_HZ) if was else (_SHARE, _SLOW_HZ)
        if (
            seen.analysed_frames >= share * seen.delivered_frames
            or seen.analysed_frames >= hz * seen.duration_s
        ):
            return ""
        each_ms = 1e3 * seen.duration_s / max(1, seen.analysed_frames)
        spent = {**seen.spent_ms, "reading": each_ms - sum(seen.spent_ms.values())}
        stage = max(spent, key=lambda name: spent[name])
        return (
            f"{seen.analysed_frames / seen.duration_s:.0f} of {seen.delivered_frames / seen.duration_s:.0f} frames a "
            f"second are analysed; {stage} take{'s' * (stage in ('motion', 'reading'))} "
            f"{spent[stage]:.0f} of {each_ms:.0f} ms a frame: {_REMEDIES[stage]}"
        )


class CameraHealth:
    """Monitor of the frames of a camera.

    Args:
        rotation_deg: Present camera.rotation.
    """

    def __init__(self, rotation_deg: int = 0) -> None:
        self._model = HealthModel(rotation_deg)
        self._probe = TurnedFaceSearch()
        self._events: list[str] = []
        self._due_s, self._probe_s, self._last_s = -inf, -inf, -inf
        self._number = self._looked_at = 0
        self._spent: Counter[str] = Counter()

    def assess(
        self,
        shot: Shot,
        faces: Sequence[DetectedFace],
        spent_s: Mapping[str, float],
        field_assumed: bool = False,
    ) -> tuple[str, ...]:
        """Add an analysed frame; return the present conditions.

        Args:
            shot: The frame.
            faces: Faces found in it.
            spent_s: Time by stage, seconds.
            field_assumed: Whether the field of view is not measured.
        """
        t_s = shot.captured_s
        if not isfinite(t_s):
            return self._model.conditions
        self._looked_at += 1
        self._spent.update(spent_s)
        if t_s < self._last_s:  # time has restarted
            self._due_s = self._probe_s = -inf
        if t_s < self._due_s:
            self._last_s = t_s
            return self._model.conditions
        over_s = t_s - self._due_s + EVERY_S if self._last_s <= t_s and self._number else 0.0
        self._due_s, self._last_s = t_s + EVERY_S, t_s
        seen = CameraObservation(
            brightness_of(shot.image),
            _has_upright_face(faces),
            self._search_turned(shot.image, t_s, bool(faces)),
            shot.number - self._number,
            self._looked_at,
            over_s,
            {name: 1e3 * s / self._looked_at for name, s in self._spent.items()},
            field_assumed,
        )
        self._number, self._looked_at = shot.number, 0
        self._spent.clear()
        self._events += self._model.step(seen)
        return self._model.conditions

    def events(self) -> tuple[str, ...]:
        """Return the conditions that began or ended since the last call, one line each."""
        told, self._events = tuple(self._events), []
        return told

    def _search_turned(self, image: ImageArray, t_s: float, tilted: bool) -> float | None:
        """Search a turned copy if upright faces are missing and a search is due."""
        if not self._model.lacks_upright_faces or self._probe_s > t_s:
            return None
        found = self._probe.find(image, tilted)
        fruitless = tilted and found == 0.0
        self._probe_s = t_s + PROBE_S * (_FRUITLESS if fruitless else 1)
        return found


class TurnedFaceSearch:
    """Search for faces in turned frames, in another direction each time until one is found."""

    def __init__(self) -> None:
        self._detector: MtcnnDetector | None = None
        self._ways = deque((180, 90, 270))
        self._fails = False

    def find(self, image: ImageArray, tilted: bool = False) -> float | None:
        """Return the clockwise angle of a frame from its faces; 0.0: upright, or without faces.

        The result is None if the detector is missing.

        tilted: whether the unturned frame shows faces
        """
        if self._detector is None and not self._fails:
            from gazerig.drivers.errors import ModelFileError
            from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
            from gazerig.drivers.vision.face.params import FaceDetectorParams

            try:
                self._detector = MtcnnDetector(FaceDetectorParams())
            except ModelFileError:
                self._fails = True
        detector = self._detector
        if detector is None or not _is_picture(image):
            return None
        small = _limit_width(image[..., :3], _PROBE_PX)
        if tilted:
            if _has_upright_face(detector.find(small)):
                return 0.0
        elif not _has_confident_face(detector.find(_rotate_back(small, self._ways[0]))):
            self._ways.rotate(-1)
            return 0.0
        found = [
            (face.confidence - _PER_DEG * abs(roll_deg(face)), way, face)
            for way in range(0, 360, 45)
            for face in detector.find(_rotate_back(small, way))
        ]
        if not found:
            return 0.0
        _, way, surest = max(found, key=lambda one: one[0])
        turned_deg = _wrap_half_turn_deg(way + roll_deg(surest))
        sure = surest.confidence >= _SURE and abs(turned_deg) > _UPRIGHT_DEG
        return turned_deg if sure else 0.0


def _rotate_back(image: NDArray[Any], deg: float) -> ImageArray:
    """Return a whole image turned counter-clockwise."""
    if deg % 90 == 0:
        return np.asarray(np.ascontiguousarray(np.rot90(image, int(deg) // 90)), np.uint8)
    height, width = image.shape[:2]
    side = round(np.hypot(height, width))
    turn = cv2.getRotationMatrix2D((width / 2.0, height / 2.0), deg, 1.0)
    turn[:, 2] += (side - width) / 2.0, (side - height) / 2.0
    return np.asarray(cv2.warpAffine(image, turn, (side, side)), np.uint8)


def _has_confident_face(faces: Sequence[DetectedFace]) -> bool:
    return any(face.confidence >= _SURE for face in faces)


def _has_upright_face(faces: Sequence[DetectedFace]) -> bool:
    """Return whether any face is confident and nearly upright."""
    return _has_confident_face([face for face in faces if abs(roll_deg(face)) < _UPRIGHT_DEG])


def _wrap_half_turn_deg(deg: float) -> float:
    """Return the same angle within -180..180 deg."""
    return (deg + 180.0) % 360.0 - 180.0


def roll_deg(face: DetectedFace) -> float:
    """Return the clockwise roll of a face in the image from its eyes; 0 if unknown."""
    points: list[list[float]] = face.landmarks_px.tolist()
    if len(points) < 2:
        return 0.0
    (ax, ay), (bx, by) = points[:2]
    roll = degrees(atan2(by - ay, bx - ax))
    return roll if isfinite(roll) else 0.0


def brightness_of(image: NDArray[Any]) -> float | None:
    """Return the 95th percentile of the grey level; None if it is not an 8-bit picture."""
    if not _is_picture(image):
        return None
    green = _limit_width(image[..., 1], _WIDTH_PX)
    return float(np.percentile(green[::4, ::4], 95))


def _limit_width(image: NDArray[Any], width_px: int) -> ImageArray:
    """Return an image, scaled down if it is wider than a width."""
    height, width = image.shape[:2]
    image = np.ascontiguousarray(image)
    if width > width_px:
        size = width_px, max(1, round(height * width_px / width))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    return image


def _is_picture(image: Any) -> bool:
    """Return whether an array is an 8-bit colour picture."""
    is_array = isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.size > 0
    return is_array and image.ndim == 3 and image.shape[2] >= 3 and min(image.shape[:2]) >= 4

"""Poor viewing conditions of a camera: each is reported once when it begins and once when it ends.

Once a second a frame is assessed: too dark, turned, or analysed too slowly. Only a lasting
condition is reported, with its remedy.
"""

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import atan2, degrees, inf

import cv2
import numpy as np

from gazerig.drivers.camera.orientation import ROTATIONS, FrameOrientation, Rotation
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.types import DetectedFace, FaceDetector, ImageArray
from gazerig.drivers.vision.face.params import FaceDetectorParams

_EVERY_S, _BEGINS, _ENDS = 1.0, 5, 3
"""Time between assessments; number of equal ones after which a condition begins and ends."""
# 95 % of the pixels are darker. MTCNN finds faces down to about 12 of 255 without noise; 32
# leaves room for the noise of a webcam in the dark.
_DARK, _LIT, _BLACK = 32.0, 45.0, 6.0
# Analysis is too slow below this share of the frames and this rate, and in time again above the
# others.
_SHARE, _SLOW_HZ, _SHARE_AGAIN, _AGAIN_HZ = 0.5, 15.0, 0.6, 18.0
_OVER = {
    "dark": "camera: the picture is bright enough again",
    "turned": "camera: the picture is upright again",
    "slow": "camera: frames are analysed in time again",
}
_REMEDIES = {
    "faces": "lower detector.work_width_px",
    "people and hands": "lower detector.people_hz and detector.hands_hz",
    "motion": "lower motion.work_px, or set motion.enabled: false",
    "reading": "lower the camera's rate_hz or width_px, or free the computer",
}
# Largest roll and lowest confidence of an upright face: MTCNN mistakes one of six upside-down faces
# for upright, with a lower confidence.
_UPRIGHT_DEG, _SURE = 25.0, 0.9
_SEARCH_S, _SEARCH_PX = 0.5, 320
"""Time between searches, and width of the searched copy."""
_SAMPLES, _LEAST_SAMPLES, _HITS = 6, 3, 3
"""Frames in which upright faces are counted; agreeing searches that decide."""


class CameraHealth:
    """Monitor of the frames of a camera.

    Args:
        rotation_deg: Present camera.rotation.
    """

    def __init__(self, rotation_deg: int = 0) -> None:
        self._rotation_deg = rotation_deg
        self._texts: dict[str, str] = dict.fromkeys(_OVER, "")
        self._runs: Counter[str] = Counter()
        self._events: list[str] = []
        self._last_s, self._number, self._analysed = -inf, 0, 0
        self._spent_s: Counter[str] = Counter()

    def assess(self, shot: Shot, spent_s: Mapping[str, float]) -> tuple[str, ...]:
        """Add an analysed frame and its time by stage.

        Returns:
            The present conditions, each with its remedy.
        """
        self._analysed += 1
        self._spent_s.update(spent_s)
        past_s = shot.captured_s - self._last_s
        if not 0.0 <= past_s < _EVERY_S:
            self._judge("dark", self._dark(shot.image))
            if _EVERY_S <= past_s < inf:
                self._judge("slow", self._slow(shot.number - self._number, past_s))
            self._last_s, self._number, self._analysed = shot.captured_s, shot.number, 0
            self._spent_s.clear()
        return tuple([text for text in self._texts.values() if text])

    def turned(self, rotation_deg: int) -> None:
        """Record by how much frames must be turned clockwise to show upright faces; 0: they do."""
        text = ""
        if rotation_deg:
            text = (
                f"the camera is turned by {360 - rotation_deg} deg, according to the faces: "
                f"set camera.rotation: {(self._rotation_deg + rotation_deg) % 360}"
            )
        self._judge("turned", text, 1)

    def events(self) -> tuple[str, ...]:
        """Return the conditions that began or ended since the last call, one line each."""
        told, self._events = tuple(self._events), []
        return told

    def _judge(self, name: str, text: str, lasts: int = 0) -> None:
        """Add an assessment: the text of a condition, or "" without it."""
        if bool(text) == bool(self._texts[name]):
            self._runs[name] = 0
            return
        self._runs[name] += 1
        if self._runs[name] >= (lasts or (_BEGINS if text else _ENDS)):
            self._texts[name], self._runs[name] = text, 0
            self._events.append(f"camera: {text}" if text else _OVER[name])

    def _dark(self, image: ImageArray) -> str:
        brightness = float(np.percentile(image[::8, ::8, 1], 95))
        if brightness >= (_LIT if self._texts["dark"] else _DARK):
            return ""
        if brightness < _BLACK:
            return "the picture is black: uncover the lens, switch on a light"
        return "the picture is too dark: switch on a light in front of the person"

    def _slow(self, delivered: int, past_s: float) -> str:
        was = bool(self._texts["slow"])
        share, hz = (_SHARE_AGAIN, _AGAIN_HZ) if was else (_SHARE, _SLOW_HZ)
        if self._analysed >= min(share * delivered, hz * past_s):
            return ""
        each_ms = 1e3 * past_s / self._analysed
        spent_ms = {name: 1e3 * s / self._analysed for name, s in self._spent_s.items()}
        spent_ms["reading"] = each_ms - sum(spent_ms.values())
        stage = max(spent_ms, key=lambda name: spent_ms[name])
        return (
            f"{self._analysed / past_s:.0f} of {delivered / past_s:.0f} frames a second are analysed; "
            f"one takes {each_ms:.0f} ms ({stage} {spent_ms[stage]:.0f} ms), and the camera "
            f"delivers one every {1e3 * past_s / max(delivered, 1):.0f} ms: {_REMEDIES[stage]}"
        )


class TurnedFaceSearch:
    """Search for the quarter turn that makes a camera's faces upright.

    While few upright faces are found, a small copy of a frame is searched in one direction at a
    time, a direction with a result again; MTCNN takes about 10 ms for each. Several results must
    agree, and be more certain than a face in any other direction, so that neither a hand nor a head
    on one side decides.
    """

    def __init__(self) -> None:
        self._detector: FaceDetector | None = None  # without it no turned faces are found
        with suppress(ImportError, ModelFileError):
            from gazerig.drivers.vision.face.mtcnn import MtcnnDetector

            self._detector = MtcnnDetector(FaceDetectorParams())
        self._ways: deque[Rotation] = deque((180, 90, 270))
        self._upright: deque[bool] = deque(maxlen=_SAMPLES)
        self._hits, self._last_s = 0, -inf

    def find(self, image: ImageArray, t_s: float, faces: Sequence[DetectedFace]) -> Rotation | None:
        """Add a frame; return the clockwise turn that makes its faces upright, None if unknown.

        faces: faces found in it
        """
        if 0.0 <= t_s - self._last_s < _SEARCH_S:
            return None
        self._last_s = t_s
        self._upright.append(_surest_upright(faces) >= _SURE)
        if 2 * sum(self._upright) >= len(self._upright):
            self._hits = 0
            return 0 if len(self._upright) >= _LEAST_SAMPLES else None
        if len(self._upright) < _LEAST_SAMPLES or self._detector is None:
            return None
        way = self._ways[0]
        height, width = image.shape[:2]
        size = _SEARCH_PX, max(1, round(height * _SEARCH_PX / width))
        small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
        sure = self._confidence(small, way)
        if sure >= _SURE and sure > max(
            self._confidence(small, other) for other in ROTATIONS if other != way
        ):
            self._hits += 1
        else:
            self._hits = max(0, self._hits - 1)
            if self._hits == 0:
                self._ways.rotate(-1)
        if self._hits < _HITS:
            return None
        self._hits = 0
        self._upright.clear()  # the next frames may have been turned
        return way

    def _confidence(self, image: ImageArray, rotation: Rotation) -> float:
        assert self._detector is not None
        return _surest_upright(self._detector.find(FrameOrientation(rotation).turn_image(image)))


def _surest_upright(faces: Sequence[DetectedFace]) -> float:
    return max((face.confidence for face in faces if _is_upright(face)), default=0.0)


def _is_upright(face: DetectedFace) -> bool:
    points: list[list[float]] = face.landmarks_px.tolist()
    if len(points) < 2:
        return True  # unknown
    (ax, ay), (bx, by) = points[:2]
    return abs(degrees(atan2(by - ay, bx - ax))) < _UPRIGHT_DEG

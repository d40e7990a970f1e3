"""Dense meshes of the nearest faces: 468 points of the skin, and the irises, from two networks.

The networks are MediaPipe's face mesh and iris models, run by OpenCV.
"""

from collections.abc import Callable
from math import atan2, cos, exp, sin
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.types import FaceMesh, ImageArray, Pixels
from gazerig.drivers.vision.face.preprocess import as_bgr
from gazerig.drivers.vision.model_files import FACE_LANDMARK, IRIS_LANDMARK, ModelFile

Floats = NDArray[np.float64]
EyePoints = tuple[Floats, Floats]
"""Five points of an iris and the contour of its lids, in pixels of the crop."""

# Part of a crop that contains the eye, and size of the average against noise.
_EYE, _AVERAGED_PX = np.s_[16:48, 12:52], (5, 5)
# Smallest change of an eye, as a share of its contrast and in grey levels: 5 deg of gaze at .4 to
# 1.2 m change it by .35, a blink by more than .9, noise of sensor and mesh by .1 to .25.
_CHANGED, _LEAST_GREY = 0.3, 4.0
# Number of frames after which even an unchanged eye is analysed again.
_LONGEST_FRAMES = 8
# Network runs allowed per frame, and the most that can be saved: eyes that never rest, or a turning
# face, are analysed in every fourth frame, a blink in its own frames.
_LOOKS_A_FRAME, _MOST_LOOKS = 0.25, 2.0


class _EyeReading(NamedTuple):
    """Last run of the network: (2, ...) eyes, centres of their crops, and resulting points."""

    eyes: NDArray[np.float32]
    points: tuple[EyePoints | None, ...]


class EyeLandmarkCache:
    """Tracker of both eyes of one face, or of its successor: appearance decides, not identity.

    The network takes longer than that for the whole face, and eyes rest most of the time. If the
    crop of an eye is unchanged since the network last ran, the iris and lids are the same.
    """

    def __init__(self) -> None:
        self._last: _EyeReading | None = None
        self._frames = 0
        self._allowed = _MOST_LOOKS

    def analyze(
        self, crops: list[ImageArray], look: Callable[[ImageArray, int], EyePoints | None]
    ) -> tuple[EyePoints | None, ...] | None:
        """Return the points of both eyes, None if they have changed and are not analysed.

        Args:
            crops: Crops (64, 64, 3) of the right and of the left eye.
            look: Runs the network on a crop; the right eye is 0.
        """
        self._allowed = min(self._allowed + _LOOKS_A_FRAME, _MOST_LOOKS)
        self._frames += 1
        eyes = np.array(
            [cv2.cvtColor(crop, cv2.COLOR_BGR2GRAY)[_EYE] for crop in crops], np.float32
        )
        last = self._last
        changed = last is None or any(map(_has_changed, last.eyes, eyes))
        if last is not None and not changed and self._frames < _LONGEST_FRAMES:
            return last.points
        if self._allowed < 1.0:
            return None if last is None or changed else last.points
        self._allowed -= 1.0
        self._frames = 0
        self._last = _EyeReading(
            eyes, tuple([look(crop, which) for which, crop in enumerate(crops)])
        )
        return self._last.points


def _has_changed(before: NDArray[np.float32], now: NDArray[np.float32]) -> bool:
    """Return whether the appearance of an eye has changed."""
    change = cv2.blur(now - before, _AVERAGED_PX)
    return float(np.abs(change).max()) > max(_LEAST_GREY, _CHANGED * float(before.std()))


_MESH_OUTPUTS = ("conv2d_20", "conv2d_30")  # points; confidence that this is a face
_IRIS_OUTPUTS = ("output_iris", "output_eyes_contours_and_brows")
_MESH_PX, _IRIS_PX = 192, 64
_POINTS, _OF_IRIS, _OF_LIDS = 468, 5, 16

# Input square of the mesh network: its centre from the eyes towards the mouth, and its side in
# distances of eyes and mouth. For eyes: in widths of the eye.
_MIDDLE, _SIDE, _EYES_AS_HEIGHT, _EYE_SIDE = 0.45, 3.6, 1.1, 2.3
_EYE_CORNERS = (33, 133), (362, 263)
# Smaller faces get no mesh, and smaller eyes no iris.
_LEAST_EYES_PX, _LEAST_IRIS_EYES_PX = 14.0, 20.0
_LEAST_CERTAINTY = 0.5


class MeshNetworks:
    """The two networks: for the whole face, and for one eye."""

    def __init__(self) -> None:
        """Load the networks.

        Raises:
            FileNotFoundError: the user has no file for one.
            ModelFileError: a file cannot be read or is altered.
        """
        self._face = _network(FACE_LANDMARK)
        self._eye = _network(IRIS_LANDMARK)
        self._eyes = EyeLandmarkCache()

    def mesh(self, image: ImageArray, landmarks_px: Pixels) -> FaceMesh | None:
        """Return the mesh of a face, None if it is too small or the network finds none.

        Args:
            image: The frame; the eyes are analysed only if they have changed since the last one.
            landmarks_px: Landmarks (5, 2) in the order of DetectedFace.
        """
        image = as_bgr(image)
        between, mouth = landmarks_px[:2].mean(axis=0), landmarks_px[3:].mean(axis=0)
        across = landmarks_px[1] - landmarks_px[0]
        apart = float(np.hypot(*across))
        side = _SIDE * max(_EYES_AS_HEIGHT * apart, float(np.hypot(*(mouth - between))))
        if not _LEAST_EYES_PX <= side / (_SIDE * _EYES_AS_HEIGHT) <= max(image.shape[:2]):
            return None
        to_image = _square_map(between + _MIDDLE * (mouth - between), side, across, _MESH_PX)
        points, certainty = _run(self._face, _MESH_OUTPUTS, _crop(image, to_image, _MESH_PX))
        sure = 1.0 / (1.0 + exp(-min(max(float(certainty[0]), -50.0), 50.0)))
        if sure < _LEAST_CERTAINTY or not np.isfinite(points).all():
            return None
        grid = points.reshape(_POINTS, 3)
        depth = grid[:, 2:] * (side / _MESH_PX)
        found = np.hstack([_to_image(grid[:, :2], to_image), depth]).astype(np.float32)
        seen = self._eye_landmarks(image, found) if apart > _LEAST_IRIS_EYES_PX else None
        irises, lids = seen if seen is not None else (None, None)
        return FaceMesh(found, irises, lids, sure)

    def _eye_landmarks(
        self, image: ImageArray, points: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Return irises and lids of both eyes in pixels of the image, None if unknown."""
        maps = [_eye_square_map(points, corners) for corners in _EYE_CORNERS]
        placed = [to_image for to_image in maps if to_image is not None]
        if len(placed) < len(maps):
            return None
        crops = [_crop(image, to_image, _IRIS_PX) for to_image in placed]
        seen = [eye for eye in self._eyes.analyze(crops, self._eye_points) or () if eye is not None]
        if len(seen) < len(maps):
            return None
        irises, lids = (
            np.array(
                [_to_image(eye[k], to_image) for eye, to_image in zip(seen, placed, strict=True)]
            )
            for k in (0, 1)
        )
        return irises.astype(np.float32), lids.astype(np.float32)

    def _eye_points(self, crop: ImageArray, which: int) -> EyePoints | None:
        """Return an iris and its lids in pixels of the crop; the right eye is 0."""
        # The network expects right eyes, so the left one is mirrored.
        seen = np.asarray(cv2.flip(crop, 1), np.uint8) if which else crop
        outputs = _run(self._eye, _IRIS_OUTPUTS, seen)
        found = []
        for output, count in zip(outputs, (_OF_IRIS, _OF_LIDS), strict=True):
            grid = output.reshape(-1, 3)[:count, :2].astype(np.float64)
            if not np.isfinite(grid).all():
                return None
            if which:
                grid[:, 0] = _IRIS_PX - 1 - grid[:, 0]
            found.append(grid)
        return found[0], found[1]


def _network(file: ModelFile) -> cv2.dnn.Net:
    with quiet_opencv():
        return cv2.dnn.readNetFromTFLite(np.frombuffer(file.read(), np.uint8))


def _square_map(middle: Floats, side: float, across: Floats, size_px: int) -> Floats:
    """Return the map (2, 3) from pixels of an upright square crop to pixels of the image."""
    angle, scale = atan2(float(across[1]), float(across[0])), side / size_px
    turn = scale * np.array([(cos(angle), -sin(angle)), (sin(angle), cos(angle))])
    return np.column_stack([turn, middle - turn @ np.full(2, 0.5 * (size_px - 1))])


def _eye_square_map(points: NDArray[np.float32], which: tuple[int, int]) -> Floats | None:
    """Return the map (2, 3) from the crop of an eye to pixels of the image, None if invalid."""
    corners = points[list(which), :2].astype(np.float64)
    across = corners[1] - corners[0]
    side = _EYE_SIDE * float(np.hypot(*across))
    return _square_map(corners.mean(axis=0), side, across, _IRIS_PX) if side > 1.0 else None


def _crop(image: ImageArray, to_image: Floats, size_px: int) -> ImageArray:
    """Return a square crop of an image, black beyond the image."""
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, to_image, (size_px, size_px), flags=flags), np.uint8)


def _to_image(grid: NDArray[np.floating], to_image: Floats) -> Floats:
    """Return points of a crop in pixels of the image."""
    return np.asarray(grid @ to_image[:, :2].T + to_image[:, 2], dtype=np.float64)


def _run(
    network: cv2.dnn.Net, outputs: tuple[str, ...], crop: ImageArray
) -> tuple[NDArray[np.float32], ...]:
    """Run a network on a BGR crop; return its outputs flat."""
    network.setInput(cv2.dnn.blobFromImage(crop, 1.0 / 255.0, swapRB=True))
    return tuple(np.asarray(out, np.float32).ravel() for out in network.forward(list(outputs)))

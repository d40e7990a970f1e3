"""Dense meshes of the nearest faces: 468 points of the skin, and the irises, from two networks.

The networks are MediaPipe's face mesh and iris models, run by OpenCV.
"""

from math import atan2, cos, exp, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.types import FaceMesh, ImageArray, Pixels
from gazerig.drivers.vision.model_files import FACE_LANDMARK, IRIS_LANDMARK, ModelFile

Floats = NDArray[np.float64]

# The network for the eyes takes longer than that for the whole face: it runs in every n-th frame.
_EYES_EVERY = 4

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
        self._frames = 0

    def mesh(self, image: ImageArray, landmarks_px: Pixels) -> FaceMesh | None:
        """Return the mesh of a face, None if it is too small or the network finds none.

        Args:
            image: The frame; the eyes are analysed in every fourth one.
            landmarks_px: Landmarks (5, 2) in the order of DetectedFace.
        """
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
        self._frames += 1
        is_due = self._frames % _EYES_EVERY == 1 and apart > _LEAST_IRIS_EYES_PX
        irises, lids = self._eye_landmarks(image, found) if is_due else (None, None)
        return FaceMesh(found, irises, lids, sure)

    def _eye_landmarks(
        self, image: ImageArray, points: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]] | tuple[None, None]:
        """Return irises and lids of both eyes in pixels of the image, None if unknown."""
        irises, lids = [], []
        for eye, corners in enumerate(_EYE_CORNERS):
            inner, outer = points[list(corners), :2].astype(np.float64)
            across = outer - inner
            side = max(1.0, _EYE_SIDE * float(np.hypot(*across)))
            to_image = _square_map((inner + outer) / 2.0, side, across, _IRIS_PX)
            crop = _crop(image, to_image, _IRIS_PX)
            # The network expects right eyes, so the left one is mirrored.
            seen = np.asarray(cv2.flip(crop, 1), np.uint8) if eye else crop
            iris, contour = (out.reshape(-1, 3) for out in _run(self._eye, _IRIS_OUTPUTS, seen))
            found = np.concatenate([iris[:_OF_IRIS, :2], contour[:_OF_LIDS, :2]])
            if not np.isfinite(found).all():
                return None, None
            if eye:
                found[:, 0] = _IRIS_PX - 1 - found[:, 0]
            placed = _to_image(found, to_image).astype(np.float32)
            irises.append(placed[:_OF_IRIS])
            lids.append(placed[_OF_IRIS:])
        return np.array(irises), np.array(lids)


def _network(file: ModelFile) -> cv2.dnn.Net:
    with quiet_opencv():
        return cv2.dnn.readNetFromTFLite(np.frombuffer(file.read(), np.uint8))


def _square_map(middle: Floats, side: float, across: Floats, size_px: int) -> Floats:
    """Return the map (2, 3) from pixels of an upright square crop to pixels of the image."""
    angle, scale = atan2(float(across[1]), float(across[0])), side / size_px
    turn = scale * np.array([(cos(angle), -sin(angle)), (sin(angle), cos(angle))])
    return np.column_stack([turn, middle - turn @ np.full(2, 0.5 * (size_px - 1))])


def _crop(image: ImageArray, to_image: Floats, size_px: int) -> ImageArray:
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, to_image, (size_px, size_px), flags=flags), np.uint8)


def _to_image(grid: NDArray[np.floating], to_image: Floats) -> Floats:
    return np.asarray(grid @ to_image[:, :2].T + to_image[:, 2], dtype=np.float64)


def _run(
    network: cv2.dnn.Net, outputs: tuple[str, ...], crop: ImageArray
) -> tuple[NDArray[np.float32], ...]:
    """Run a network on a BGR crop; return its outputs flat."""
    network.setInput(cv2.dnn.blobFromImage(crop, 1.0 / 255.0, swapRB=True))
    return tuple(np.asarray(out, np.float32).ravel() for out in network.forward(list(outputs)))

"""Faces by YuNet: a network file the user names, run by OpenCV's own decoder."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import largest_first, prepare

_CURE = (
    "get face_detection_yunet_2023mar.onnx or a later one from the OpenCV zoo"
    " and give its path as model_file"
)
# Boxes that share more than this part of their union are the same face, and the most
# boxes looked at: the values OpenCV's zoo runs the network with.
_SAME, _MOST = 0.3, 5000


class YunetDetector:
    """Finds faces with five landmarks."""

    def __init__(self, params: FaceDetectorParams, model_file: str) -> None:
        """Load the network and try it on an empty image.

        Raises:
            ModelFileError: the file is missing or is not YuNet.
        """
        self._params = params
        self._net = _load(model_file, params.min_confidence)

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Find faces, the largest first, in pixels of the image given."""
        prepared = prepare(image, self._params.work_width_px)
        if prepared is None:
            return ()
        height, width = prepared.small.shape[:2]
        if min(height, width) < self._params.min_face_px:
            # No face fits; and OpenCV reads beyond the memory of strips a few pixels wide.
            return ()
        self._net.setInputSize((width, height))
        rows = self._net.detect(prepared.small)[1]
        if rows is None:  # OpenCV's word for no face
            return ()
        return largest_first(
            [
                _face(prepared.stretch, row)
                for row in np.asarray(rows, dtype=np.float64)
                if np.isfinite(row).all() and row[3] >= self._params.min_face_px
            ]
        )


def _load(model_file: str, min_confidence: float) -> cv2.FaceDetectorYN:
    """Make the network out of the file's bytes."""
    if not model_file:
        raise ModelFileError(f"the yunet detector needs a model file: {_CURE}")
    try:
        content = Path(model_file).expanduser().read_bytes()
    except OSError as error:
        raise ModelFileError(
            f"cannot read model file {model_file} ({error.strerror}): {_CURE}"
        ) from error
    weights, nothing = np.frombuffer(content, dtype=np.uint8), np.zeros(0, np.uint8)
    try:
        # Any network loads; only YuNet's outputs can be decoded, so it is tried at once.
        with quiet_opencv():
            net = cv2.FaceDetectorYN.create(
                "onnx", weights, nothing, (64, 64), min_confidence, _SAME, _MOST
            )
            net.detect(np.zeros((64, 64, 3), np.uint8))
    except cv2.error as error:
        raise ModelFileError(f"{model_file} is not a YuNet network: {_CURE}") from error
    return net


def _face(stretch: NDArray[np.float64], row: NDArray[np.float64]) -> DetectedFace:
    """Turn OpenCV's fifteen numbers into a face in pixels of the image given.

    Box, right eye, left eye, nose, right and left mouth corner, confidence; the network
    counts from the outer edge of the first pixel, DetectedFace from its centre.
    """
    left, top, width, height = (row[:4] * np.tile(stretch, 2)).tolist()
    landmarks = row[4:14].reshape(5, 2) * stretch - 0.5
    landmarks.setflags(write=False)
    return DetectedFace((left - 0.5, top - 0.5, width, height), landmarks, float(row[14]))

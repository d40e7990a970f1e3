"""Face detection with YuNet alone: every frame is searched completely."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.params import MIN_CONFIDENCE, MIN_FACE_PX, FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import improve_contrast, prepare, sort_by_size
from gazerig.drivers.vision.model_files import YUNET, yunet_file

_CURE = f"{YUNET.cure}, or name a YuNet file of the OpenCV zoo as model_file"
# Intersection over union above which boxes are the same face, and most boxes: values of the OpenCV
# zoo.
_SAME, _MOST = 0.3, 5000
_CONFIDENCE = 0.7
# Narrower frames are not searched: OpenCV reads beyond the memory of strips a few pixels wide.
_LEAST_PX = 24
# First bytes of other files, and outputs that only YuNet has.
_KINDS = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"PK\x03\x04", "a zip archive (an NNArchive or a PyTorch file)"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"version https://git-lfs", "a Git LFS pointer and not the file itself: run git lfs pull"),
    (b"<", "a web page or XML"),
)


class YunetNetwork:
    """Network that finds faces in an image of any size."""

    def __init__(self, model_file: str) -> None:
        """Load the network and try it on an empty image.

        Raises:
            ModelFileError: the file is missing or is not YuNet.
        """
        if not model_file:
            raise ModelFileError(f"the yunet detector needs a model file: {_CURE}")
        try:
            content = Path(model_file).expanduser().read_bytes()
        except OSError as error:
            raise ModelFileError(
                f"cannot read model file {model_file} ({error.strerror}): {_CURE}"
            ) from error
        if Path(model_file).name == YUNET.file and not YUNET.is_content(content):
            raise ModelFileError(f"{model_file} is damaged or another version: {_CURE}")
        weights, nothing = np.frombuffer(content, dtype=np.uint8), np.zeros(0, np.uint8)
        try:
            # Any network loads, but only YuNet's outputs can be decoded: it is tried immediately.
            with quiet_opencv():
                net = cv2.FaceDetectorYN.create(
                    "onnx", weights, nothing, (64, 64), _CONFIDENCE, _SAME, _MOST
                )
                net.detect(np.zeros((64, 64, 3), np.uint8))
        except cv2.error as error:
            raise ModelFileError(
                f"{model_file} is not a YuNet network but {_file_kind(content)}: {_CURE}"
            ) from error
        self._net = net

    def search(self, scaled: ImageArray, least: float) -> NDArray[np.float64]:
        """Return one row per face with at least this confidence, in OpenCV's pixel edges.

        The fifteen numbers are box, right eye, left eye, nose, right and left mouth corner,
        confidence.
        """
        height, width = scaled.shape[:2]
        if min(height, width) < _LEAST_PX:
            return np.zeros((0, 15))
        self._net.setInputSize((width, height))
        self._net.setScoreThreshold(least)
        rows = self._net.detect(np.ascontiguousarray(improve_contrast(scaled)))[1]
        if rows is None:  # OpenCV's value for no face
            return np.zeros((0, 15))
        found = np.asarray(rows, dtype=np.float64)
        return found[np.isfinite(found).all(axis=1)]


def face_of_row(row: NDArray[np.float64]) -> DetectedFace:
    """Return a face from OpenCV's fifteen numbers, in pixels of an image.

    The network counts from the outer edge of the first pixel, DetectedFace from its centre.
    """
    left, top, width, height = row[:4].tolist()
    landmarks = row[4:14].reshape(5, 2) - 0.5
    landmarks.setflags(write=False)
    return DetectedFace((left - 0.5, top - 0.5, width, height), landmarks, float(row[14]))


def _file_kind(content: bytes) -> str:
    """Return the kind of a file that is not YuNet."""
    if not content:
        return "empty"
    if content[4:8] == b"TFL3":
        return "a TensorFlow Lite network"
    for beginning, kind in _KINDS:
        if content.startswith(beginning):
            return kind
    try:
        with quiet_opencv():
            net = cv2.dnn.readNetFromONNX(np.frombuffer(content, dtype=np.uint8))
            outputs = ", ".join(net.getUnconnectedOutLayersNames())
    except cv2.error:
        return "no ONNX file"
    return f"another ONNX network (outputs {outputs})"


class YunetDetector:
    """Detector of faces with five landmarks."""

    def __init__(self, params: FaceDetectorParams, model_file: str) -> None:
        """Load the network and try it on an empty image.

        Raises:
            ModelFileError: the file is missing or is not YuNet.
        """
        self._params = params
        self._network = YunetNetwork(model_file or yunet_file())

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
        prepared = prepare(image, self._params.work_width_px)
        if prepared is None:
            return ()
        if min(prepared.working_size.shape[:2]) < MIN_FACE_PX:
            return ()  # no face fits
        rows = self._network.search(prepared.working_size, MIN_CONFIDENCE)
        rows = rows[rows[:, 3] >= MIN_FACE_PX]
        rows[:, :14] *= np.tile(prepared.full_per_working, 7)
        return sort_by_size([face_of_row(row) for row in rows])

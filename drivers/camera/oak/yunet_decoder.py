"""Decoder on the host for the outputs of a YuNet that runs on the camera; pure.

Two generations of the network are in use. The later one (OpenCV zoo, 2023 and after) outputs
scores, boxes and landmarks per cell for strides of 8, 16 and 32 px; the earlier one (Luxonis' model
hub) outputs them for anchor boxes of fixed sizes, like SSD. Wu, Peng, Yu, "YuNet: a tiny
millisecond-level face detector", 2023; Liu et al., "SSD: single shot multibox detector", 2016.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STRIDES = (8, 16, 32)
_WIDTHS = {"cls": 1, "obj": 1, "bbox": 4, "kps": 10}  # numbers per cell
_EARLIER = {"loc": 14, "conf": 2, "iou": 1}  # numbers per fixed box
_SIZES_PX = ((8, (10, 16, 24)), (16, (32, 48)), (32, (64, 96)), (64, (128, 192, 256)))
_VARIANCES = 0.1, 0.2
# Boxes with a larger intersection over union are one face; value of the OpenCV zoo.
_SAME = 0.3
_MOST = 50


class DecodedFaces(NamedTuple):
    """Faces in shares of the network's image, the most confident first.

    boxes: (n, 4) left, top, right, bottom; points: (n, 5, 2) in the order of DetectedFace;
    scores: (n,) 0..1
    """

    boxes: Floats
    points: Floats
    scores: Floats


class UnreadableOutputs(ValueError):
    """The outputs are not those of a YuNet; the message contains the difference."""


def output_names_fault(names: Sequence[str]) -> str:
    """Return the missing outputs of a YuNet as text, "" for none."""
    if all(any(kind in name for name in names) for kind in _EARLIER):
        return ""
    missing = [n for kind in _WIDTHS for s in STRIDES if (n := f"{kind}_{s}") not in names]
    return f"it has no outputs {', '.join(missing)}" if missing else ""


def decode(
    tensors: Mapping[str, NDArray[np.float32]], width_px: int, height_px: int, least: float
) -> DecodedFaces:
    """Return the faces in the outputs of one image.

    Args:
        tensors: Outputs by name.
        width_px: Width of the network's image.
        height_px: Height of the network's image.
        least: Smallest score of a face.

    Raises:
        UnreadableOutputs: an output is missing, or of another size.
    """
    if wrong := output_names_fault(list(tensors)):
        raise UnreadableOutputs(wrong)
    size = width_px, height_px
    later = f"cls_{STRIDES[0]}" in tensors
    scores, centres, extents, points = (_decode_cells if later else _decode_fixed_boxes)(
        tensors, size, least
    )
    good = np.isfinite(np.column_stack((scores, centres, extents, points))).all(axis=1)
    scores, centres, extents, points = scores[good], centres[good], extents[good], points[good]
    corners = np.column_stack((centres - 0.5 * extents, extents))
    keep = np.asarray(
        cv2.dnn.NMSBoxes(corners.tolist(), scores.tolist(), least, _SAME), int
    ).ravel()
    keep = keep[:_MOST]
    top_left, bottom_right = (
        corners[keep, :2] / size,
        (corners[keep, :2] + corners[keep, 2:]) / size,
    )
    return DecodedFaces(
        np.hstack((top_left, bottom_right)), points[keep].reshape(-1, 5, 2) / size, scores[keep]
    )


_Found = tuple[Floats, Floats, Floats, Floats]
"""Scores (n,), centres (n, 2), widths and heights (n, 2), landmarks (n, 10), pixels."""


def _decode_cells(
    tensors: Mapping[str, NDArray[np.float32]], size: tuple[int, int], least: float
) -> _Found:
    """Decode cells: offsets and logarithms of sizes in strides."""
    found = []
    for stride in STRIDES:
        columns, lines = size[0] // stride, size[1] // stride
        cls, obj, bbox, kps = (
            _output_table(tensors, f"{kind}_{stride}", width, columns * lines)
            for kind, width in _WIDTHS.items()
        )
        scores = np.sqrt(np.clip(cls, 0.0, 1.0) * np.clip(obj, 0.0, 1.0))[:, 0]
        at = np.nonzero(scores >= least)[0]
        cells = np.column_stack((at % columns, at // columns)).astype(np.float64)
        with np.errstate(over="ignore"):
            extents = np.exp(bbox[at, 2:]) * stride
        points = (kps[at] + np.tile(cells, 5)) * stride
        found.append((scores[at], (cells + bbox[at, :2]) * stride, extents, points))
    a, b, c, d = (np.concatenate(one) for one in zip(*found, strict=True))
    return a, b, c, d


def _decode_fixed_boxes(
    tensors: Mapping[str, NDArray[np.float32]], size: tuple[int, int], least: float
) -> _Found:
    """Decode fixed boxes: offsets in shares of the box, logarithms of its size."""
    boxes = _fixed_boxes(*size)
    names = {kind: next(name for name in tensors if kind in name) for kind in _EARLIER}
    loc, conf, iou = (
        _output_table(tensors, names[kind], width, len(boxes)) for kind, width in _EARLIER.items()
    )
    scores = np.sqrt(np.clip(conf[:, 1], 0.0, 1.0) * np.clip(iou[:, 0], 0.0, 1.0))
    at = np.nonzero(scores >= least)[0]
    centres, sides = boxes[at, :2], boxes[at, 2:]
    with np.errstate(over="ignore"):
        extents = sides * np.exp(loc[at, 2:4] * _VARIANCES[1])
    shifts = loc[at, 4:] * _VARIANCES[0] * np.tile(sides, 5)
    return (
        scores[at],
        centres + loc[at, :2] * _VARIANCES[0] * sides,
        extents,
        np.tile(centres, 5) + shifts,
    )


@cache
def _fixed_boxes(width_px: int, height_px: int) -> Floats:
    """Return centre, width and height of all fixed boxes, (n, 4) pixels, in the network's order."""
    lines, columns = (height_px + 1) // 2 // 2 // 2, (width_px + 1) // 2 // 2 // 2
    found = []
    for stride, sizes in _SIZES_PX:
        y, x, side = np.meshgrid(np.arange(lines), np.arange(columns), sizes, indexing="ij")
        centres = (x.ravel() + 0.5) * stride, (y.ravel() + 0.5) * stride
        found.append(np.column_stack((*centres, side.ravel(), side.ravel())))
        lines, columns = lines // 2, columns // 2
    boxes = np.concatenate(found).astype(np.float64)
    boxes.setflags(write=False)
    return boxes


def _output_table(
    tensors: Mapping[str, NDArray[np.float32]], name: str, width: int, count: int
) -> Floats:
    """Return an output as (count, width), for any order of its axes."""
    found = np.asarray(tensors[name], dtype=np.float64)
    if found.size != count * width:
        raise UnreadableOutputs(
            f"its output {name} has the shape {found.shape}, wanted {count} times {width} numbers"
        )
    if found.ndim == 4 and found.shape[1] == width and found.shape[3] != width:
        found = np.moveaxis(found, 1, 3)  # channels first
    return found.reshape(count, width)


class FoundFaces(NamedTuple):
    """Output of a network's faces.

    output: output of ImgDetections with five key points
    fault: returns why its outputs cannot be read, "" if they can
    """

    output: Any
    fault: Callable[[], str] = str


def yunet_faces(
    dai: Any, pipeline: Any, network_out: Any, size: tuple[int, int], min_confidence: float
) -> FoundFaces:
    """Create the decoder of a network's outputs.

    Args:
        dai: Module depthai.
        pipeline: Pipeline to add the node to.
        network_out: Output of NNData.
        size: Width and height of the network's image, pixels.
        min_confidence: Smallest score of a face.
    """
    faults: list[str] = []

    class YunetDecoder(dai.node.HostNode):  # type: ignore[misc]
        """Decoder of the outputs of each image; unreadable outputs contain no face."""

        # depthai interprets an annotation here as the name of a message.
        def process(self, data):  # type: ignore[no-untyped-def]
            """Return the faces of one message of the network."""
            found = None
            if not faults:  # later outputs have the same fault
                try:
                    names = data.getAllLayerNames()
                    tensors = {name: data.getTensor(name, dequantize=True) for name in names}
                    found = decode(tensors, *size, min_confidence)
                except (UnreadableOutputs, RuntimeError, TypeError) as error:
                    faults.append(" ".join(str(error).split()))
            return detections(dai, found, data)

    node = pipeline.create(YunetDecoder)
    node.link_args(network_out)
    return FoundFaces(node.out, lambda: faults[0] if faults else "")


def detections(dai: Any, found: DecodedFaces | None, data: Any) -> Any:
    """Return faces as a message with time stamps and transformation of the network's message."""
    message = dai.ImgDetections()
    faces = []
    if found is not None:
        for box, points, score in zip(found.boxes, found.points, found.scores, strict=True):
            left, top, right, bottom = map(float, box)
            middle = dai.Point2f(0.5 * (left + right), 0.5 * (top + bottom))
            rect = dai.RotatedRect(middle, dai.Size2f(right - left, bottom - top), 0.0)
            face = dai.ImgDetection(rect, float(score), 0)
            face.setKeypoints(
                [dai.Keypoint(float(x), float(y), 0.0) for x, y in np.asarray(points)]
            )
            faces.append(face)
    message.detections = faces
    message.setTimestamp(data.getTimestamp())
    message.setTimestampDevice(data.getTimestampDevice())
    message.setSequenceNum(data.getSequenceNum())
    transformation = data.getTransformation()
    if transformation is not None:
        message.setTransformation(transformation)
    return message

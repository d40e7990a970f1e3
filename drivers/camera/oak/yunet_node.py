"""YuNet on the camera with its decoder on the host, as one output of faces."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from gazerig.drivers.camera.oak.yunet_decoder import DecodedFaces, UnreadableOutputs, decode


class FoundFaces(NamedTuple):
    """Output of a network's faces.

    out: output of ImgDetections with five key points
    fault: returns why its outputs cannot be read, "" if they can
    """

    out: Any
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

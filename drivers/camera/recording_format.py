"""Format of a camera recording: MCAP messages in JSON that Foxglove's tools can display.

Frames are PNG (exact) or JPEG (small) files inside foxglove.CompressedImage, depth is a 16-bit PNG
of millimetres with 0 where unknown, the lens is foxglove.CameraCalibration (schemas: Foxglove
documentation, message schemas). All messages of one frame have the time of its exposure in the
host's monotonic clock. The image comes last: if it is present, so is the rest. MCAP: mcap.dev/spec.
"""

from typing import Annotated, Any

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.depth_roi import to_metres, to_millimetres
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot, to_bgr

PICTURE, DEPTH, LENS = "/camera/picture", "/camera/depth", "/camera/lens"
"""Topics."""
PROFILE = "gazerig-camera-1"
_FRAME = "camera"


class RecordedTime(msgspec.Struct):
    """Time in the host's monotonic clock: seconds, and nanoseconds below a second."""

    sec: int
    nsec: int


class RecordedImage(msgspec.Struct):
    """Message of an image or of depth; data: a PNG or JPEG file."""

    timestamp: RecordedTime
    frame_id: str
    format: str
    data: bytes


class RecordedLens(msgspec.Struct):
    """Message of a lens; D: k1 k2 p1 p2 k3; K (3, 3), R (3, 3) and P (3, 4), row by row."""

    timestamp: RecordedTime
    frame_id: str
    width: int
    height: int
    distortion_model: str
    D: Annotated[list[float], msgspec.Meta(min_length=5, max_length=5)]
    K: Annotated[list[float], msgspec.Meta(min_length=9, max_length=9)]
    R: list[float]
    P: list[float]


TYPES: dict[str, tuple[str, type[msgspec.Struct]]] = {
    PICTURE: ("foxglove.CompressedImage", RecordedImage),
    DEPTH: ("foxglove.CompressedImage", RecordedImage),
    LENS: ("foxglove.CameraCalibration", RecordedLens),
}
"""Topic -> name and type of its messages."""
# Level 1 of 9 is hardly larger than the best and many times as fast; RLE suits colour best.
_DEPTH_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 1]
_COLOUR_PNG = [*_DEPTH_PNG, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]


def schema_of(kind: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the JSON schema of messages, without references, which viewers cannot follow."""
    _, parts = msgspec.json.schema_components([kind, RecordedTime])
    schema: dict[str, Any] = parts[kind.__name__]
    schema["properties"]["timestamp"] = parts[RecordedTime.__name__]
    return schema


def nanoseconds(time_s: float) -> int:
    """Return a time in nanoseconds, as in MCAP."""
    return round(time_s * 1e9)


def encode_shot(shot: Shot) -> list[tuple[str, bytes]]:
    """Encode a frame and its data as messages, the image last."""
    stamp = RecordedTime(*divmod(nanoseconds(shot.captured_s), 1_000_000_000))
    found: list[tuple[str, msgspec.Struct]] = []
    if shot.lens is not None:
        height, width = shot.image.shape[:2]
        K = shot.lens.matrix
        lens = RecordedLens(
            stamp,
            _FRAME,
            width,
            height,
            "plumb_bob",
            list(shot.lens.distortion),
            K.ravel().tolist(),
            np.eye(3).ravel().tolist(),
            np.column_stack((K, np.zeros(3))).ravel().tolist(),
        )
        found.append((LENS, lens))
    if shot.depth_m is not None:
        found.append((DEPTH, _encode_image(stamp, to_millimetres(shot.depth_m), _DEPTH_PNG)))
    found.append((PICTURE, _encode_image(stamp, shot.image, _COLOUR_PNG)))
    return [(topic, msgspec.json.encode(message)) for topic, message in found]


def decode_shot(messages: dict[str, bytes]) -> Shot:
    """Read the messages of a frame, by topic; its time and number are 0.

    Raises:
        ValueError: a message lacks contents that its topic requires; the text names the error.
    """
    try:
        image = to_bgr(_decode_image(messages[PICTURE]))
        depth = _decode_image(messages[DEPTH]) if DEPTH in messages else None
        lens = _decode_lens(messages[LENS]) if LENS in messages else None
    except (msgspec.MsgspecError, cv2.error) as error:
        raise ValueError(str(error)) from error
    if image is None:
        raise ValueError("no image in it")
    if depth is not None and (depth.dtype != np.uint16 or depth.ndim != 2):
        raise ValueError("no 16-bit depth image in it")
    return Shot(0.0, 0, image, None if depth is None else to_metres(depth), lens)


def _encode_image(stamp: RecordedTime, pixels: NDArray[Any], how: list[int]) -> RecordedImage:
    _, file = cv2.imencode(".png", pixels, how)
    return RecordedImage(stamp, _FRAME, "png", bytes(file))


def _decode_image(data: bytes) -> NDArray[Any]:
    file = msgspec.json.decode(data, type=RecordedImage).data
    found = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_UNCHANGED)
    if found is None:
        raise ValueError("no image in it")
    return np.asarray(found)


def _decode_lens(data: bytes) -> Intrinsics:
    lens = msgspec.json.decode(data, type=RecordedLens)
    k1, k2, p1, p2, k3 = lens.D
    return Intrinsics(lens.K[0], lens.K[4], lens.K[2], lens.K[5], (k1, k2, p1, p2, k3))

"""Format of a camera recording: MCAP messages in JSON that Foxglove's tools can display.

Frames are PNG (exact) or JPEG (small) files inside foxglove.CompressedImage, depth is a 16-bit PNG
of millimetres with 0 where unknown, the lens is foxglove.CameraCalibration (schemas: Foxglove
documentation, message schemas). All messages of one frame have the time of its exposure in the
host's monotonic clock. The image comes last: if it is present, so is the rest. MCAP: mcap.dev/spec.
"""

import base64
import json
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.depth_roi import to_metres, to_millimetres
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot, to_bgr
from gazerig.drivers.types import Depth, ImageArray

PICTURE, DEPTH, LENS = "/camera/picture", "/camera/depth", "/camera/lens"
"""Topics."""
PROFILE = "gazerig-camera-1"
_FRAME = "camera"
_NUMBER = {"type": "number"}
_TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_IMAGE = {
    "type": "object",
    "properties": {
        "timestamp": _TIME,
        "frame_id": {"type": "string"},
        "format": {"type": "string"},
        "data": {"type": "string", "contentEncoding": "base64"},
    },
}
_MATRIX = {"type": "array", "items": _NUMBER}
SCHEMAS: dict[str, tuple[str, dict[str, Any]]] = {
    PICTURE: ("foxglove.CompressedImage", _IMAGE),
    DEPTH: ("foxglove.CompressedImage", _IMAGE),
    LENS: (
        "foxglove.CameraCalibration",
        {
            "type": "object",
            "properties": {
                "timestamp": _TIME,
                "frame_id": {"type": "string"},
                "width": {"type": "integer"},
                "height": {"type": "integer"},
                "distortion_model": {"type": "string"},
                "D": _MATRIX,
                "K": _MATRIX,
                "R": _MATRIX,
                "P": _MATRIX,
            },
        },
    ),
}
"""Topic -> name and JSON schema of its messages."""
# Level 1 of 9 is hardly larger than the best and many times as fast; RLE suits colour best.
_DEPTH_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 1]
_COLOUR_PNG = [*_DEPTH_PNG, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]


class BadMessage(ValueError):
    """A message lacks contents that its topic requires; the text names the error."""


def nanoseconds(time_s: float) -> int:
    """Return a time in nanoseconds, as in MCAP."""
    return round(time_s * 1e9)


def encode_shot(shot: Shot) -> list[tuple[str, bytes]]:
    """Encode a frame and its data as messages, the image last."""
    stamp = nanoseconds(shot.captured_s)
    found: list[tuple[str, bytes]] = []
    if shot.lens is not None:
        fx, fy, cx, cy = shot.lens.fx_px, shot.lens.fy_px, shot.lens.cx_px, shot.lens.cy_px
        lens = {
            "timestamp": _time_stamp(stamp),
            "frame_id": _FRAME,
            "width": shot.image.shape[1],
            "height": shot.image.shape[0],
            "distortion_model": "plumb_bob",
            "D": list(shot.lens.distortion),
            "K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            "P": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        }
        found.append((LENS, _dump(lens)))
    if shot.depth_m is not None:
        file = _encode_file(".png", to_millimetres(shot.depth_m), _DEPTH_PNG)
        found.append((DEPTH, _dump(_image_message("png", file, stamp))))
    file = _encode_file(".png", shot.image, _COLOUR_PNG)
    found.append((PICTURE, _dump(_image_message("png", file, stamp))))
    return found


def decode_image(data: bytes) -> ImageArray:
    """Read a frame message.

    Raises:
        BadMessage: it contains no frame.
    """
    pixels = to_bgr(_decode_file(data))
    if pixels is None:
        raise BadMessage("no image in it")
    return pixels


def decode_depth(data: bytes) -> Depth:
    """Read a depth message.

    Raises:
        BadMessage: it contains no 16-bit frame.
    """
    mm = _decode_file(data)
    if mm.dtype != np.uint16 or mm.ndim != 2:
        raise BadMessage("no 16-bit depth image in it")
    return to_metres(mm)


def decode_lens(data: bytes) -> Intrinsics:
    """Read a lens message.

    Raises:
        BadMessage: it contains no camera matrix.
    """
    K = np.asarray(_load(data, "K"), dtype=np.float64)
    if K.shape != (9,) or not np.isfinite(K).all() or K[0] <= 0.0 or K[4] <= 0.0:
        raise BadMessage("no camera matrix in it")
    D = np.asarray(_load(data, "D"), dtype=np.float64)
    if D.shape != (5,) or not np.isfinite(D).all():
        raise BadMessage("no five numbers of distortion in it")
    k1, k2, p1, p2, k3 = D.tolist()
    return Intrinsics(float(K[0]), float(K[4]), float(K[2]), float(K[5]), (k1, k2, p1, p2, k3))


def _image_message(kind: str, file: bytes, stamp: int) -> dict[str, Any]:
    return {
        "timestamp": _time_stamp(stamp),
        "frame_id": _FRAME,
        "format": kind,
        "data": base64.b64encode(file).decode("ascii"),
    }


def _time_stamp(nanoseconds_: int) -> dict[str, int]:
    sec, nsec = divmod(nanoseconds_, 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def _encode_file(ending: str, pixels: NDArray[Any], how: list[int]) -> bytes:
    _, file = cv2.imencode(ending, pixels, how)
    return bytes(file)


def _dump(message: dict[str, Any]) -> bytes:
    return json.dumps(message, separators=(",", ":")).encode("ascii")


def _load(data: bytes, key: str) -> Any:
    try:
        return json.loads(data)[key]
    except (ValueError, KeyError, TypeError) as error:
        raise BadMessage(f"no {key} in it") from error


def _decode_file(data: bytes) -> NDArray[Any]:
    """Decode the file inside an image message."""
    try:
        file = base64.b64decode(_load(data, "data"), validate=True)
        found = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_UNCHANGED)
    except (ValueError, TypeError, cv2.error) as error:
        raise BadMessage("no image in it") from error
    if found is None:
        raise BadMessage("no image in it")
    return found

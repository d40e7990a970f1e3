"""Parameters of an OAK-D camera."""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class OakParams:
    """Size and rate of the frames, how stereo depth is found, and where faces are found."""

    # fmt: off
    device: Annotated[str, "device id or IP address, if there are several cameras; empty: the first one found"] = ""
    width_px: Annotated[int, Bounds(128, 4056), "image width, a multiple of 16"] = 640
    height_px: Annotated[int, Bounds(128, 3040), "image height, a multiple of 2"] = 400
    rate_hz: Annotated[float, Bounds(1, 120), "frame rate"] = 30.0
    depth: Annotated[bool, "measure distances with the stereo pair, aligned with the colour image"] = True
    stereo_preset: Annotated[Literal["default", "face", "robotics", "high_detail", "density", "accuracy", "fast_density", "fast_accuracy"],
        "preset of depthai's StereoDepth node"] = "robotics"
    extended_disparity: Annotated[bool, "halve the shortest measurable distance, to 35 cm on an OAK-D"] = True
    subpixel: Annotated[bool, "finer resolution of distances, noticeable beyond 2 m"] = True
    left_right_check: Annotated[bool, "discard distances on which the two stereo cameras disagree"] = True
    dot_projector: Annotated[float, Bounds(0, 1),
        "brightness of the infrared dot projector of Pro models (helps on bare walls), as a share of its maximum"] = 0.0
    face_model: Annotated[str,
        "path of an NNArchive of a face detector with five landmarks that runs on the camera; empty: faces are detected on the host"] = ""
    min_confidence: Annotated[float, Bounds(0.05, 1), "faces detected on the camera with a lower confidence are discarded"] = 0.7
    usb2: Annotated[Literal["warn", "refuse"], "reaction to a USB 2 cable or port, which cannot carry the full frame rate"] = "warn"
    silence_ms: Annotated[float, Bounds(100, 60000), "a camera that delivers no frame for longer is considered lost"] = 2000.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "shortest delay from exposure to arrival; used only if the camera's clock is not synchronised with the host's"] = 20.0
    # fmt: on

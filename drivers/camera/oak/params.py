"""What an OAK-D camera can be told."""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class OakParams:
    """Size and rate of the pictures, how stereo depth is found, and where faces are found."""

    # fmt: off
    device: Annotated[str, "device id or IP address where there are several; empty takes the first"] = ""
    width_px: Annotated[int, Bounds(128, 4056), "width, a multiple of 16"] = 640
    height_px: Annotated[int, Bounds(128, 3040), "height, a multiple of 2"] = 400
    rate_hz: Annotated[float, Bounds(1, 120), "pictures a second"] = 30.0
    depth: Annotated[bool, "measure distances with the stereo pair, aligned with the colour"] = True
    stereo_preset: Annotated[Literal["default", "face", "robotics", "high_detail", "density", "accuracy", "fast_density", "fast_accuracy"],
        "preset of depthai's StereoDepth node"] = "robotics"
    extended_disparity: Annotated[bool, "measure from half the usual least distance on (35 cm on an OAK-D)"] = True
    subpixel: Annotated[bool, "finer steps of distance, which matter beyond 2 m"] = True
    left_right_check: Annotated[bool, "drop distances that the two cameras do not agree on"] = True
    dot_projector: Annotated[float, Bounds(0, 1), "infrared dots of the Pro models for bare walls, as a share of the most"] = 0.0
    face_model: Annotated[str,
        "path of an NNArchive of a face detector with five landmarks that runs on the camera; empty finds faces on the host"] = ""
    min_confidence: Annotated[float, Bounds(0.05, 1), "faces that the camera is less sure of are dropped"] = 0.7
    usb2: Annotated[Literal["warn", "refuse"], "what to do on a USB 2 cable or port, which cannot carry the full rate"] = "warn"
    silence_ms: Annotated[float, Bounds(100, 60000), "a camera without a picture for longer counts as lost"] = 2000.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "least time from exposure to arrival; used only where the camera does not keep its clock in step with the host's"] = 20.0
    # fmt: on

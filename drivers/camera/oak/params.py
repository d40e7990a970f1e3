"""Parameters of an OAK-D camera."""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class OakParams:
    """Parameters of frames, stereo depth and face detection on the camera."""

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
    undistort: Annotated[bool, "remove the distortion of the lens on the camera; false: frames keep it"] = True
    exposure_limit_ms: Annotated[float | None, Bounds(0.1, 33),
        "longest exposure: shorter ones blur less while the head turns but need more light; null: chosen by the camera"] = None
    anti_flicker: Annotated[Literal["default", "off", "50hz", "60hz", "auto"],
        "exposure times that are whole periods of the mains, to avoid stripes under lamps; default: chosen by the camera"] = "default"
    focus: Annotated[int | None, Bounds(0, 255), "fixed position of the lens, larger for nearer objects; null: autofocus"] = None
    dot_projector: Annotated[float, Bounds(0, 1),
        "brightness of the infrared dot projector of Pro models (helps on bare walls), as a share of its maximum"] = 0.0
    face_model: Annotated[str,
        "path of an NNArchive of a face detector that runs on the camera: YuNet, or YOLO with five key points; empty: faces are "
        "detected on the host"] = ""
    min_confidence: Annotated[float, Bounds(0.05, 1), "faces detected on the camera with a lower confidence are discarded"] = 0.7
    usb2: Annotated[Literal["warn", "refuse"], "reaction to a USB 2 cable or port, which cannot carry the full frame rate"] = "warn"
    silence_ms: Annotated[float, Bounds(100, 60000), "a camera that delivers no frame for longer is considered lost"] = 2000.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "shortest delay from exposure to arrival; used only if the camera's clock is not synchronised with the host's"] = 20.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the settings are consistent.

        Raises:
            ValueError: an invalid frame size, or an exposure longer than a frame period.
        """
        if self.width_px % 16 or self.height_px % 2:
            raise ValueError(
                f"frames of {self.width_px} x {self.height_px} px are impossible: width_px must be a multiple "
                f"of 16 and height_px of 2, such as {self.width_px // 16 * 16} x {self.height_px // 2 * 2}"
            )
        if self.exposure_limit_ms is not None and self.exposure_limit_ms * self.rate_hz > 1e3:
            raise ValueError(
                f"exposure_limit_ms {self.exposure_limit_ms:g} is longer than a frame lasts at "
                f"rate_hz {self.rate_hz:g}: at most {1e3 / self.rate_hz:.1f}"
            )

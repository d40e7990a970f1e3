"""What an OAK-D camera can be told."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class OakParams:
    """Size and rate of the pictures, how stereo depth is found, and where faces are found."""

    device: str = field(
        default="",
        metadata={"says": "device id or IP address where there are several; empty takes the first"},
    )
    width_px: int = field(
        default=640,
        metadata={"low": 128, "high": 4056, "unit": "px", "says": "width, a multiple of 16"},
    )
    height_px: int = field(
        default=400,
        metadata={"low": 128, "high": 3040, "unit": "px", "says": "height, a multiple of 2"},
    )
    rate_hz: float = field(
        default=30.0,
        metadata={"low": 1.0, "high": 120.0, "unit": "Hz", "says": "pictures a second"},
    )
    depth: bool = field(
        default=True,
        metadata={"says": "measure distances with the stereo pair, aligned with the colour"},
    )
    stereo_preset: str = field(
        default="robotics",
        metadata={
            "choices": (
                "default",
                "face",
                "robotics",
                "high_detail",
                "density",
                "accuracy",
                "fast_density",
                "fast_accuracy",
            ),
            "says": "preset of depthai's StereoDepth node",
        },
    )
    extended_disparity: bool = field(
        default=True,
        metadata={"says": "measure from half the usual least distance on (35 cm on an OAK-D)"},
    )
    subpixel: bool = field(
        default=True,
        metadata={"says": "finer steps of distance, which matter beyond 2 m"},
    )
    left_right_check: bool = field(
        default=True,
        metadata={"says": "drop distances that the two cameras do not agree on"},
    )
    dot_projector: float = field(
        default=0.0,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "infrared dots of the Pro models for bare walls, as a share of the most",
        },
    )
    face_model: str = field(
        default="",
        metadata={
            "says": "path of an NNArchive of a face detector with five landmarks that runs on "
            "the camera; empty finds faces on the host"
        },
    )
    min_confidence: float = field(
        default=0.7,
        metadata={
            "low": 0.05,
            "high": 1.0,
            "unit": "",
            "says": "faces that the camera is less sure of are dropped",
        },
    )
    usb2: str = field(
        default="warn",
        metadata={
            "choices": ("warn", "refuse"),
            "says": "what to do on a USB 2 cable or port, which cannot carry the full rate",
        },
    )
    silence_ms: float = field(
        default=2000.0,
        metadata={
            "low": 100.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "a camera without a picture for longer counts as lost",
        },
    )
    latency_ms: float = field(
        default=20.0,
        metadata={
            "low": 0.0,
            "high": 1000.0,
            "unit": "ms",
            "says": "least time from exposure to arrival; used only where the camera does not "
            "keep its clock in step with the host's",
        },
    )

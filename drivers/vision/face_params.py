"""What every face detector can be told."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class FaceDetectorParams:
    """Which network looks for faces, and how small, how sure and how thorough it is."""

    kind: str = field(
        default="mtcnn",
        metadata={
            "choices": ("mtcnn", "yunet"),
            "says": "network: mtcnn is installed with the program, yunet needs model_file",
        },
    )
    model_file: str = field(
        default="",
        metadata={"says": "path of the YuNet .onnx file; empty for mtcnn"},
    )
    work_width_px: int = field(
        default=320,
        metadata={
            "low": 64,
            "high": 4096,
            "unit": "px",
            "says": "wider pictures are scaled down to this width before the search",
        },
    )
    min_face_px: int = field(
        default=24,
        metadata={
            "low": 12,
            "high": 1000,
            "unit": "px",
            "says": "smallest face height looked for, measured in the scaled-down picture",
        },
    )
    min_confidence: float = field(
        default=0.7,
        metadata={"low": 0.1, "high": 1.0, "unit": "", "says": "faces less sure are dropped"},
    )

"""Which face detector, and its parameters.

Landmarks are in pixels of the picture given, also where a smaller one is searched.
Pixels have their centres at whole numbers: (0, 0) is the middle of the top left pixel,
so a picture of width w reaches from -0.5 to w - 0.5.
"""

from dataclasses import dataclass, field

from drivers.errors import ModelFileError
from drivers.face_mtcnn import MtcnnDetector
from drivers.face_yunet import YunetDetector
from drivers.types import FaceDetector


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


def face_detector(params: FaceDetectorParams) -> FaceDetector:
    """Make the detector that the parameters name.

    Raises:
        drivers.errors.ModelFileError: its model file is missing or not what it should be.
    """
    if params.kind == "mtcnn":
        return MtcnnDetector(params)
    if params.kind == "yunet":
        return YunetDetector(params, params.model_file)
    raise ModelFileError(f"no face detector is called {params.kind!r}: use 'mtcnn' or 'yunet'")

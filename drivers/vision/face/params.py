"""Parameters of every face detector."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds, Choices


@dataclass(frozen=True)
class FaceDetectorParams:
    """Which network looks for faces, and how small, how sure and how thorough it is."""

    # fmt: off
    kind: Annotated[str, Choices("mtcnn", "yunet"),
        "detection network: mtcnn is installed with the program, yunet needs model_file"] = "mtcnn"
    model_file: Annotated[str, "path of the YuNet .onnx file; empty for mtcnn"] = ""
    work_width_px: Annotated[int, Bounds(64, 4096), "wider frames are scaled down to this width before detection"] = 320
    min_face_px: Annotated[int, Bounds(12, 1000), "smallest face height that is detected, in pixels of the scaled-down frame"] = 24
    min_confidence: Annotated[float, Bounds(0.1, 1), "faces detected with a lower confidence are discarded"] = 0.7
    # fmt: on

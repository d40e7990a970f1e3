"""Parameters of every detector of faces, people and palms."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds, Choices


@dataclass(frozen=True)
class FaceDetectorParams:
    """Parameters of the networks that search for faces, people and palms."""

    # fmt: off
    kind: Annotated[str, Choices("auto", "mtcnn", "yunet"),
        "auto searches some frames and places known faces in all; mtcnn and yunet (needs its file) search each"] = "auto"
    model_file: Annotated[str, "path of the YuNet .onnx file; empty: the one of gazerig models fetch"] = ""
    work_width_px: Annotated[int, Bounds(64, 4096), "wider frames are scaled down to this width before detection"] = 320
    min_face_px: Annotated[int, Bounds(12, 1000), "smallest face height that is detected, in pixels of the scaled-down frame"] = 24
    min_confidence: Annotated[float, Bounds(0.1, 1), "faces detected with a lower confidence are discarded"] = 0.7
    keep_confidence: Annotated[float, Bounds(0.05, 1), "auto: a known face is dropped when its confidence falls below this"] = 0.5
    search_every: Annotated[int, Bounds(1, 100),
        "auto: number of frames between two searches of the whole frame; half as many while no face is known"] = 4
    far_width_px: Annotated[int, Bounds(0, 4096),
        "auto: width of the frame in which far faces of 12 pixels are searched, tile by tile; 0: none"] = 768
    mesh_faces: Annotated[int, Bounds(0, 4),
        "number of faces, the largest first, whose pose, gaze, lids and lips a dense mesh measures; needs gazerig models fetch mesh"] = 0
    people_hz: Annotated[float, Bounds(0, 30),
        "searches per second for people whose face is not visible; 0: none; needs gazerig models fetch people and gazerig[people]"] = 2.0
    people_confidence: Annotated[float, Bounds(0.1, 1), "people detected with a lower confidence are discarded"] = 0.6
    hands_hz: Annotated[float, Bounds(0, 30),
        "searches per second for palms of the nearest person; 0: none; needs gazerig models fetch hands and gazerig[people]"] = 5.0
    # fmt: on

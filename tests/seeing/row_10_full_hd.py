"""Cost of faces in full HD: only the input of a network is converted."""

import tracemalloc

from seeing.material import background, eyes_at, paste, portrait
from seeing.row_03_far_faces import relative_cost

from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams

WANTED = {
    "memory taken by a frame, of the frame's own": (0, 0.5),
    "processor time over that of MTCNN": (0, 0.6),
}


def measure(full: bool) -> dict[str, float]:
    """Return the figures."""
    frame = background(1920, 1080).copy()
    paste(frame, portrait("astronaut"), (900.0, 500.0), eyes_at(1.5, 1920, 69.0))
    detector = face_detector(FaceDetectorParams())
    detector.find(frame)
    tracemalloc.start()
    for _ in range(6):
        detector.find(frame)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    figures = {"memory taken by a frame, of the frame's own": peak / float(frame.nbytes)}
    if full:
        figures["processor time over that of MTCNN"] = relative_cost(1920, 1080)
    return figures

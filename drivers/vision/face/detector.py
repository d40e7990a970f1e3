"""Choice of the face detector.

Landmarks are in pixels of the given image, even if a smaller one is searched. Pixels have their
centres at whole numbers: (0, 0) is the centre of the top left pixel, so an image of width w extends
from -0.5 to w - 0.5.
"""

from typing import cast

from gazerig.drivers.plugins import DETECTOR, DetectorPlugin, create, is_ours, load
from gazerig.drivers.types import FaceDetector
from gazerig.drivers.vision.body_detector import add_body_detection
from gazerig.drivers.vision.face.params import FaceDetectorParams


def _auto(params: FaceDetectorParams) -> FaceDetector:
    """Create our detector; this imports OpenCV."""
    from gazerig.drivers.vision.face.auto import AutoDetector

    return AutoDetector(params)


AUTO = DetectorPlugin(_auto, FaceDetectorParams)


def face_detector(params: FaceDetectorParams) -> FaceDetector:
    """Create the detector set in the parameters, with a mesh, people and palms if wanted.

    Raises:
        ModelFileError: a model file is missing or damaged.
        PluginError: the detector of another package cannot be created.
    """
    part = load(DETECTOR, params.kind, DetectorPlugin)
    if is_ours(DETECTOR, params.kind):
        detector = cast(FaceDetector, part.make(params))
    else:
        detector = create(DETECTOR, params.kind, part, params.plugins[params.kind])
    return add_body_detection(detector, params)

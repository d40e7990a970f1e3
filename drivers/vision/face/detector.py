"""Which face detector.

Landmarks are in pixels of the image given, also where a smaller one is searched.
Pixels have their centres at whole numbers: (0, 0) is the middle of the top left pixel,
so a image of width w reaches from -0.5 to w - 0.5.
"""

from gazerig.drivers.errors import ModelFileError
from gazerig.drivers.types import FaceDetector
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.face.yunet import YunetDetector


def face_detector(params: FaceDetectorParams) -> FaceDetector:
    """Make the detector that the parameters name.

    Raises:
        ModelFileError: its model file is missing or not what it should be.
    """
    if params.kind == "mtcnn":
        return MtcnnDetector(params)
    if params.kind == "yunet":
        return YunetDetector(params, params.model_file)
    raise ModelFileError(f"no face detector is called {params.kind!r}: use 'mtcnn' or 'yunet'")

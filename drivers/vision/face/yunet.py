"""Face detection with YuNet alone: every frame is searched completely."""

import numpy as np

from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import largest_first, prepare
from gazerig.drivers.vision.face.yunet_network import YunetNetwork, face_of_row
from gazerig.drivers.vision.model_files import yunet_file


class YunetDetector:
    """Detector of faces with five landmarks."""

    def __init__(self, params: FaceDetectorParams, model_file: str) -> None:
        """Load the network and try it on an empty image.

        Raises:
            ModelFileError: the file is missing or is not YuNet.
        """
        self._params = params
        self._network = YunetNetwork(model_file or yunet_file())

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
        prepared = prepare(image, self._params.work_width_px)
        if prepared is None:
            return ()
        smallest = self._params.min_face_px
        if min(prepared.small.shape[:2]) < smallest:
            return ()  # no face fits
        rows = self._network.search(prepared.small, self._params.min_confidence)
        rows = rows[rows[:, 3] >= smallest]
        rows[:, :14] *= np.tile(prepared.stretch, 7)
        return largest_first([face_of_row(row) for row in rows])

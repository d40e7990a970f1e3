"""Archives of face networks for the camera's chip, and their check."""

from pathlib import Path
from typing import Any, Literal

from gazerig.drivers.camera.oak.yunet_decoder import STRIDES, fault_of_names
from gazerig.drivers.errors import CameraError

FaceNet = Literal["yunet", "yolo"]

LANDMARKS = 5
_CURE = (
    "take an archive of YuNet, or of a YOLO with five key points, that was converted for {chip} "
    "(Luxonis' model hub has them), or leave oak.face_model empty"
)


class UnusableModel(CameraError):
    """An archive that this camera cannot use; the message contains reason and remedy."""


def read_archive(dai: Any, path: str) -> Any:
    """Read a network for the camera from a local NNArchive.

    Raises:
        CameraError: there is no such file.
        UnusableModel: it is no archive.
    """
    file = Path(path).expanduser()
    if not file.is_file():
        raise CameraError(f"no face model at {file}: give the path of an NNArchive (.tar.xz)")
    try:
        return dai.NNArchive(str(file))
    except (RuntimeError, ValueError) as error:
        raise UnusableModel(
            f"{file} is no NNArchive ({' '.join(str(error).split())}): "
            + _CURE.format(chip="this camera's chip")
        ) from error


def kind_of(archive: Any, platform: Any, file: str) -> FaceNet:
    """Return the kind of network in an archive.

    Args:
        archive: The archive.
        platform: The camera's chip, a dai.Platform.
        file: The archive's path, for messages.

    Raises:
        UnusableModel: it is for another chip, or does not detect faces with five landmarks.
    """
    wrong = _made_for_another(archive, platform)
    heads = archive.getConfig().model.heads or []
    parsers = [str(head.parser) for head in heads]
    kind: FaceNet | None = None
    if not wrong:
        if len(heads) != 1:
            wrong = f"its description has {len(heads)} heads, wanted 1"
        elif "yunet" in parsers[0].lower():
            wrong = _yunet_fault(archive)
            kind = None if wrong else "yunet"
        elif "yolo" in parsers[0].lower():
            points = heads[0].metadata.nKeypoints or 0
            if points == LANDMARKS:
                kind = "yolo"
            else:
                wrong = f"it finds {points} key points, wanted {LANDMARKS}"
        else:
            wrong = f"its outputs are read by {parsers[0]}, wanted YuNet or YOLO"
    if kind is None:
        raise UnusableModel(
            f"the face model {file} cannot be used: {wrong}; {_CURE.format(chip=platform.name)}"
        )
    return kind


def _yunet_fault(archive: Any) -> str:
    """Return why the network of an archive is no YuNet, "" if it is."""
    names = [str(output.name) for output in archive.getConfig().model.outputs]
    if wrong := fault_of_names(names):
        return wrong
    size = archive.getInputSize()
    if size is None or size[0] % STRIDES[-1] or size[1] % STRIDES[-1]:
        return f"its frames of {size} are no multiples of {STRIDES[-1]} px"
    return ""


def _made_for_another(archive: Any, platform: Any) -> str:
    """Return why an archive does not run on a chip, "" if it does."""
    chips = list(archive.getSupportedPlatforms())
    if not chips:
        return "its network is not converted for the chip of an OAK camera"
    if platform not in chips:
        return f"it is made for {', '.join(chip.name for chip in chips)}, this is {platform.name}"
    return ""

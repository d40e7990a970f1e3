"""Archives of face networks that run on the camera."""

from pathlib import Path
from typing import Any, Literal

from gazerig.drivers.camera.oak.yunet_decoder import STRIDES, output_names_fault
from gazerig.drivers.errors import CameraError

FaceNet = Literal["yunet", "yolo"]

LANDMARKS = 5
_CURE = (
    "take an archive of YuNet, or of a YOLO with five key points, that was converted for {chip} "
    "(Luxonis' model hub has them), or leave oak.face_model empty"
)


def read_archive(dai: Any, path: str) -> Any:
    """Read a network for the camera from a local NNArchive.

    Raises:
        CameraError: there is no such file, or it is not an archive.
    """
    file = Path(path).expanduser()
    if not file.is_file():
        raise CameraError(f"no face model at {file}: give the path of an NNArchive (.tar.xz)")
    try:
        return dai.NNArchive(str(file))
    except (RuntimeError, ValueError) as error:
        raise CameraError(
            f"{file} is not an NNArchive ({' '.join(str(error).split())}): "
            + _CURE.format(chip="this camera's chip")
        ) from error


def kind_of(archive: Any, platform: Any, file: str) -> FaceNet:
    """Return the kind of network in an archive.

    Args:
        archive: The archive.
        platform: The camera's chip, a dai.Platform.
        file: The archive's path, for messages.

    Raises:
        CameraError: it is for another chip, or does not detect faces with five landmarks.
    """
    chips, wrong = list(archive.getSupportedPlatforms()), ""
    if not chips:
        wrong = "its network is not converted for the chip of an OAK camera"
    elif platform not in chips:
        wrong = f"it is made for {', '.join(chip.name for chip in chips)}, this is {platform.name}"
    heads = archive.getConfig().model.heads or []
    parsers = [str(head.parser) for head in heads]
    kind: FaceNet | None = None
    if not wrong:
        if len(heads) != 1:
            wrong = f"its description has {len(heads)} heads, wanted 1"
        elif "yunet" in parsers[0].lower():
            outputs = archive.getConfig().model.outputs
            wrong = output_names_fault([str(output.name) for output in outputs])
            size = archive.getInputSize()
            if not wrong and (size is None or size[0] % STRIDES[-1] or size[1] % STRIDES[-1]):
                wrong = f"its frames of {size} are not multiples of {STRIDES[-1]} px"
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
        raise CameraError(
            f"the face model {file} cannot be used: {wrong}; {_CURE.format(chip=platform.name)}"
        )
    return kind

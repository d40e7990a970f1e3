"""Removal and report of settings that a camera does not support."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.yunet_decoder import STRIDES, output_names_fault
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
        UnusableModel: it is not an archive.
    """
    file = Path(path).expanduser()
    if not file.is_file():
        raise CameraError(f"no face model at {file}: give the path of an NNArchive (.tar.xz)")
    try:
        return dai.NNArchive(str(file))
    except (RuntimeError, ValueError) as error:
        raise UnusableModel(
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
        UnusableModel: it is for another chip, or does not detect faces with five landmarks.
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
        raise UnusableModel(
            f"the face model {file} cannot be used: {wrong}; {_CURE.format(chip=platform.name)}"
        )
    return kind


_USB2_BYTES_S = 30e6
"""Capacity of a USB 2 line for frames."""
_COLOUR_BYTES, _DEPTH_BYTES = 1.5, 2.0  # per pixel, NV12 and RAW16


def supported_settings(
    dai: Any, device: Any, params: OakParams
) -> tuple[OakParams, tuple[str, ...]]:
    """Return the supported settings, and one line for each omitted one.

    Raises:
        CameraError: it has no colour camera, or the file of the face model is absent.
    """
    sockets = set(device.getConnectedCameras())
    socket, label = dai.CameraBoardSocket, device.getDeviceName() or "this OAK camera"
    if socket.CAM_A not in sockets:
        raise CameraError(
            f"{label} has no camera at socket CAM_A, from which frames are taken: "
            "use a model with a colour camera, such as OAK-D or OAK-1"
        )
    events = []
    if params.depth and (why := _stereo_fault(dai, device, sockets)):
        events.append(
            f"{label} measures no distances: {why}; they are estimated from the size of faces; "
            "set oak.depth: false in the rig"
        )
        params = replace(params, depth=False)
    if params.face_model:
        try:
            archive = read_archive(dai, params.face_model)
            kind_of(archive, device.getPlatform(), params.face_model)
        except UnusableModel as error:
            events.append(f"{error}; until then faces are found on the host")
            params = replace(params, face_model="")
    return params, tuple(events)


def usb2_text(params: OakParams, speed: str) -> str:
    """Return a message about the effect of a USB 2 line on the requested frames."""
    frame = params.width_px * params.height_px * (_COLOUR_BYTES + _DEPTH_BYTES * params.depth)
    most_hz = _USB2_BYTES_S / frame
    text = f"the OAK camera runs at USB 2 speed ({speed}), which carries about 30 MB a second"
    if most_hz >= params.rate_hz:
        return f"{text}: enough for the requested frames; a USB 3 cable and port reduce the delay"
    fewer = f"oak.rate_hz {most_hz:.0f}" if most_hz >= 1.0 else "smaller frames"
    return (
        f"{text}, and {frame * params.rate_hz / 1e6:.0f} are requested: "
        f"use a USB 3 cable (its plug is often blue) and port, or set {fewer}"
        f"{' or oak.depth: false' if params.depth else ''}"
    )


def full_line_text(params: OakParams, measured_hz: float) -> str:
    """Return a message about a full USB 2 line, with the remedy."""
    return (
        f"the OAK camera's USB 2 line is full: {measured_hz:.1f} of {params.rate_hz:g} frames a "
        f"second arrive; use a USB 3 cable and port, or set oak.rate_hz {max(1.0, measured_hz):.0f}"
    )


def _stereo_fault(dai: Any, device: Any, sockets: set[Any]) -> str:
    """Return why depth is not available, "" if it is."""
    socket = dai.CameraBoardSocket
    missing = [one.name for one in (socket.CAM_B, socket.CAM_C) if one not in sockets]
    if missing:
        return f"it has no stereo pair (nothing at {' and '.join(missing)})"
    try:
        device.readCalibration().getCameraExtrinsics(socket.CAM_B, socket.CAM_C)
    except RuntimeError:
        return "its stereo pair is not calibrated (Luxonis' documentation: calibration)"
    return ""

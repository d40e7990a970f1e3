"""Removal and report of settings that a camera does not support."""

from dataclasses import replace
from typing import Any

from gazerig.drivers.camera.oak.calibration import imu_to_camera
from gazerig.drivers.camera.oak.face_archive import UnusableModel, kind_of, read_archive
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.errors import CameraError

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
    if params.depth and (why := _no_stereo(dai, device, sockets)):
        events.append(
            f"{label} measures no distances: {why}; they are estimated from the size of faces; "
            "oak.depth: false says so in the rig"
        )
        params = replace(params, depth=False)
    if params.face_model:
        try:
            archive = read_archive(dai, params.face_model)
            kind_of(archive, device.getPlatform(), params.face_model)
        except UnusableModel as error:
            events.append(f"{error}; until then faces are found on the host")
            params = replace(params, face_model="")
    if params.gyro and (why := _no_gyro(dai, device, params)):
        events.append(f"{label} has no usable gyro: {why}")
        params = replace(params, gyro=False)
    return params, tuple(events)


def usb2_text(params: OakParams, speed: str) -> str:
    """Return a message about the effect of a USB 2 line on the requested frames."""
    frame = params.width_px * params.height_px * (_COLOUR_BYTES + _DEPTH_BYTES * params.depth)
    most_hz = _USB2_BYTES_S / frame
    text = f"the OAK camera runs at USB 2 speed ({speed}), which carries about 30 MB a second"
    if most_hz >= params.rate_hz:
        return f"{text}: enough for what is asked; a USB 3 cable and port make it sooner"
    fewer = f"oak.rate_hz {most_hz:.0f}" if most_hz >= 1.0 else "smaller frames"
    return (
        f"{text}, and {frame * params.rate_hz / 1e6:.0f} are asked for: "
        f"use a USB 3 cable (its plug is often blue) and port, or set {fewer}"
        f"{' or oak.depth: false' if params.depth else ''}"
    )


def full_line_text(params: OakParams, measured_hz: float) -> str:
    """Return a message about a full USB 2 line, with the remedy."""
    return (
        f"the OAK camera's USB 2 line is full: {measured_hz:.1f} of {params.rate_hz:g} frames a "
        f"second arrive; use a USB 3 cable and port, or set oak.rate_hz {max(1.0, measured_hz):.0f}"
    )


def _no_stereo(dai: Any, device: Any, sockets: set[Any]) -> str:
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


def _no_gyro(dai: Any, device: Any, params: OakParams) -> str:
    """Return why the gyro is not available, "" if it is."""
    imu = device.getConnectedIMU()
    if not imu or imu.upper() == "NONE":
        return "it has no IMU; oak.gyro: false says so in the rig"
    if params.imu_rotation_deg is None and imu_to_camera(dai, device.readCalibration()) is None:
        return (
            "its calibration lacks the IMU's orientation: set oak.imu_rotation_deg, "
            "or set oak.gyro: false"
        )
    return ""

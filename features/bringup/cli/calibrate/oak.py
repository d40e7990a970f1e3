"""Calibration from the memory of an OAK camera: gazerig calibrate camera --oak."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from gazerig.drivers.camera.oak.calibration import OakCalibration, read_calibration
from gazerig.drivers.camera.oak.discovery import load_depthai
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.orientation import FrameOrientation
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import CameraError
from gazerig.features.bringup.calibration.camera_calibration import lens_params
from gazerig.robot.cli.terminal import say
from gazerig.robot.model.frames import LensParams

# If a frame's own lens differs by less, it is the calibration's with rounding.
_SAME_SHARE = 2e-3


def calibration_of_file(file: Path, params: OakParams) -> OakCalibration:
    """Read a calibration written by depthai's eepromToJsonFile.

    Raises:
        CameraError: the file does not exist, or is not a calibration.
    """
    dai = load_depthai()
    if not file.is_file():
        raise CameraError(f"no calibration at {file}: give a file that depthai has written")
    try:
        stored = dai.CalibrationHandler(str(file))
    except (RuntimeError, ValueError) as error:
        raise CameraError(
            f"{file} is no calibration of an OAK camera ({' '.join(str(error).split())}): "
            "give a file that depthai's eepromToJsonFile has written"
        ) from error
    return read_calibration(dai, stored, params)


def upright_calibration(found: OakCalibration, orientation: FrameOrientation) -> OakCalibration:
    """Return the calibration with the lens of frames turned upright."""
    size_px = found.width_px, found.height_px
    lens = orientation.turn_lens(found.lens, *size_px)
    width, height = size_px[::-1] if orientation.rotation in (90, 270) else size_px
    return found._replace(lens=lens, width_px=width, height_px=height)


def with_frame_lens(found: OakCalibration, frame_lens: Intrinsics | None) -> OakCalibration:
    """Return the calibration with the lens of a frame; print a difference."""
    if frame_lens is None:
        return found
    a, b = found.lens, frame_lens
    width, height = found.width_px, found.height_px
    off = max(
        abs(a.fx_px / b.fx_px - 1.0),
        abs(a.fy_px / b.fy_px - 1.0),
        abs(a.cx_px - b.cx_px) / width,
        abs(a.cy_px - b.cy_px) / height,
    )
    if off > _SAME_SHARE:
        say(
            f"its frames come through another lens: {b.fx_px:.1f}, {b.fy_px:.1f} px, axis at "
            f"{b.cx_px:.1f}, {b.cy_px:.1f}; that one is taken"
        )
    return found._replace(lens=replace(b, distortion=a.distortion))


def print_calibration(found: OakCalibration, params: OakParams) -> None:
    """Print the contents of the memory, including values that are not for the rig's file."""
    i = found.lens
    say(
        f"{found.label}: focal length {i.fx_px:.1f}, {i.fy_px:.1f} px, axis at {i.cx_px:.1f}, "
        f"{i.cy_px:.1f} px of {found.width_px} x {found.height_px}"
    )
    numbers = " ".join(f"{value:.4g}" for value in found.raw_distortion)
    straightened = "the camera straightens its frames, so zeros are written"
    say(
        f"its lens itself: k1 k2 p1 p2 k3 {numbers} (fitted, {found.fit_error_px:.2f} px are left); "
        + (straightened if params.undistort else "frames come so, as oak.undistort: false asks")
    )
    if found.left_camera_m is not None and found.right_camera_m is not None:
        left, right = (
            " ".join(f"{1e3 * v:.1f}" for v in at)
            for at in (found.left_camera_m, found.right_camera_m)
        )
        apart = (
            sum(
                (a - b) ** 2 for a, b in zip(found.left_camera_m, found.right_camera_m, strict=True)
            )
            ** 0.5
        )
        say(
            f"stereo cameras at {left} and {right} mm from it (right, down, ahead), "
            f"{1e3 * apart:.1f} mm apart"
        )
    else:
        say("no stereo cameras: it measures no distances")
    if found.imu_rotation_deg is None:
        say(
            "its memory does not contain the place of its gyro: the gyro cannot be used (oak.imu_rotation_deg)"
        )
    if found.focus is not None and params.focus != found.focus:
        say(
            f"all this holds with the lens at position {found.focus}: oak.focus: {found.focus} "
            "holds it there, if the lens can move"
        )


def oak_changes(found: OakCalibration) -> dict[str, Any]:
    """Return a calibration as dotted keys of a rig file and values."""
    lens = lens_params(found.lens, found.width_px, found.height_px)
    changes = lens_keys(lens, found.horizontal_field_deg)
    if found.imu_rotation_deg is not None:
        x, y, z = (round(value, 3) + 0.0 for value in found.imu_rotation_deg)
        changes["oak.imu_rotation_deg"] = (x, y, z)
    return changes


def lens_keys(lens: LensParams, horizontal_field_deg: float) -> dict[str, Any]:
    """Return a lens as dotted keys of a rig file and values."""
    keys = {f"camera.lens.{key}": value for key, value in asdict(lens).items()}
    return {"camera.horizontal_field_deg": round(horizontal_field_deg, 2), **keys}

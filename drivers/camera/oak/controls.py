"""Exposure, anti-flicker and focus controls, set as in the rig file."""

from typing import Any

from gazerig.drivers.camera.oak.params import OakParams

_ANTI_FLICKER = {"off": "OFF", "50hz": "MAINS_50_HZ", "60hz": "MAINS_60_HZ", "auto": "AUTO"}


def set_controls(dai: Any, control: Any, params: OakParams) -> None:
    """Set exposure limit, anti-flicker and focus in a CameraControl.

    Settings that the rig leaves open stay at the camera's defaults.
    """
    if params.exposure_limit_ms is not None:
        control.setAutoExposureLimit(round(params.exposure_limit_ms * 1e3))
    if params.anti_flicker != "default":
        modes = dai.CameraControl.AntiBandingMode
        control.setAntiBandingMode(getattr(modes, _ANTI_FLICKER[params.anti_flicker]))
    if params.focus is not None:
        control.setManualFocus(params.focus)

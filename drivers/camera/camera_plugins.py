"""Our kinds of cameras, registered like those of other packages, and creation of sources by name.

OpenCV, PyAV and depthai are large, so the control loop's process only names the source.
"""

from pathlib import Path
from typing import Any

from gazerig.drivers.camera.params import OakParams, WebcamParams
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.plugins import CAMERA, CameraPlugin, create, load


def webcam(params: WebcamParams, number: int = 0) -> FrameSource:
    """Return a webcam."""
    from gazerig.drivers.camera.webcam import Webcam

    return Webcam(number, params)


def oak(params: OakParams) -> FrameSource:
    """Return an OAK-D."""
    from gazerig.drivers.camera.oak.source import OakSource

    return OakSource(params)


def film(file: Path) -> FrameSource:
    """Return a film, a photo or a recording of a camera."""
    if file.suffix == ".mcap":
        from gazerig.drivers.camera.playback import CameraReplay

        return CameraReplay(file)
    from gazerig.drivers.camera.film import Film

    return Film(str(file))


WEBCAM = CameraPlugin(webcam, WebcamParams)
OAK = CameraPlugin(oak, OakParams)


def create_camera_part(name: str, params: Any) -> Any:
    """Create a frame source or a camera by its name; for use in any process.

    Raises:
        SetupError: no camera has this name, or it cannot be created.
    """
    return create(CAMERA, name, load(CAMERA, name, CameraPlugin), params)


def is_source(part: object) -> bool:
    """Return whether a camera returns frames, which the rig's own detectors search."""
    return hasattr(part, "take")

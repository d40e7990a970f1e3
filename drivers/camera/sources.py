"""Factories of frame sources, each imported in the process that opens it.

OpenCV and depthai are large, so the control loop's process only names the source.
"""

from pathlib import Path

from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.params import WebcamParams
from gazerig.drivers.camera.source import FrameSource


def recording(file: Path) -> FrameSource:
    """Return a recording of a camera."""
    from gazerig.drivers.camera.playback import CameraReplay

    return CameraReplay(file)


def film(path: str) -> FrameSource:
    """Return a film or photo."""
    from gazerig.drivers.camera.video_file import VideoFile

    return VideoFile(path)


def oak(params: OakParams) -> FrameSource:
    """Return an OAK-D."""
    from gazerig.drivers.camera.oak.source import OakSource

    return OakSource(params)


def webcam(number: int, params: WebcamParams) -> FrameSource:
    """Return a webcam."""
    from gazerig.drivers.camera.webcam import Webcam

    return Webcam(number, params)

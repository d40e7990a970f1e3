"""Our kinds of cameras, registered like those of other packages, and creation of sources by name.

OpenCV and depthai are large, so the control loop's process only names the source.
"""

import atexit
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any, cast

from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.params import WebcamParams
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.plugins import CAMERA, CameraPlugin, create, load


def _webcam(params: WebcamParams) -> FrameSource:
    from gazerig.drivers.camera.webcam import Webcam

    return Webcam(0, params)


def _oak(params: OakParams) -> FrameSource:
    from gazerig.drivers.camera.oak.source import OakSource

    return OakSource(params)


WEBCAM = CameraPlugin(_webcam, WebcamParams)
OAK = CameraPlugin(_oak, OakParams)


def create_camera_part(name: str, params: Any) -> object:
    """Create a frame source or a camera by its name.

    Raises:
        SetupError: no camera has this name, or it cannot be created.
    """
    return create(CAMERA, name, load(CAMERA, name, CameraPlugin), params)


def is_source(part: object) -> bool:
    """Return whether a camera returns frames, which the rig's own detectors search."""
    return hasattr(part, "take")


def create_plugin_source(name: str, params: Any) -> FrameSource:
    """Create a frame source by its name; for use in any process.

    Raises:
        SetupError: no source has this name, or it cannot be created.
    """
    return cast(FrameSource, create_camera_part(name, params))


def recording(file: Path) -> FrameSource:
    """Return a recording of a camera."""
    from gazerig.drivers.camera.playback import CameraReplay

    return CameraReplay(file)


def recorded(make: Callable[[], FrameSource], file: Path) -> FrameSource:
    """Return a source whose frames are also written to a file, until this process ends.

    An existing file is kept: after a restart of the camera's process it is FILE-2, and so on.
    """
    from gazerig.drivers.camera.recorder import CameraRecorder

    paths = (file.with_stem(f"{file.stem}-{n}") if n > 1 else file for n in count(1))
    recorder = CameraRecorder(make(), next(path for path in paths if not path.exists()))
    atexit.register(recorder.finish)
    return recorder


def film(path: str) -> FrameSource:
    """Return a film or photo."""
    from gazerig.drivers.camera.film import Film

    return Film(path)


def oak(params: OakParams) -> FrameSource:
    """Return an OAK-D."""
    from gazerig.drivers.camera.oak.source import OakSource

    return OakSource(params)


def webcam(number: int, params: WebcamParams) -> FrameSource:
    """Return a webcam."""
    from gazerig.drivers.camera.webcam import Webcam

    return Webcam(number, params)

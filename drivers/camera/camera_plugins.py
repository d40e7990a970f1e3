"""Our kinds of cameras, registered like those of other packages, and creation of sources by name.

OpenCV and depthai are large, so the control loop's process only names the source.
"""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.params import WebcamParams
from gazerig.drivers.camera.source import FrameSource, Shot, to_bgr
from gazerig.drivers.errors import CameraError, PluginError, SetupError
from gazerig.drivers.plugins import (
    CAMERA,
    CameraPlugin,
    Evidence,
    create,
    describe_error,
    find,
    load,
)
from gazerig.drivers.types import CameraTurn


def _webcam(params: WebcamParams) -> FrameSource:
    from gazerig.drivers.camera.webcam import Webcam

    return Webcam(0, params)


def _oak(params: OakParams) -> FrameSource:
    from gazerig.drivers.camera.oak.source import OakSource

    return OakSource(params)


WEBCAM = CameraPlugin(_webcam, WebcamParams, ("frames",), Evidence(emulated=True))
OAK = CameraPlugin(_oak, OakParams, ("frames", "depth", "lens"), Evidence(emulated=True))


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
    """Create a frame source by its name, checked frame by frame; for use in any process.

    Raises:
        SetupError: no source has this name, or it cannot be created.
    """
    return CheckedSource(
        cast(FrameSource, create_camera_part(name, params)), find(CAMERA, name).label
    )


class CheckedSource:
    """A checked frame source of another package; its errors become one named line."""

    def __init__(self, source: FrameSource, label: str) -> None:
        self._source, self._label = source, label

    def open(self) -> None:
        """Open the device.

        Raises:
            CameraError: it cannot be opened.
        """
        try:
            self._source.open()
        except SetupError:
            raise
        except (Exception, SystemExit) as error:
            raise PluginError(f"{self._label} cannot be opened: {describe_error(error)}") from error

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for the next frame; return None if ``stop`` was set meanwhile.

        Raises:
            CameraError: the source fails, or returns something other than a frame.
        """
        try:
            shot = self._source.take(now_s, stop)
        except CameraError:
            raise
        except (Exception, SystemExit) as error:
            raise CameraError(f"{self._label} failed ({describe_error(error)})") from error
        if shot is None or stop.is_set():
            return None
        if not isinstance(shot, Shot):
            raise CameraError(f"{self._label} returned a {type(shot).__name__}, wanted a Shot")
        image = to_bgr(shot.image)
        if image is None:
            raise CameraError(
                f"{self._label} returned a frame that is not an image of 8 or 16 bits"
            )
        if not shot.captured_s <= now_s() + 1.0:  # also rejects NaN
            raise CameraError(f"{self._label} returned a frame of the time {shot.captured_s!r}")
        if shot.turn is not None and not _is_turn(shot.turn):
            raise CameraError(f"{self._label} returned a camera turn that is not a rotation")
        return shot._replace(image=image)

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return tuple(map(str, self._source.events()))

    def close(self) -> None:
        """Free the device; safe to call twice."""
        self._source.close()


def _is_turn(turn: object) -> bool:
    """Return whether a package's camera turn is a valid one."""
    try:
        return isinstance(turn, CameraTurn) and turn.is_rotation
    except Exception:  # its elements may have any type
        return False


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

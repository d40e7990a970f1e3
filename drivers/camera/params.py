"""Parameters of reopening a lost camera, and of a webcam."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class CameraRecoveryParams:
    """How a lost camera is reopened."""

    # fmt: off
    retry_ms: Annotated[float, Bounds(1, 60000), "delay before a lost camera is opened again; it doubles with each attempt"] = 250.0
    longest_retry_ms: Annotated[float, Bounds(1, 60000), "longest delay between two attempts"] = 2000.0
    give_up_s: Annotated[float, Bounds(0, 86400),
        "the run ends when a lost camera has not come back for this long; 0 ends it at once"] = 60.0
    silent_s: Annotated[float, Bounds(0.1, 60),
        "a camera is considered lost after this long without a new frame (or 5 frame periods, if longer)"] = 1.0
    restart_s: Annotated[float, Bounds(0.1, 600),
        "the camera's process is restarted after this long without a new frame (or 15 frame periods, if longer)"] = 3.0
    # fmt: on


@dataclass(frozen=True)
class WebcamParams:
    """The format requested of a webcam, which delivers its nearest one."""

    # fmt: off
    width_px: Annotated[int, Bounds(16, 16384), "image width requested from the camera"] = 640
    height_px: Annotated[int, Bounds(16, 16384), "image height requested from the camera"] = 480
    rate_hz: Annotated[float, Bounds(1, 1000), "frame rate requested from the camera"] = 30.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "delay from the middle of the exposure to the frame's time stamp; measure it by filming a running clock"] = 0.0
    # fmt: on

"""Parameters of reopening a lost camera, and of a webcam."""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds

ASSUMED_FIELD_DEG = 69.0
"""Assumed horizontal field of view of an unmeasured lens, that of an OAK-D."""


@dataclass(frozen=True)
class CameraRecoveryParams:
    """Parameters of reopening a lost camera."""

    # fmt: off
    retry_ms: Annotated[float, Bounds(1, 60000), "delay before a lost camera is opened again; it doubles with each attempt"] = 250.0
    longest_retry_ms: Annotated[float, Bounds(1, 60000), "longest delay between two attempts"] = 2000.0
    give_up_s: Annotated[float, Bounds(0, 86400),
        "a run ends when a lost camera has not reconnected for this long; 0: immediately"] = 60.0
    silent_s: Annotated[float, Bounds(0.1, 60),
        "a camera is considered lost after this long without a new frame (or 5 frame periods, if longer)"] = 1.0
    restart_s: Annotated[float, Bounds(0.1, 600),
        "the camera's process is restarted after this long without a new frame (or 15 frame periods, if longer)"] = 3.0
    # fmt: on


@dataclass(frozen=True)
class WebcamParams:
    """Settings requested from a webcam, which uses the nearest ones that it has."""

    # fmt: off
    width_px: Annotated[int, Bounds(16, 16384), "image width requested from the camera"] = 640
    height_px: Annotated[int, Bounds(16, 16384), "image height requested from the camera"] = 480
    rate_hz: Annotated[float, Bounds(1, 1000), "frame rate requested from the camera"] = 30.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "delay from the middle of the exposure to the frame's time stamp; measure it by filming a running clock"] = 0.0
    format: Annotated[Literal["mjpg", "yuyv"],
        "mjpg: compressed, which USB 2 carries at full size and rate; yuyv: not compressed"] = "mjpg"
    exposure_ms: Annotated[float | None, Bounds(0.1, 1000),
        "exposure time: shorter ones blur less while the head turns but need more light; null: automatic"] = None
    gain: Annotated[int | None, Bounds(0, 65535), "gain in the camera's own units; null: automatic"] = None
    anti_flicker: Annotated[Literal["default", "off", "50hz", "60hz", "auto"],
        "exposure times that are whole periods of the mains, to avoid stripes under lamps; default: chosen by the camera"] = "default"
    focus: Annotated[int | None, Bounds(0, 65535),
        "fixed position of the lens in the camera's own units; null: autofocus"] = None
    # fmt: on

"""Times of reopening a lost camera, and parameters of a webcam and an OAK-D."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from gazerig.params import Bounds

ASSUMED_FIELD_DEG = 69.0
"""Assumed horizontal field of view of an unmeasured lens, that of an OAK-D."""


class CameraRecovery(NamedTuple):
    """Times of reopening a lost camera, seconds.

    retry_s, longest_retry_s: delay before it is opened again, doubled with each attempt up to the
        longest
    give_up_s: a run ends when it has not reconnected for this long
    silent_s: it is lost after this long without a new frame (or 5 frame periods, if longer)
    restart_s: its process is restarted after this long (or 15 frame periods, if longer)
    """

    retry_s: float = 0.25
    longest_retry_s: float = 2.0
    give_up_s: float = 60.0
    silent_s: float = 2.0
    restart_s: float = 10.0


RECOVERY = CameraRecovery()


@dataclass(frozen=True)
class WebcamParams:
    """Settings requested from a webcam, which uses the nearest ones that it has."""

    # fmt: off
    width_px: Annotated[int, Bounds(16, 16384), "image width requested from the camera"] = 640
    height_px: Annotated[int, Bounds(16, 16384), "image height requested from the camera"] = 480
    rate_hz: Annotated[float, Bounds(1, 1000), "frame rate requested from the camera"] = 30.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "delay from the middle of the exposure to the frame's time stamp; measure it by filming a running clock"] = 0.0
    # fmt: on


@dataclass(frozen=True)
class OakParams:
    """The OAK-D to use, and its frame rate."""

    # fmt: off
    device: Annotated[str, "device id or IP address, if there are several cameras; empty: the first one found"] = ""
    rate_hz: Annotated[float, Bounds(1, 120), "frame rate"] = 30.0
    # fmt: on

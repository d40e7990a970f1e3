"""What every camera can be told about being lost, and a webcam about its pictures."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class CameraCareParams:
    """How a camera that went away is tried again."""

    # fmt: off
    retry_ms: Annotated[float, Bounds(1, 60000), "a lost camera is tried again after this; the wait doubles each time"] = 250.0
    longest_retry_ms: Annotated[float, Bounds(1, 60000), "longest wait between two tries"] = 2000.0
    give_up_s: Annotated[float, Bounds(0, 86400),
        "the run ends when a lost camera has not come back for this long; 0 ends it at once"] = 60.0
    silent_s: Annotated[float, Bounds(0.1, 60), "a camera counts as lost after so long without a new picture (or 5 periods)"] = 1.0
    restart_s: Annotated[float, Bounds(0.1, 600), "after so long its process is ended and started again (or after 15 periods)"] = 3.0
    # fmt: on


@dataclass(frozen=True)
class WebcamParams:
    """What is asked of a webcam; it gives what comes nearest."""

    # fmt: off
    width_px: Annotated[int, Bounds(16, 16384), "width asked for"] = 640
    height_px: Annotated[int, Bounds(16, 16384), "height asked for"] = 480
    rate_hz: Annotated[float, Bounds(1, 1000), "pictures a second asked for"] = 30.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "from the middle of the exposure to the time that the picture is stamped with; measure it with a film of a running clock"] = 0.0
    # fmt: on

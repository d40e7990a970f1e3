"""What every camera can be told about being lost, and a webcam about its pictures."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class CameraCareParams:
    """How a camera that went away is tried again."""

    retry_ms: float = field(
        default=250.0,
        metadata={
            "low": 1.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "a lost camera is tried again after this; the wait doubles each time",
        },
    )
    longest_retry_ms: float = field(
        default=2000.0,
        metadata={
            "low": 1.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "longest wait between two tries",
        },
    )
    give_up_s: float = field(
        default=60.0,
        metadata={
            "low": 0.0,
            "high": 86400.0,
            "unit": "s",
            "says": "the run ends when a lost camera has not come back for this long; "
            "0 ends it at once",
        },
    )
    silent_s: float = field(
        default=1.0,
        metadata={
            "low": 0.1,
            "high": 60.0,
            "unit": "s",
            "says": "a camera counts as lost after so long without a new picture (or 5 periods)",
        },
    )
    restart_s: float = field(
        default=3.0,
        metadata={
            "low": 0.1,
            "high": 600.0,
            "unit": "s",
            "says": "after so long its process is ended and started again (or after 15 periods)",
        },
    )


@dataclass(frozen=True)
class WebcamParams:
    """What is asked of a webcam; it gives what comes nearest."""

    width_px: int = field(
        default=640,
        metadata={"low": 16, "high": 16384, "unit": "px", "says": "width asked for"},
    )
    height_px: int = field(
        default=480,
        metadata={"low": 16, "high": 16384, "unit": "px", "says": "height asked for"},
    )
    rate_hz: float = field(
        default=30.0,
        metadata={"low": 1.0, "high": 1000.0, "unit": "Hz", "says": "pictures a second asked for"},
    )
    latency_ms: float = field(
        default=0.0,
        metadata={
            "low": 0.0,
            "high": 1000.0,
            "unit": "ms",
            "says": "from the middle of the exposure to the time that the picture is stamped "
            "with; measure it with a film of a running clock",
        },
    )

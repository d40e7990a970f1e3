"""What the motion detector can be told.

Lengths in pixels are of the small picture in which the search is done.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class MotionParams:
    """How finely, how carefully and how much of what moves is looked for."""

    enabled: bool = field(default=True, metadata={"says": "look for what moves, besides faces"})
    work_px: int = field(
        default=320,
        metadata={
            "low": 64,
            "high": 2048,
            "unit": "px",
            "says": "pictures whose longer side is above this are scaled down to it",
        },
    )
    preset: str = field(
        default="ultrafast",
        metadata={
            "choices": ("ultrafast", "fast", "medium"),
            "says": "thoroughness of the optical flow (DIS); the slower ones smooth it, which "
            "loses small things",
        },
    )
    finest_level: int = field(
        default=1,
        metadata={
            "low": 0,
            "high": 2,
            "says": "flow is found at 1/2 to this power of the picture's size; each step finer "
            "shows smaller things and costs three to four times the last",
        },
    )
    min_flow_px: float = field(
        default=0.25,
        metadata={
            "low": 0.02,
            "high": 20.0,
            "unit": "px",
            "says": "shortest way from one picture to the next that counts as motion",
        },
    )
    noise_factor: float = field(
        default=5.0,
        metadata={
            "low": 2.0,
            "high": 50.0,
            "unit": "",
            "says": "motion must exceed the noise of the still background's flow by this",
        },
    )
    parallax_share: float = field(
        default=0.1,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "the same, as a share of the camera's own motion: still things nearer than "
            "the background move by this against it when the head turns",
        },
    )
    max_turn_deg_s: float = field(
        default=200.0,
        metadata={
            "low": 1.0,
            "high": 2000.0,
            "unit": "deg/s",
            "says": "nothing is said while the camera turns faster, as in our own saccades",
        },
    )
    min_background_share: float = field(
        default=0.35,
        metadata={
            "low": 0.05,
            "high": 0.95,
            "unit": "",
            "says": "nothing is said where less of the picture's texture moves as one",
        },
    )
    min_area_share: float = field(
        default=0.001,
        metadata={
            "low": 0.0001,
            "high": 0.5,
            "unit": "",
            "says": "smallest thing, as a share of the picture",
        },
    )
    close_px: int = field(
        default=7,
        metadata={
            "low": 1,
            "high": 51,
            "unit": "px",
            "says": "moving parts nearer to each other than this belong together",
        },
    )
    max_blobs: int = field(
        default=8,
        metadata={"low": 1, "high": 100, "says": "the largest so many are told"},
    )
    confirm_pictures: int = field(
        default=2,
        metadata={
            "low": 1,
            "high": 10,
            "says": "something is told when it has been seen in this many pictures in a row",
        },
    )
    forget_ms: float = field(
        default=500.0,
        metadata={
            "low": 0.0,
            "high": 5000.0,
            "unit": "ms",
            "says": "something that stood still for longer gets another number when it moves on",
        },
    )
    max_gap_ms: float = field(
        default=300.0,
        metadata={
            "low": 10.0,
            "high": 2000.0,
            "unit": "ms",
            "says": "pictures further apart than this are not compared",
        },
    )
    assumed_distance_m: float = field(
        default=2.0,
        metadata={
            "low": 0.1,
            "high": 50.0,
            "unit": "m",
            "says": "distance of what no depth picture tells the distance of",
        },
    )
    assumed_distance_spread: float = field(
        default=0.5,
        metadata={
            "low": 0.01,
            "high": 2.0,
            "unit": "",
            "says": "standard deviation of that distance, as a share of it",
        },
    )

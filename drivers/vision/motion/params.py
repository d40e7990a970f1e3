"""What the motion detector can be told.

Lengths in pixels are of the small picture in which the search is done.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class MotionParams:
    """How finely, how carefully and how much of what moves is looked for."""

    # fmt: off
    enabled: Annotated[bool, "look for what moves, besides faces"] = True
    work_px: Annotated[int, Bounds(64, 2048), "pictures whose longer side is above this are scaled down to it"] = 320
    preset: Annotated[Literal["ultrafast", "fast", "medium"],
        "thoroughness of the optical flow (DIS); the slower ones smooth it, which loses small things"] = "ultrafast"
    finest_level: Annotated[int, Bounds(0, 2),
        "flow is found at 1/2 to this power of the picture's size; each step finer shows smaller things and costs three to four times "
        "the last"] = 1
    min_flow_px: Annotated[float, Bounds(0.02, 20), "shortest way from one picture to the next that counts as motion"] = 0.25
    noise_factor: Annotated[float, Bounds(2, 50), "motion must exceed the noise of the still background's flow by this"] = 5.0
    parallax_share: Annotated[float, Bounds(0, 1),
        "the same, as a share of the camera's own motion: still things nearer than the background move by this against it when the "
        "head turns"] = 0.1
    max_turn_deg_s: Annotated[float, Bounds(1, 2000), "nothing is said while the camera turns faster, as in our own saccades"] = 200.0
    min_background_share: Annotated[float, Bounds(0.05, 0.95), "nothing is said where less of the picture's texture moves as one"] = 0.35
    min_area_share: Annotated[float, Bounds(0.0001, 0.5), "smallest thing, as a share of the picture"] = 0.001
    close_px: Annotated[int, Bounds(1, 51), "moving parts nearer to each other than this belong together"] = 7
    max_blobs: Annotated[int, Bounds(1, 100), "the largest so many are told"] = 8
    confirm_pictures: Annotated[int, Bounds(1, 10), "something is told when it has been seen in this many pictures in a row"] = 2
    forget_ms: Annotated[float, Bounds(0, 5000), "something that stood still for longer gets another number when it moves on"] = 500.0
    max_gap_ms: Annotated[float, Bounds(10, 2000), "pictures further apart than this are not compared"] = 300.0
    assumed_distance_m: Annotated[float, Bounds(0.1, 50), "distance of what no depth picture tells the distance of"] = 2.0
    assumed_distance_spread: Annotated[float, Bounds(0.01, 2), "standard deviation of that distance, as a share of it"] = 0.5
    # fmt: on

"""Parameters of the motion detector.

Lengths in pixels are of the small image in which the search is done.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class MotionParams:
    """Resolution, thresholds and limits of motion detection."""

    # fmt: off
    enabled: Annotated[bool, "detect moving things besides faces"] = True
    gloves: Annotated[bool, "red boxing gloves are found by their colour, also while they do not move"] = False
    work_px: Annotated[int, Bounds(64, 2048), "frames whose longer side exceeds this are scaled down to it"] = 320
    preset: Annotated[Literal["ultrafast", "fast", "medium"],
        "preset of the optical flow (DIS); the slower presets smooth the flow more, which loses small things"] = "ultrafast"
    finest_level: Annotated[int, Bounds(0, 2),
        "the flow is computed at 1/2 to this power of the frame size; each finer level shows smaller things and takes three to four "
        "times as long"] = 1
    min_flow_px: Annotated[float, Bounds(0.02, 20), "smallest displacement from one frame to the next that counts as motion"] = 0.25
    noise_factor: Annotated[float, Bounds(2, 50), "motion must exceed the noise of the flow on the still background by this factor"] = 5.0
    parallax_share: Annotated[float, Bounds(0, 1),
        "threshold of motion as a share of the camera's own motion: still things nearer than the background move relative to it "
        "when the head turns"] = 0.1
    max_turn_deg_s: Annotated[float, Bounds(1, 2000), "no motion is reported while the camera turns faster than this"] = 200.0
    min_background_share: Annotated[float, Bounds(0.05, 0.95),
        "no motion is reported if a smaller share of the image texture moves uniformly"] = 0.35
    min_area_share: Annotated[float, Bounds(0.0001, 0.5), "smallest moving region that is reported, as a share of the image area"] = 0.001
    close_px: Annotated[int, Bounds(1, 51), "moving regions closer to each other than this are merged"] = 7
    max_blobs: Annotated[int, Bounds(1, 100), "most moving regions reported; the largest are chosen"] = 8
    confirm_frames: Annotated[int, Bounds(1, 10),
        "a moving region is reported once it has been detected in this many consecutive frames"] = 2
    forget_ms: Annotated[float, Bounds(0, 5000), "a thing that did not move for longer gets a new id when it moves again"] = 500.0
    max_gap_ms: Annotated[float, Bounds(10, 2000), "frames further apart in time than this are not compared"] = 300.0
    assumed_distance_m: Annotated[float, Bounds(0.1, 50), "distance assumed for things without a measured depth"] = 2.0
    assumed_distance_spread: Annotated[float, Bounds(0.01, 2), "standard deviation of that distance, as a share of it"] = 0.5
    # fmt: on

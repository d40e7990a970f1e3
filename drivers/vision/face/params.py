"""Parameters of every detector of faces, people and palms."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from gazerig.params import Bounds, Choices, Unlisted

MIN_FACE_PX = 24
"""Smallest face height that is detected, in pixels of the scaled-down frame."""
MIN_CONFIDENCE = 0.7
"""Faces detected with a lower confidence are discarded."""


@dataclass(frozen=True)
class FaceDetectorParams:
    """Parameters of the networks that search for faces, people and palms."""

    # fmt: off
    kind: Annotated[str, Choices("auto"),
        "auto searches some frames and places known faces in all; or the detector of a package"] = "auto"
    work_width_px: Annotated[int, Bounds(64, 4096), "wider frames are scaled down to this width before detection"] = 320
    people_hz: Annotated[float, Bounds(0, 30),
        "searches per second for people whose face is not visible; 0: none; needs gazerig models fetch people and gazerig[people]"] = 2.0
    hands_hz: Annotated[float, Bounds(0, 30),
        "searches per second for palms of the nearest person; 0: none; needs gazerig models fetch hands and gazerig[people]"] = 5.0
    plugins: Annotated[Mapping[str, Any], Unlisted()] = field(default_factory=dict, kw_only=True, hash=False)
    # fmt: on

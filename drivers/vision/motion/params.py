"""Parameters of the motion detector."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class MotionParams:
    """Resolution and kinds of motion detection."""

    # fmt: off
    enabled: Annotated[bool, "detect moving things besides faces"] = True
    gloves: Annotated[bool, "red boxing gloves are found by their colour, also while they do not move"] = False
    work_px: Annotated[int, Bounds(64, 2048), "frames whose longer side exceeds this are scaled down to it"] = 320
    # fmt: on

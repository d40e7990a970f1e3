"""The rate of the control loop."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class LoopParams:
    """The control rate and the time for parking."""

    rate_hz: Annotated[float, Bounds(20, 1000), "control rate"] = 200.0
    park_s: Annotated[
        float, Bounds(0, 30), "longest time for parking before torque is switched off"
    ] = 4.0

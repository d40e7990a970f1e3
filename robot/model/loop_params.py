"""The rate of the control loop."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class LoopParams:
    """The control rate."""

    rate_hz: Annotated[float, Bounds(20, 1000), "control rate"] = 200.0

"""Parameters of the mouth and of the head's motion while it speaks."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class MouthParams:
    """Motion while the head speaks."""

    # fmt: off
    level: Annotated[str, "level of the rig's table that opens the mouth; a rig without it plays only the sound"] = "mouth"
    size: Annotated[float, Bounds(0, 1), "opening at the loudest parts"] = 0.9
    quiet_db: Annotated[float, Bounds(-60, -6), "level relative to the loudest parts at which the mouth is shut"] = -30.0
    sway_deg: Annotated[float, Bounds(0, 5),
        "largest yaw by which the head sways while it speaks; pitch and roll are smaller; 0: none"] = 1.5
    # fmt: on

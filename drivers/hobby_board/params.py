"""What a rig file may choose for any board of hobby servos."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardParams:
    """How long a board is waited for, how often it is looked at, and how its servos start."""

    # fmt: off
    reply_timeout_ms: Annotated[float, Bounds(1, 200), "Patience for an answer beyond the time its bytes take on a serial line."] = 20.0
    watch_ms: Annotated[float, Bounds(0, 50),
        "Look at the board and one channel's pulse so often; 0: in every read. More saves time on a slow line, but restarts are "
        "noticed later."] = 0.0
    stagger_ms: Annotated[float, Bounds(0, 1000),
        "Servos without pulses start so long after one another: all at once pull a weak supply down."] = 100.0
    give_up_s: Annotated[float, Bounds(0.5, 3600), "Wait so long for a port or board that is gone to come back."] = 60.0
    # fmt: on

"""Parameters of the tracking of people and things."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class TrackerParams:
    """Memory of people who left."""

    # fmt: off
    remember_person_s: Annotated[float, Bounds(0, 3600),
        "a person who returns within this time keeps the number, if position, height and clothes match"] = 300.0
    # fmt: on

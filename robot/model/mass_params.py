"""Parameters of the masses of a head and their positions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from gazerig.params import Bounds

_Millimetres = Annotated[float, Bounds(-1000, 1000)]
PositionMm = tuple[_Millimetres, _Millimetres, _Millimetres]


@dataclass(frozen=True)
class LinkMassParams:
    """Mass of one link; null values follow from its shape."""

    # fmt: off
    mass_kg: Annotated[float | None, Bounds(1e-5, 50), "measured mass; null: from its shape"] = None
    com_mm: Annotated[PositionMm | None,
        "centre of mass ahead, left and above of the link's axis (for the head: of the neck's pitch axis), "
        "with all joints at 0; null: from its shape"] = None
    # fmt: on


@dataclass(frozen=True)
class CounterweightParams:
    """A weight added to a link, as a point."""

    # fmt: off
    mass_kg: Annotated[float, Bounds(0, 20), "mass of the weight"]
    position_mm: Annotated[PositionMm,
        "position ahead, left and above of the link's axis (for the head: of the neck's pitch axis)"]
    link: Annotated[str, "link that carries it: head, or a name of gazerig describe"] = "head"
    # fmt: on


@dataclass(frozen=True)
class MassParams:
    """Masses of the links."""

    # fmt: off
    head: Annotated[LinkMassParams,
        "the whole head with eyes, lids and servos in it, without counterweights"] = field(default_factory=LinkMassParams)
    links: Annotated[Mapping[str, LinkMassParams],
        "other links by their names in gazerig describe, such as left_eye or neck_yaw_link"] = field(default_factory=dict)
    counterweights: Annotated[Mapping[str, CounterweightParams],
        "weights added to links, each under any name"] = field(default_factory=dict)
    # fmt: on

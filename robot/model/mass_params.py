"""Parameters of the masses of a head and their positions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from gazerig.params import Bounds

_Millimetres = Annotated[float, Bounds(-1000, 1000)]
PositionMm = tuple[_Millimetres, _Millimetres, _Millimetres]


@dataclass(frozen=True)
class HeadMassParams:
    """Mass of the head; null values follow from its shape."""

    # fmt: off
    mass_kg: Annotated[float | None, Bounds(1e-5, 50), "measured mass; null: from its shape"] = None
    com_mm: Annotated[PositionMm | None,
        "centre of mass ahead, left and above of the neck's pitch axis, with all joints at 0; null: from its shape"] = None
    # fmt: on


@dataclass(frozen=True)
class CounterweightParams:
    """A weight added to the head, as a point."""

    # fmt: off
    mass_kg: Annotated[float, Bounds(0, 20), "mass of the weight"]
    position_mm: Annotated[PositionMm,
        "position ahead, left and above of the neck's pitch axis"]
    # fmt: on


@dataclass(frozen=True)
class MassParams:
    """Masses of a head."""

    # fmt: off
    head: Annotated[HeadMassParams,
        "the whole head with eyes, lids and servos in it, without counterweights"] = field(default_factory=HeadMassParams)
    counterweights: Annotated[Mapping[str, CounterweightParams],
        "weights added to the head, each under any name"] = field(default_factory=dict)
    # fmt: on

"""Parameters of the masses of a head and their positions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from gazerig.params import Bounds, Unit

Moments = tuple[float, float, float, float, float, float]
"""Moments and products of inertia: xx, yy, zz, xy, xz, yz."""


@dataclass(frozen=True)
class LinkMassParams:
    """Mass of one link; null values follow from shapes and density."""

    # fmt: off
    mass_kg: Annotated[float | None, Bounds(1e-5, 50), "measured mass; null: from its shape and the density"] = None
    com_mm: Annotated[tuple[float, float, float] | None, Bounds(-1000, 1000),
        "centre of mass ahead, left and above of the link's axis (for the head: of the neck's pitch axis), "
        "with all joints at 0; null: from its shape"] = None
    inertia_kg_mm2: Annotated[Moments | None, Bounds(-1e6, 1e6), Unit("kg mm2"),
        "moments and products of inertia about the centre of mass [xx, yy, zz, xy, xz, yz]; null: from its shape"] = None
    # fmt: on

    def __post_init__(self) -> None:
        """Check that a body can have this inertia.

        Raises:
            ValueError: It cannot; the message gives the rule.
        """
        if fault := self.inertia_fault():
            raise ValueError(fault)

    def inertia_fault(self) -> str:
        """Return the reason why no body can have this inertia, "" if one can."""
        if self.inertia_kg_mm2 is None:
            return ""
        xx, yy, zz, xy, xz, yz = self.inertia_kg_mm2
        tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        least, middle, most = np.linalg.eigvalsh(tensor).tolist()
        if least > 0.0 and least + middle >= most * (1.0 - 1e-9):
            return ""
        return (
            f"no body has the principal moments of inertia {least:.4g}, {middle:.4g} and "
            f"{most:.4g} kg mm2: all must be above 0, and none may exceed the sum of the other two"
        )


@dataclass(frozen=True)
class CounterweightParams:
    """A weight added to a link, as a point."""

    # fmt: off
    mass_kg: Annotated[float, Bounds(0, 20), "mass of the weight"]
    position_mm: Annotated[tuple[float, float, float], Bounds(-1000, 1000),
        "position ahead, left and above of the link's axis (for the head: of the neck's pitch axis)"]
    link: Annotated[str, "link that carries it: head, or a name of gazerig describe"] = "head"
    # fmt: on


@dataclass(frozen=True)
class MassParams:
    """Masses of the links, and compensation of their weight."""

    # fmt: off
    sag_share: Annotated[float, Bounds(0, 1.5),
        "share of the neck's sag under its weight that is added to the servos' goals; 0: none"] = 1.0
    density_kg_m3: Annotated[float, Bounds(50, 20_000),
        "density of printed parts with their usual share of air, for masses that are not given"] = 1050.0
    head: Annotated[LinkMassParams,
        "the whole head with eyes, lids and servos in it, without counterweights"] = field(default_factory=LinkMassParams)
    links: Annotated[Mapping[str, LinkMassParams],
        "other links by their names in gazerig describe, such as left_eye or neck_yaw_link"] = field(default_factory=dict)
    counterweights: Annotated[Mapping[str, CounterweightParams],
        "weights added to links, each under any name"] = field(default_factory=dict)
    # fmt: on

"""The joints of a run: the measures that they permit, and whether they are measured."""

from collections.abc import Collection
from dataclasses import dataclass

from gazerig.features.lab.analysis.human_norms import GROUPS
from gazerig.robot.control.feedback_basis import Basis, basis_of

LIDS = "Lids"
"""Section of the report that lids decide; eyes and neck decide the others."""


@dataclass(frozen=True)
class JointBasis:
    """The joints of a run.

    names: names in order; if empty, the joints are unknown and nothing is omitted
    estimated: joints whose servos have no feedback
    """

    names: tuple[str, ...] = ()
    estimated: tuple[str, ...] = ()

    def has_any(self, wanted: Collection[str]) -> bool:
        """Return whether the rig has any of some joints; True if none is wanted."""
        return not wanted or not self.names or not {*wanted}.isdisjoint(self.names)

    @property
    def has_measured_eye(self) -> bool:
        """Return whether an eye's servo reports its position."""
        eyes = {name for name in self.names if "eye" in name}
        return not eyes or not eyes <= {*self.estimated}

    @property
    def styles(self) -> frozenset[str]:
        """Return the styles that select notes of the bands."""
        return frozenset(("eyes parallel",) if "eyes_pan" in self.names else ())

    def basis(self, group: str) -> Basis:
        """Return the basis of a section of the report: its lids, or eyes and neck."""
        lids = group == LIDS
        return basis_of(self.names, self.estimated, lambda name: name.endswith("_lid") == lids)

    @property
    def whole_basis(self) -> Basis:
        """Return the basis of the whole report."""
        lids = any(name.endswith("_lid") for name in self.names)
        each = {self.basis(group) for group in GROUPS if lids or group != LIDS}
        return each.pop() if len(each) == 1 else "partly estimated"

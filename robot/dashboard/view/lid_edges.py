"""Positions of the edges of a rig's lids, from their openings."""

from collections.abc import Mapping
from typing import NamedTuple

from gazerig.robot.description.build import SIDES, RigShape
from gazerig.robot.description.parts import meeting_rad
from gazerig.robot.model.kinematics import LIDS


class LidEdges(NamedTuple):
    """Elevations above the eye's equator, in radians.

    meeting_rad: elevation at which the lids of each side meet
    span_rad: how far each lid opens from there, by its name
    """

    meeting_rad: Mapping[str, float]
    span_rad: Mapping[str, float]

    def elevation_rad(self, lid: str, opening: float) -> float:
        """Return the elevation of a lid's edge at an opening, 0..1."""
        side, which, _ = lid.split("_")
        up = 1.0 if which == "upper" else -1.0
        return self.meeting_rad[side] + up * opening * self.span_rad[lid]


def lid_edges(shape: RigShape) -> LidEdges:
    """Return the lid edges of a rig; a rig without lids has none."""
    span_rad = {
        name: abs(wide - shut)
        for name, (shut, wide) in ((name, shape.lids.get(name, (0.0, 0.0))) for name in LIDS)
    }
    meeting = {
        side: meeting_rad(span_rad[f"{side}_upper_lid"], span_rad[f"{side}_lower_lid"])
        for side in SIDES
    }
    return LidEdges(meeting, span_rad)

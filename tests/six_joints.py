"""Snapshots of a rig of six hobby servos: no neck, one linkage per axis for both eyes."""

from dataclasses import replace
from math import radians

from gazerig.robot.model.types import Servos, Snapshot, Trail

SIX = (
    "eyes_pan", "eyes_tilt", "left_upper_lid", "right_upper_lid", "left_lower_lid",
    "right_lower_lid",
)  # fmt: skip
WISH_RAD = tuple(radians(10.0 + i) for i in range(6))
ESTIMATED_RAD = tuple(radians(20.0 + i) for i in range(6))
TELLS_NOTHING = Servos(
    (None,) * 6, (None,) * 6, (0.0,) * 6, (True,) * 6, ("",) * 6, (0.0,) * 6, (0,) * 6
)


def of_six(shot: Snapshot, estimated: tuple[str, ...] = SIX) -> Snapshot:
    """Show the same for such a rig; estimated: its servos without feedback."""
    ghost = shot.commanded_pose
    return replace(
        shot,
        joints=SIX,
        estimated=estimated,
        desired_rad=WISH_RAD,
        commanded_rad=WISH_RAD,
        measured_rad=ESTIMATED_RAD,
        lids=(0.9, 0.5),
        lower_lids=(0.75, 0.25),
        servos=TELLS_NOTHING,
        commanded_pose=ghost._replace(lower_lids=(0.75, 0.25)) if ghost is not None else None,
        trail=(Trail(shot.t_s, WISH_RAD, WISH_RAD, ESTIMATED_RAD),),
    )

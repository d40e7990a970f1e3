"""A joint behind a push rod: marked places in, its linkage and range out. Pure.

Positions are in the unit of the servo's model (steps, or us of pulse width), angles in
degrees at the joint.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import degrees

from gazerig.features.bringup.calibration.joint_calibration import (
    SMALLEST_RANGE_DEG,
    CalibrationRefused,
    LinkageFit,
    inwards,
    is_lid,
    zero_of,
)
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.types import GAZE_JOINTS

Place = tuple[float, float]
"""(angle, position)"""


def angle_now(joint: JointParams, position: float) -> float:
    """Return the angle of a position as the rig file has it, to a tenth of a degree."""
    return round(degrees(joint.angle_rad(position * joint.facts.unit_steps)), 1) + 0.0


def between(one: float, other: float, count: int) -> list[float]:
    """Return so many positions spread evenly between two, in whole units."""
    return [float(round(one + (other - one) * i / (count + 1))) for i in range(1, count + 1)]


def likely_angle(joint: JointParams, position: float, one: Place, other: Place) -> float:
    """Return what angle a position between two marked ones will be: the old curve, bent to fit."""
    (low, at_low), (high, at_high) = one, other
    was_low, was_high = angle_now(joint, at_low), angle_now(joint, at_high)
    if was_low == was_high:
        share = (position - at_low) / (at_high - at_low)
    else:
        share = (angle_now(joint, position) - was_low) / (was_high - was_low)
    return round(low + share * (high - low), 1) + 0.0


def places(name: str, marked: Sequence[Place], joint: JointParams, margin_deg: float) -> LinkageFit:
    """Return linkage and range of a joint; a lid's range ends at its marked positions.

    Args:
        name: the joint's.
        marked: angles in degrees and positions, in any order.
        joint: as configured.
        margin_deg: kept from the ends of any other joint.

    Raises:
        CalibrationRefused: they make no linkage, or no
            range with 0 inside.
    """
    linkage = tuple(sorted((round(angle, 1) + 0.0, position) for angle, position in marked))
    kept = 0.0 if is_lid(name) else margin_deg
    low, high = -inwards(-(linkage[0][0] + kept)), inwards(linkage[-1][0] - kept)
    if name not in GAZE_JOINTS and linkage[0][0] <= 0.0 <= linkage[-1][0]:
        low, high = min(low, 0.0), max(high, 0.0)  # a jaw rests where it is shut, at one end
    if not low <= 0.0 <= high:
        raise CalibrationRefused(
            f"{name}: 0 deg must lie within its range, which is {low:g}..{high:g} deg: "
            + (
                "call half open 0"
                if is_lid(name)
                else f"call it {zero_of(name)} 0, or lessen the margin"
            )
        )
    if high - low <= SMALLEST_RANGE_DEG:
        raise CalibrationRefused(
            f"{name}: only {high - low:.1f} deg are between its ends, more than "
            f"{SMALLEST_RANGE_DEG:g} are needed: mark them farther apart, or lessen the margin"
        )
    made = LinkageFit(linkage, low + 0.0, high + 0.0)
    try:
        replace(joint, **made._asdict())
    except ValueError as error:
        raise CalibrationRefused(f"{name}: {error}: calibrate again") from error
    return made

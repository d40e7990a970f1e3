"""Calibration of a joint with a push rod: linkage and range from marked positions and read angles.

A hobby servo is moved by steps of its pulse width, because no sensor measures its position; a servo
that reports its position is turned by hand. Nothing is printed or written here.

Positions are in the unit of the servo's model (steps, or us of pulse width), angles in
degrees at the joint.
"""

from collections.abc import Sequence
from dataclasses import replace

from gazerig.features.bringup.calibration.hobby_access import HobbyServoAccess, angle_now
from gazerig.features.bringup.calibration.joint_calibration import (
    SMALLEST_RANGE_DEG,
    CalibrationRefused,
    LinkageFit,
    end_names,
    is_lid,
    round_inwards,
    zero_name,
)
from gazerig.features.bringup.calibration.joint_procedure import Operator
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.types import GAZE_JOINTS

Place = tuple[float, float]
"""(angle, position)"""


def likely_angle(joint: JointParams, position: float, one: Place, other: Place) -> float:
    """Return the likely angle of a position between two marks: the old curve, adjusted to them."""
    (low, at_low), (high, at_high) = one, other
    was_low, was_high = angle_now(joint, at_low), angle_now(joint, at_high)
    if was_low == was_high:
        share = (position - at_low) / (at_high - at_low)
    else:
        share = (angle_now(joint, position) - was_low) / (was_high - was_low)
    return round(low + share * (high - low), 1) + 0.0


def fit_linkage(
    name: str, marked: Sequence[Place], joint: JointParams, margin_deg: float
) -> LinkageFit:
    """Return linkage and range of a joint; a lid's range ends at its marked positions.

    Args:
        name: name of the joint.
        marked: angles in degrees and positions, in any order.
        joint: configuration of the joint.
        margin_deg: distance from the ends, except for lids.

    Raises:
        CalibrationRefused: the marks do not give a linkage, or a range that includes 0.
    """
    linkage = tuple(sorted((round(angle, 1) + 0.0, position) for angle, position in marked))
    kept = 0.0 if is_lid(name) else margin_deg
    low, high = -round_inwards(-(linkage[0][0] + kept)), round_inwards(linkage[-1][0] - kept)
    if name not in GAZE_JOINTS and linkage[0][0] <= 0.0 <= linkage[-1][0]:
        low, high = min(low, 0.0), max(high, 0.0)  # a jaw rests shut, at one end
    if not low <= 0.0 <= high:
        raise CalibrationRefused(
            f"{name}: 0 deg must be within its range, which is {low:g}..{high:g} deg: "
            + (
                "call half open 0"
                if is_lid(name)
                else f"call it {zero_name(name)} 0, or lessen the margin"
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


def calibrate_by_marks(hobby: HobbyServoAccess, person: Operator, margin_deg: float) -> LinkageFit:
    """Mark the ends of a joint, its zero, and a position between each two; ask for their angles.

    margin_deg: distance from the ends, not for lids

    Raises:
        CalibrationRefused: the marks do not give a linkage.
        DriverError: the servo does not answer any more.
        CalibrationStopped: the person ended it.
    """
    name, joint = hobby.name, hobby.joint
    positive, negative = end_names(name)

    def ask(at: float, proposed: float) -> Place:
        asked = f"{name} at {at:g} {joint.model_facts.unit}: how many degrees ({positive} is +)?"
        return person.ask_number(asked, proposed, hobby.live), at

    hobby.begin()
    if is_lid(name):
        meets = "meets the upper lid" if "lower" in name else "shall meet the lower lid"
        marked, ends = [], (("to where it is fully OPEN", 1), (f"to where it is SHUT: {meets}", -1))
    else:
        end = "to its {} end, as far as it goes freely"
        marked = [(0.0, hobby.mark(zero_name(name)))]
        ends = ((end.format(positive), 1), (end.format(negative), -1))
    for where, sign in ends:
        at = hobby.mark(where)
        marked.append(ask(at, sign * abs(angle_now(joint, at))))
    marked.sort()
    between = []
    for one, other in zip(marked, marked[1:], strict=False):
        at = hobby.move_to(float(round((one[1] + other[1]) / 2.0)))
        between.append(ask(at, likely_angle(joint, at, one, other)))
    made = fit_linkage(name, [*marked, *between], joint, margin_deg)
    # A lid stays shut, so that the other lid can be moved to meet it; friction must hold both.
    hobby.move_to(marked[0][1] if is_lid(name) else dict(marked)[0.0])
    hobby.live()  # the shaft is a moment behind its pulse
    return made

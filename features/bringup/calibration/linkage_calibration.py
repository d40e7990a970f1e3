"""Calibration of a joint with a push rod: linkage and range from marked positions and read angles.

A hobby servo is moved by steps of its pulse width, because no sensor measures its position; a servo
that reports its position is turned by hand. Nothing is printed or written here.

Positions are in the unit of the servo's model (steps, or us of pulse width), angles in
degrees at the joint.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import degrees
from typing import Protocol

from gazerig.features.bringup.calibration.joint_calibration import (
    SMALLEST_RANGE_DEG,
    CalibrationRefused,
    LinkageFit,
    end_names,
    is_lid,
    round_inwards,
    zero_name,
)
from gazerig.features.bringup.calibration.joint_procedure import Operator, PositionTracker
from gazerig.features.bringup.calibration.smart_servo_access import SmartServoAccess
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.types import GAZE_JOINTS

Place = tuple[float, float]
"""(angle, position)"""


def angle_now(joint: JointParams, position: float) -> float:
    """Return the angle of a position according to the rig file, to a tenth of a degree."""
    return round(degrees(joint.angle_rad(position * joint.model_facts.unit_steps)), 1) + 0.0


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


class Marker(Protocol):
    """Moves a joint to positions, and measures them in the unit of its servo's model."""

    name: str
    joint: JointParams

    def begin(self) -> None:
        """Hold the joint at its position, or switch its torque off."""
        ...

    def mark(self, where: str) -> float:
        """Let the user move the joint to a position; return it."""
        ...

    def move_to(self, place: float) -> float:
        """Move the joint to about a position; return the reached position."""
        ...

    def live(self) -> str:
        """Update the joint; return its position as text."""
        ...


class HandMarker:
    """Lets a person turn a servo without torque that reports its position; implements Marker."""

    def __init__(self, single: SmartServoAccess, person: Operator) -> None:
        self.name, self.joint = single.name, single.joint
        self._single, self._person = single, person

    def begin(self) -> None:
        """Switch the torque off."""
        self._single.disable_torque()
        self._person.tell(f"{self._single.who}: torque off, it can be turned by hand")
        self._watched = PositionTracker(self._single)

    def mark(self, where: str) -> float:
        """Let the user turn the joint to a position; return it in steps."""
        self._person.wait(f"turn {self.name} {where}, then press Enter", self.live)
        return float(self._watched.steps())

    def move_to(self, place: float) -> float:
        """Let the user turn the joint to about a position in steps; return the reached position."""
        return self.mark(f"until it reads about step {place:.0f}")

    def live(self) -> str:
        """Return the position as text."""
        return self._watched.live()


def calibrate_by_marks(placer: Marker, person: Operator, margin_deg: float) -> LinkageFit:
    """Mark the ends of a joint, its zero, and a position between each two; ask for their angles.

    margin_deg: distance from the ends, not for lids

    Raises:
        CalibrationRefused: the marks do not give a linkage.
        DriverError: the servo does not answer any more.
        CalibrationStopped: the person ended it.
    """
    name, joint = placer.name, placer.joint
    positive, negative = end_names(name)

    def ask(at: float, proposed: float) -> Place:
        asked = f"{name} at {at:g} {joint.model_facts.unit}: how many degrees ({positive} is +)?"
        return person.ask_number(asked, proposed, placer.live), at

    placer.begin()
    if is_lid(name):
        meets = "meets the upper lid" if "lower" in name else "shall meet the lower lid"
        marked, ends = [], (("to where it is fully OPEN", 1), (f"to where it is SHUT: {meets}", -1))
    else:
        end = "to its {} end, as far as it goes freely"
        marked = [(0.0, placer.mark(zero_name(name)))]
        ends = ((end.format(positive), 1), (end.format(negative), -1))
    for where, sign in ends:
        at = placer.mark(where)
        marked.append(ask(at, sign * abs(angle_now(joint, at))))
    marked.sort()
    between = []
    for one, other in zip(marked, marked[1:], strict=False):
        at = placer.move_to(float(round((one[1] + other[1]) / 2.0)))
        between.append(ask(at, likely_angle(joint, at, one, other)))
    made = fit_linkage(name, [*marked, *between], joint, margin_deg)
    if joint.model_facts.measures_position:
        return made
    # A lid stays shut, so that the other lid can be moved to meet it; friction must hold both.
    placer.move_to(marked[0][1] if is_lid(name) else dict(marked)[0.0])
    placer.live()  # the shaft is a moment behind its pulse
    return made

"""Calibration of a joint with a push rod: linkage and range from marked positions and read angles.

A hobby servo is moved by steps of its pulse width, because no sensor measures its position; a servo
that reports its position is turned by hand. Nothing is printed or written here.

Positions are in the unit of the servo's model (steps, or us of pulse width), angles in
degrees at the joint.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import degrees
from typing import Protocol

from gazerig.features.bringup.calibration.hobby_access import HobbyServoAccess
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


def spread_between(one: float, other: float, count: int) -> list[float]:
    """Return ``count`` positions spread evenly between two, in whole units."""
    return [float(round(one + (other - one) * i / (count + 1))) for i in range(1, count + 1)]


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


SHUT_WHERE = {
    "upper_lid": "to where it is SHUT: where it shall meet the lower lid",
    "lower_lid": "to where it is SHUT: where it meets the upper lid",
}


LEAD_US = 50.0
"""Travel in a quarter of a second at its slow speed, until it stops after the release of a key."""


class Jogger(Operator, Protocol):
    """Person who moves a servo by small steps, and reads angles."""

    def steer(self, question: str, servo: "HobbyMarker") -> None:
        """Return when the servo has the desired position.

        Raises:
            CalibrationStopped: the user requested the end.
        """
        ...

    def ask_number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        """Return the person's number, or the proposed one if the person accepts it."""
        ...


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

    def leave(self, place: float) -> None:
        """Move the joint to a position and leave it there, if it has a motor."""
        ...

    def live(self) -> str:
        """Update the joint; return its position as text."""
        ...


class HobbyMarker:
    """Moves a hobby servo under a person's control; implements Marker."""

    def __init__(self, hobby: HobbyServoAccess, person: Jogger) -> None:
        self.name, self.joint = hobby.name, hobby.joint
        self._hobby, self._person = hobby, person

    def begin(self) -> None:
        """Hold the joint at its present pulse, or at the first pulse that the user chooses."""
        hobby, person = self._hobby, self._person
        at_us = hobby.open()
        if at_us is None:
            rest = self.joint.make_linkage().steps(0.0) / self.joint.model_facts.unit_steps
            at_us = person.ask_number(
                f"{hobby.who} gets no pulses, so its position is not known: it goes to the first "
                "one at once, at its own full speed. Keep your fingers out. "
                "At which pulse width (us) shall it begin?",
                float(round(rest)),
                lambda: "",
            )
        began_us = hobby.begin(at_us)
        self._tell_events()
        person.tell(
            f"{hobby.who}: held at {began_us:g} us; should this program die, its guardian stops "
            "the pulses; should the computer die, cut the servo power"
        )

    def mark(self, where: str) -> float:
        """Let the user move the joint to a position; return the pulse width in us."""
        self._person.steer(f"move {self.name} {where}, then press Enter", self)
        return self._arrive()

    def move_by_us(self, us: float) -> None:
        """Move the joint by a pulse width."""
        self._hobby.aim(self._hobby.place_us + us)

    def nudge(self, us: float) -> None:
        """Move the joint by a pulse width, at most ``LEAD_US`` ahead of its pulse."""
        at_us = self._hobby.pulse_us
        self._hobby.aim(min(max(self._hobby.place_us + us, at_us - LEAD_US), at_us + LEAD_US))

    def move_to_us(self, us: float) -> None:
        """Move the joint to a pulse width."""
        self._hobby.aim(us)

    def move_to(self, place: float) -> float:
        """Move the joint slowly to a pulse width in us; return the reached width."""
        self._hobby.aim(place)
        return self._arrive()

    def leave(self, place: float) -> None:
        """Move the joint slowly to a position at which friction must hold it."""
        self.move_to(place)

    def _arrive(self) -> float:
        at_us = self._hobby.arrive()
        self._tell_events()
        return at_us

    def live(self) -> str:
        """Continue the motion; return pulse width and angle as text."""
        self._hobby.look()
        self._tell_events()
        at_us = self._hobby.place_us
        return f"{self.name}: {at_us:g} us ({angle_now(self.joint, at_us):+.1f} deg so far)"

    def _tell_events(self) -> None:
        for line in self._hobby.events():
            self._person.tell(line)


class HandMarker:
    """Lets a person turn a servo without torque that reports its position; implements Marker."""

    def __init__(self, single: SmartServoAccess, person: Operator) -> None:
        self.name, self.joint = single.name, single.joint
        self._single, self._person = single, person
        self._watched = PositionTracker(single)

    def begin(self) -> None:
        """Switch the torque off."""
        self._single.disable_torque()
        self._person.tell(f"{self._single.who}: torque off, it can be turned by hand")

    def mark(self, where: str) -> float:
        """Let the user turn the joint to a position; return it in steps."""
        self._person.wait(f"turn {self.name} {where}, then press Enter", self.live)
        return float(self._watched.steps())

    def move_to(self, place: float) -> float:
        """Let the user turn the joint to about a position in steps; return the reached position."""
        return self.mark(f"until it reads about step {place:.0f}")

    def leave(self, place: float) -> None:
        """Do nothing: its torque is off."""

    def live(self) -> str:
        """Return the position as text."""
        return self._watched.live()


def calibrate_by_marks(placer: Marker, person: Jogger, margin_deg: float, more: int) -> LinkageFit:
    """Mark the positions of a joint and ask for their angles.

    more: number of positions between two marks; margin_deg: distance from the ends, not for lids

    Raises:
        CalibrationRefused: the marks do not give a linkage.
        DriverError: the servo does not answer any more.
        CalibrationStopped: the person ended it.
    """
    placer.begin()
    positive, negative = end_names(placer.name)
    if is_lid(placer.name):
        shut = next(where for part, where in SHUT_WHERE.items() if placer.name.endswith(part))
        marked, ends = [], (("to where it is fully OPEN", 1), (shut, -1))
    else:
        end = "to its {} end, as far as it goes freely"
        marked = [(0.0, placer.mark(zero_name(placer.name)))]
        ends = ((end.format(positive), 1), (end.format(negative), -1))
    for where, sign in ends:
        at = placer.mark(where)
        marked.append((_angle(placer, person, at, sign * abs(angle_now(placer.joint, at))), at))
    marked.sort()
    all_places = list(marked)
    for one, other in zip(marked, marked[1:], strict=False):
        for place in spread_between(one[1], other[1], more):
            at = placer.move_to(place)
            likely = likely_angle(placer.joint, at, one, other)
            all_places.append((_angle(placer, person, at, likely), at))
    made = fit_linkage(placer.name, all_places, placer.joint, margin_deg)
    # A lid stays shut, so that the other lid can be moved to meet it.
    placer.leave(marked[0][1] if is_lid(placer.name) else dict(marked)[0.0])
    return made


def _angle(placer: Marker, person: Jogger, at: float, proposed: float) -> float:
    """Ask for the angle of the joint's present position."""
    towards = f" ({end_names(placer.name)[0]} is +)"
    asked = f"{placer.name} at {at:g} {placer.joint.model_facts.unit}: how many degrees{towards}?"
    return person.ask_number(asked, proposed, placer.live)

"""Calibration of one joint, step by step: a hand or gentle motion turns it, a person judges.

Nothing is printed or written here: ``Operator`` asks the questions, and the result is a value.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.features.bringup.calibration.endstop_search import (
    BACK_OFF_DEG,
    SPEED_DEG_S,
    STRENGTH,
)
from gazerig.features.bringup.calibration.joint_calibration import (
    Calibration,
    CalibrationRefused,
    Marks,
    PositionUnwrapper,
    centre_zero,
    end_names,
    is_lid,
    joint_calibration,
    zero_name,
)
from gazerig.features.bringup.calibration.smart_servo_access import SmartServoAccess
from gazerig.robot.model.types import GAZE_JOINTS

if TYPE_CHECKING:
    from gazerig.features.bringup.calibration.hobby_calibration import HobbyServoAccess


class Operator(Protocol):
    """A person who answers; ``live`` is called more than 20 times a second meanwhile.

    Every method but ``tell`` raises CalibrationStopped if the user requested the end.
    """

    def tell(self, line: str) -> None:
        """Show the present activity."""
        ...

    def wait(self, question: str, live: Callable[[], str]) -> None:
        """Return when the person is done; ``live`` returns the line to show meanwhile."""
        ...

    def agrees(self, question: str, live: Callable[[], str]) -> bool:
        """Return the person's yes or no."""
        ...

    def steer(self, question: str, servo: "HobbyServoAccess") -> None:
        """Return when the person has moved a hobby servo to the desired position."""
        ...

    def ask_number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        """Return the person's number, or the proposed one if the person accepts it."""
        ...


class PositionTracker:
    """Tracker of a joint's position over the seam, with a line that shows it."""

    def __init__(self, single: SmartServoAccess) -> None:
        self._single = single
        self._track = PositionUnwrapper()
        self._first = self.steps()

    def live(self) -> str:
        """Add a sample; return the position as text."""
        steps = self.steps()
        turned = (steps - self._first) * 360.0 / STEPS_PER_TURN / self._single.joint.ratio
        return (
            f"{self._single.name}: step {steps % STEPS_PER_TURN:4d}, "
            f"turned {turned:+7.1f} deg since the start"
        )

    def steps(self) -> int:
        """Add a sample; return the unwrapped position."""
        return self._track.see(*self._single.position())


def calibrate_by_hand(single: SmartServoAccess, person: Operator, margin_deg: float) -> Calibration:
    """Let the user turn the joint, with torque off, to its ends and straight ahead.

    Raises:
        CalibrationRefused: the marks are not sufficient for a calibration.
        DriverError: the servo does not answer any more.
        CalibrationStopped: the person ended it.
    """
    single.disable_torque()
    person.tell(f"{single.who}: torque off, it can be turned by hand")
    watched = PositionTracker(single)
    positive, negative = end_names(single.name)

    def mark(where: str) -> int:
        person.wait(f"turn {single.name} {where}, then press Enter", watched.live)
        return watched.steps()

    marks = Marks(mark(f"to its {positive} end"), mark(f"to its {negative} end"), 0)
    if is_lid(single.name):
        marks = centre_zero(marks)
    else:
        marks = marks._replace(zero=mark(zero_name(single.name)))
    return joint_calibration(single.name, marks, single.joint, margin_deg)


def calibrate_by_motion(
    single: SmartServoAccess, person: Operator, margin_deg: float
) -> Calibration:
    """Drive the joint slowly and weakly to both stops.

    The zero is in the middle, or set by hand for a joint that gaze does not move.

    Raises:
        CalibrationRefused: the stops are not sufficient for a calibration.
        DriverError: the servo is not suitable, or does not answer any more.
        CalibrationStopped: the person ended it.
    """
    try:
        way, positive = single.joint.sign, end_names(single.name)[0]
        single.enable_torque()
        person.tell(
            f"{single.who}: torque on at {STRENGTH:.0%} of its strength, moving at "
            f"{SPEED_DEG_S:g} deg/s{single.alone}"
        )
        first = _find_stop(single, person, way)
        asked = f"did {single.name} just go to its {positive} end?"
        agreed = person.agrees(asked, PositionTracker(single).live)
        second = _find_stop(single, person, -way)
        single.go((first + second) // 2)
    finally:
        single.restore()
    person.tell(f"{single.who}: torque off")
    marks = Marks(first, second, 0) if agreed else Marks(second, first, 0)
    if single.name in GAZE_JOINTS:
        marks = centre_zero(marks)
    else:
        watched = PositionTracker(single)
        person.wait(f"turn {single.name} {zero_name(single.name)}, then press Enter", watched.live)
        marks = marks._replace(zero=watched.steps())
    return joint_calibration(single.name, marks, single.joint, margin_deg)


def _find_stop(single: SmartServoAccess, person: Operator, way: int) -> int:
    """Find one stop; return its position."""
    stop = single.find_stop(way)
    if stop.kind == "limit":
        raise CalibrationRefused(
            f"{single.name}: it came to the end of the servo's turn "
            f"(step {stop.position_steps}) before a stop: build the horn in so that the middle "
            "of its travel reads about 2048 (--by hand reports by how much)"
        )
    person.tell(
        f"{single.who}: stop at step {stop.position_steps}, pushed for "
        f"{stop.pushed_s * 1e3:.0f} ms, went back by {BACK_OFF_DEG:g} deg"
    )
    return stop.position_steps

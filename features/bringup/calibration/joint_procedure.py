"""Calibration of one joint, step by step: a hand turns it, a person judges.

Nothing is printed or written here: ``Operator`` asks the questions, and the result is a value.
"""

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.features.bringup.calibration.hobby_calibration import Operator
from gazerig.features.bringup.calibration.joint_calibration import (
    Calibration,
    Marks,
    PositionUnwrapper,
    centre_zero,
    end_names,
    is_lid,
    joint_calibration,
    zero_name,
)
from gazerig.features.bringup.calibration.smart_servo_access import SmartServoAccess


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

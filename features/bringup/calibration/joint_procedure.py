"""Calibration of one joint, step by step: a hand or gentle motion turns it, a person judges.

Nothing is printed or written here: ``Operator`` asks the questions, and the result is a value.
"""

from collections.abc import Callable
from typing import Literal, Protocol

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.features.bringup.calibration.endstop_search import EndStop, StopSearchParams
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

ZeroReference = Literal["middle", "person"]


class Operator(Protocol):
    """A person who answers; ``live`` is called more than 20 times a second meanwhile."""

    def tell(self, line: str) -> None:
        """Show the present activity."""
        ...

    def wait(self, question: str, live: Callable[[], str]) -> None:
        """Return when the person is done; ``live`` returns the line to show meanwhile.

        Raises:
            CalibrationStopped: the user requested the end.
        """
        ...

    def agrees(self, question: str, live: Callable[[], str]) -> bool:
        """Return the person's yes or no; see ``wait``."""
        ...


class PositionTracker:
    """Tracker of a joint's position over the seam, with a line that shows it."""

    def __init__(self, single: SmartServoAccess) -> None:
        self._single = single
        self._track = PositionUnwrapper()
        self._first: int | None = None

    def live(self) -> str:
        """Add a sample; return the position as text."""
        steps, first = self.steps(), self._first
        first = steps if first is None else first
        self._first = first
        turned = (steps - first) * 360.0 / STEPS_PER_TURN / self._single.joint.ratio
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
    watched = PositionTracker(single)
    positive, negative = end_names(single.name)
    person.tell(f"{single.who}: torque off, it can be turned by hand")

    def mark(where: str) -> int:
        person.wait(f"turn {single.name} {where}, then press Enter", watched.live)
        return watched.steps()

    first = mark(f"to its {positive} end")
    marks = Marks(first, mark(f"to its {negative} end"), 0)
    marks = (
        centre_zero(marks)
        if is_lid(single.name)
        else marks._replace(zero=mark(zero_name(single.name)))
    )
    return joint_calibration(single.name, marks, single.joint, margin_deg)


def calibrate_by_motion(
    single: SmartServoAccess,
    person: Operator,
    margin_deg: float,
    params: StopSearchParams,
    zero_by: ZeroReference,
) -> Calibration:
    """Drive the joint slowly and weakly to both stops; set the zero in the middle or by hand.

    Raises:
        CalibrationRefused: the stops are not sufficient for a calibration.
        DriverError: the servo is not suitable, or does not answer any more.
        CalibrationStopped: the person ended it.
    """
    try:
        positive, negative = end_names(single.name)
        way = single.joint.sign
        single.enable_torque(params)
        person.tell(
            f"{single.who}: torque on at {params.strength:.0%} of its strength, "
            f"moving at {params.speed_deg_s:g} deg/s"
        )
        if single.alone:
            person.tell(f"{single.who}: {single.alone}")
        first = _find_stop(single, person, params, way)
        asked = f"did {single.name} just go to its {positive} end?"
        sign = way if person.agrees(asked, PositionTracker(single).live) else -way
        second = _find_stop(single, person, params, -way)
        single.go(params, (first + second) // 2)
        marks = Marks(first, second, 0) if sign == way else Marks(second, first, 0)
    finally:
        single.restore()
    person.tell(f"{single.who}: torque off")
    if zero_by == "person" and not is_lid(single.name):
        watched = PositionTracker(single)
        person.wait(f"turn {single.name} {zero_name(single.name)}, then press Enter", watched.live)
        marks = marks._replace(zero=watched.steps())
    else:
        marks = centre_zero(marks)
    return joint_calibration(single.name, marks, single.joint, margin_deg)


def _find_stop(
    single: SmartServoAccess, person: Operator, params: StopSearchParams, way: int
) -> int:
    """Find one stop; return its position."""
    stop: EndStop = single.find_stop(params, way)
    if stop.kind == "limit":
        raise CalibrationRefused(
            f"{single.name}: it came to the end of the servo's turn "
            f"(step {stop.position_steps}) before a stop: build the horn in so that the middle "
            "of its travel reads about 2048 (--by hand reports by how much)"
        )
    person.tell(
        f"{single.who}: stop at step {stop.position_steps}, pushed for "
        f"{stop.pushed_s * 1e3:.0f} ms, went back by {params.back_off_deg:g} deg"
    )
    return stop.position_steps

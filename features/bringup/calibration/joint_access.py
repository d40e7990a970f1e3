"""One joint by itself, on a servo with feedback: moved by hand without torque, or driven gently."""

from collections.abc import Callable

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.drivers.errors import DriverError, ServoFault
from gazerig.features.bringup.calibration.endstop_search import (
    STEPS_PER_DEG,
    EndStop,
    StopSearchParams,
    go,
    search,
)
from gazerig.features.bringup.calibration.smart_servo_access import SingleServo
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.joint import JointParams

PERIOD_S = 0.02
"""A search looks 50 times a second where the line is quick enough."""


class CalibrationStopped(DriverError):
    """The user or the system asked to end: torque off. The message says which."""


class SingleJoint:
    """The servo of one joint. Where it does not answer any more, methods raise BusLost.

    Args:
        name: the joint's.
        joint: as configured.
        servo: its servo.
        clock: the host's.
        stopped: asked all the time; returns why to stop, None while there is no reason.
    """

    def __init__(
        self,
        name: str,
        joint: JointParams,
        servo: SingleServo,
        clock: Clock,
        stopped: Callable[[], str | None],
    ) -> None:
        self.name = name
        self.joint = joint
        self.who = servo.who
        self.alone = servo.alone
        self.servo = servo
        self._clock = clock
        self._stopped = stopped
        self._at_s = clock.now_s()

    def position(self) -> tuple[int, float]:
        """Return the present position and the time of the reading."""
        value = self.servo.position()
        self._at_s = self._clock.now_s()
        return value, self._at_s

    # --- driven gently

    def enable_torque(self, params: StopSearchParams) -> None:
        """Switch the torque on where the joint is, weak and slow; see SingleServo."""
        self.servo.enable_torque(params.strength, 2.0 * params.speed_deg_s * STEPS_PER_DEG)

    def find_stop(self, params: StopSearchParams, direction: int) -> EndStop:
        """Lead it to its stop towards more (1) or fewer (-1) steps, and a little back.

        Raises:
            BusLost: it does not answer any more.
            ServoFault: it let go on the way, so where it stood was no stop.
            CalibrationStopped: a person or the system asked for it.
        """
        stop = search(params, direction, (0, STEPS_PER_TURN - 1), self._exchange)
        if not self.servo.torque_is_on():
            raise ServoFault(
                f"{self.who} let go on the way: it protected itself or restarted; "
                "check its supply and start again"
            )
        return stop

    def go(self, params: StopSearchParams, goal_steps: int) -> bool:
        """Lead it slowly to a position; return whether it came there unhindered."""
        return go(goal_steps, params, self._exchange)

    def _exchange(self, goal: int | None) -> tuple[int, float, float]:
        why = self._stopped()
        if why is not None:
            raise CalibrationStopped(why)
        self._clock.sleep_until(self._at_s + PERIOD_S)
        if goal is not None:
            self.servo.send(goal)
        position, at_s = self.position()
        return position, self.servo.load(), at_s

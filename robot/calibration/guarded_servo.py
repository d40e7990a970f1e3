"""One servo without a watchdog, driven for calibrating under a guardian's eyes."""

from gazerig.drivers.errors import ServoFault
from gazerig.robot.calibration.servo_access import Found, OneServo
from gazerig.robot.guardian.guardian import Guardian


class GuardedServo:
    """Adds a guardian to a servo by itself; implements ``servo_access.OneServo``.

    Signs of life are the bytes that its port sends and waits for.

    Args:
        servo: without a watchdog; its port calls ``guardian.beat``.
        guardian: has one plan, that of this servo.
    """

    alone = (
        "these servos have no watchdog: should this program die, its guardian switches the torque "
        "off"
    )

    def __init__(self, servo: OneServo, guardian: Guardian) -> None:
        self.who = servo.who
        self._servo, self._guardian = servo, guardian

    def hold(self, strength: float, speed_steps_s: float) -> None:
        """Switch the torque on with a guardian beside it; see OneServo.

        Raises:
            SetupError: the guardian does not start.
        """
        self._guardian.join(0)
        self._guardian.arm(0)
        self._servo.hold(strength, speed_steps_s)

    def send(self, goal_steps: int) -> None:
        """Send a goal.

        Raises:
            ServoFault: the program stood still, and the guardian has let go.
        """
        if self._guardian.released(0):
            raise ServoFault(
                f"{self.who}: the program stood still, so its guardian switched the torque off: "
                "begin anew"
            )
        self._servo.send(goal_steps)

    def let_go(self) -> None:
        """Take the torque away, and see that it is gone."""
        self._servo.let_go()
        self._end()

    def leave(self) -> None:
        """Torque off, and everything else as it was found."""
        self._servo.leave()
        self._end()

    def check(self) -> Found:
        """See that it is the right servo, sound, and in position mode."""
        return self._servo.check()

    def clear_offset(self) -> int:
        """Set its offset to 0, torque off; return what it was."""
        return self._servo.clear_offset()

    def set_middle(self) -> int:
        """Let the limp servo call its present place the middle; return its new offset."""
        return self._servo.set_middle()

    def position(self) -> int:
        """Return the present position in steps."""
        return self._servo.position()

    def load(self) -> float:
        """Return the present current as a share of the stall current."""
        return self._servo.load()

    def holds(self) -> bool:
        """Return whether the torque is on."""
        return self._servo.holds()

    def _end(self) -> None:
        self._guardian.disarm(0)
        self._guardian.leave(0)

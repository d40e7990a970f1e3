"""What calibrating asks of one servo that tells its place, whatever it speaks."""

from typing import NamedTuple, Protocol

from gazerig.drivers.errors import BusLost
from gazerig.drivers.servo_bus.registers import Registers


class Found(NamedTuple):
    """What a servo says of itself before it is calibrated; limits are those of its goals."""

    firmware: int
    limits: tuple[int, int]
    homing_offset: int


class OneServo(Protocol):
    """One servo by itself; the others of its line are left as they are.

    What it changes in the servo it puts back. Every method may raise
    BusLost where the servo does not answer any more.

    who: what messages call it, "neck_yaw (servo 7)"
    alone: what it does when this program dies while it is driven, with the cure; "" where it
        stops by itself
    """

    who: str
    alone: str

    def check(self) -> Found:
        """See that it is the right servo, sound, and in position mode.

        Raises:
            ServoMissing: it does not answer, is another model, or is set up
                in another way.
            ServoFault: it suffers from something.
        """
        ...

    def clear_offset(self) -> int:
        """Set its offset to 0, torque off; gives what it was."""
        ...

    def set_middle(self) -> int:
        """Let the limp servo call its present place the middle, 2048; gives its new offset.

        Raises:
            SetupError: this kind cannot.
        """
        ...

    def let_go(self) -> None:
        """Take the torque away, and see that it is gone."""
        ...

    def position(self) -> int:
        """Return the present position in steps."""
        ...

    def load(self) -> float:
        """Return the present current as a share of the stall current, signed; 0 where unknown."""
        ...

    def hold(self, strength: float, speed_steps_s: float) -> None:
        """Switch the torque on where it is, weak and slow; goals may lead anywhere in the turn.

        strength: share of full drive

        Raises:
            ServoMissing: the position does not lie within one turn.
            ServoFault: the torque does not come on, or the position jumped.
        """
        ...

    def holds(self) -> bool:
        """Return whether the torque is on."""
        ...

    def send(self, goal_steps: int) -> None:
        """Send a goal."""
        ...

    def leave(self) -> None:
        """Torque off, and everything else as it was found."""
        ...


class Asked:
    """The registers of one servo, where silence is an error.

    who: what messages call it
    """

    def __init__(self, registers: Registers, servo_id: int, who: str) -> None:
        self._registers = registers
        self._id = servo_id
        self.who = who

    def value(self, register: str) -> int:
        """Return a register's value.

        Raises:
            BusLost: it does not answer any more.
        """
        value = self._registers.read(self._id, register)
        if value is None:
            raise BusLost(f"{self.who} does not answer any more: check its cable and power")
        return value

    def put(self, register: str, value: int) -> None:
        """Write a register.

        Raises:
            BusLost: it does not answer any more, or refuses the value.
        """
        if not self._registers.write(self._id, register, value):
            raise BusLost(f"{self.who} does not take {register} {value}: check its cable and power")

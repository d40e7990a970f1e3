"""What befalls the hobby servos behind an emulated board, whatever board that is."""

from collections.abc import Sequence
from typing import Protocol

from gazerig.sim_mock.faults.grammar import Commands
from gazerig.sim_mock.faults.line import LineFaults, Struck
from gazerig.sim_mock.hobby_servo import HobbyServo


class HobbyBody(Protocol):
    """A board's body: its servos, their supply, and time.

    servo_power: the servos have their supply
    """

    servo_power: bool

    @property
    def servos(self) -> Sequence[HobbyServo]:
        """Return the servos, in the order of their channels."""
        ...

    def advance(self) -> None:
        """Let time pass up to now."""
        ...


class HobbyBoard(Struck, Protocol):
    """A board with hobby servos behind it."""

    @property
    def body(self) -> HobbyBody:
        """Return the board without its line."""
        ...

    def here(self, servo_id: int, /) -> HobbyServo:
        """Return the servo of a channel, brought up to now."""
        ...


class HobbyFaults(LineFaults):
    """The faults of a line, a board and its servos; an id is a channel. Args: as LineFaults."""

    noun = "channel"

    def __init__(self, board: HobbyBoard, commands: Commands, seed: int, header: bytes) -> None:
        super().__init__(board, commands, seed, header)
        self._hobby = board

    def power(self, on: bool = True) -> str:
        """Return the servos their supply, or take it; what gives the pulses notices nothing."""
        self._hobby.body.advance()
        self._hobby.body.servo_power = on
        return f"the servos have {'their' if on else 'no'} supply"

    def stick(self, channel: int | None) -> str:
        """Jam a servo where it is."""
        for servo in self._servos(channel):
            servo.stuck = True
        return f"{self.who(channel)} is stuck"

    def free(self, channel: int | None) -> str:
        """Let a jammed servo go."""
        for servo in self._servos(channel):
            servo.stuck = False
        return f"{self.who(channel)} is free"

    def turn(self, channel: int | None, steps: float) -> str:
        """Turn a servo by hand.

        Raises:
            ValueError: it is stuck.
        """
        for servo in self._servos(channel):
            servo.turn(steps)
        return f"{self.who(channel)} was turned by {steps:g} quarter us"

    def _servos(self, channel: int | None) -> Sequence[HobbyServo]:
        """Return a servo, or all (None), brought up to now."""
        if channel is not None:
            return [self._hobby.here(channel)]
        self._hobby.body.advance()
        return self._hobby.body.servos

"""Faults of the hobby servos on any kind of emulated board."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from gazerig.sim_mock.faults.grammar import (
    SWITCH,
    Argument,
    CommandTable,
    Verb,
    id_or_all,
    integer_parser,
    number_parser,
)
from gazerig.sim_mock.faults.line import FaultTarget, LineFaults
from gazerig.sim_mock.faults.verbs import adapter_verbs, closing_verbs, line_verbs, loss_verb
from gazerig.sim_mock.hobby_servo import HobbyServo


class HobbyBody(Protocol):
    """A board's body: its servos, their supply, and time.

    servo_power: whether the servos have their supply
    """

    servo_power: bool

    @property
    def servos(self) -> Sequence[HobbyServo]:
        """Return the servos, in the order of their channels."""
        ...

    def advance(self) -> None:
        """Advance to the present time."""
        ...


class HobbyBoard(FaultTarget, Protocol):
    """A board with hobby servos."""

    @property
    def body(self) -> HobbyBody:
        """Return the board without its line."""
        ...

    def find_servo(self, servo_id: int, /) -> HobbyServo:
        """Return the servo of a channel, advanced to the present time."""
        ...

    def restart(self) -> None:
        """Restart as after a dip of the supply."""
        ...

    def channel_report(self, channel: int) -> dict[str, object]:
        """Return the status of a channel's output."""
        ...


class HobbyFaults(LineFaults):
    """Faults of a line, a board and its servos; an id is a channel. Args: as LineFaults."""

    noun = "channel"

    def __init__(self, board: HobbyBoard, commands: CommandTable, seed: int, header: bytes) -> None:
        super().__init__(board, commands, seed, header)
        self._hobby = board

    def brown_out(self) -> str:
        """Restart the board as after a dip of the supply, which no answer shows."""
        self._hobby.restart()
        return "the board restarts"

    def power(self, on: bool = True) -> str:
        """Switch the servos' supply on or off, which the board does not detect."""
        self._hobby.body.advance()
        self._hobby.body.servo_power = on
        return f"the servos have {'their' if on else 'no'} supply"

    def stick(self, channel: int | None) -> str:
        """Jam a servo at its position."""
        for servo in self._servos(channel):
            servo.stuck = True
        return f"{self.label(channel)} is stuck"

    def free(self, channel: int | None) -> str:
        """Release a jammed servo."""
        for servo in self._servos(channel):
            servo.stuck = False
        return f"{self.label(channel)} is free"

    def turn(self, channel: int | None, steps: float) -> str:
        """Turn a servo by hand.

        Raises:
            ValueError: it is stuck.
        """
        for servo in self._servos(channel):
            servo.turn(steps)
        return f"{self.label(channel)} was turned by {steps:g} quarter us"

    def _servos(self, channel: int | None) -> Sequence[HobbyServo]:
        """Return a servo, or all (None), advanced to the present time."""
        if channel is not None:
            return [self._hobby.find_servo(channel)]
        self._hobby.body.advance()
        return self._hobby.body.servos

    def reports(self) -> list[dict[str, object]]:
        """Return every channel's output and true servo position."""
        self._hobby.body.advance()
        return [
            {
                "id": nth,
                **self._hobby.channel_report(nth),
                "place": round(servo.place_steps, 1),
                "straining": servo.is_straining,
            }
            for nth, servo in enumerate(self._hobby.body.servos)
        ]


def channel_word(highest: int) -> Argument:
    """Return the argument that names a channel."""
    return Argument("ID", integer_parser(0, highest, "a channel"))


# fmt: off
def hobby_verbs(one: Argument, writes: str, own: Mapping[str, Verb]) -> dict[str, Verb]:
    """Return the fault commands of a board of hobby servos."""
    label = Argument(one.label, id_or_all(one.read))
    return {
        **line_verbs(one),
        "lose-writes": loss_verb("lose_writes", writes),
        "lose-bytes": loss_verb("lose_bytes", "bytes of the host"),
        **adapter_verbs(),
        **own,
        "brown-out": Verb(HobbyFaults.brown_out, (),
                          "the board restarts as a dip of its supply makes it"),
        "power": Verb(HobbyFaults.power, (SWITCH,),
                      "supply of the servos; the board does not detect it"),
        "stick": Verb(HobbyFaults.stick, (label,), "jam the servo at its position"),
        "free": Verb(HobbyFaults.free, (label,), "free a jammed servo"),
        "turn": Verb(HobbyFaults.turn, (label, Argument("STEPS", number_parser(-1e5, 1e5, "quarter us"))),
                     "turn the servo by hand; with pulses it returns"),
        **closing_verbs(one),
    }
# fmt: on

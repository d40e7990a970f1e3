"""Faults of the hobby servos behind an emulated board of any kind."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from gazerig.sim_mock.faults.grammar import (
    SWITCH,
    Argument,
    CommandTable,
    Verb,
    number,
    or_all,
    whole,
)
from gazerig.sim_mock.faults.line import FaultTarget, LineFaults
from gazerig.sim_mock.faults.verbs import adapter_verbs, closing_verbs, line_verbs, lost
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


class HobbyBoard(FaultTarget, Protocol):
    """A board with hobby servos behind it."""

    @property
    def body(self) -> HobbyBody:
        """Return the board without its line."""
        ...

    def here(self, servo_id: int, /) -> HobbyServo:
        """Return the servo of a channel, brought up to now."""
        ...

    def restart(self) -> None:
        """Restart as a dip of the supply makes it."""
        ...

    def channel_report(self, channel: int) -> dict[str, object]:
        """Return what a channel sends."""
        ...


class HobbyFaults(LineFaults):
    """The faults of a line, a board and its servos; an id is a channel. Args: as LineFaults."""

    noun = "channel"

    def __init__(self, board: HobbyBoard, commands: CommandTable, seed: int, header: bytes) -> None:
        super().__init__(board, commands, seed, header)
        self._hobby = board

    def brown_out(self) -> str:
        """Let the board restart as after a dip of the supply, which no answer shows."""
        self._hobby.restart()
        return "the board restarts"

    def power(self, on: bool = True) -> str:
        """Switch the servos' supply on or off; the board does not notice."""
        self._hobby.body.advance()
        self._hobby.body.servo_power = on
        return f"the servos have {'their' if on else 'no'} supply"

    def stick(self, channel: int | None) -> str:
        """Jam a servo where it is."""
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
        """Return a servo, or all (None), brought up to now."""
        if channel is not None:
            return [self._hobby.here(channel)]
        self._hobby.body.advance()
        return self._hobby.body.servos

    def reports(self) -> list[dict[str, object]]:
        """Return what every channel sends and where its servo truly is."""
        self._hobby.body.advance()
        return [
            {
                "id": nth,
                **self._hobby.channel_report(nth),
                "place": round(servo.place_steps, 1),
                "straining": servo.straining,
            }
            for nth, servo in enumerate(self._hobby.body.servos)
        ]


def channel_word(highest: int) -> Argument:
    """Return the word that names a channel."""
    return Argument("ID", whole(0, highest, "a channel"))


# fmt: off
def hobby_verbs(one: Argument, writes: str, own: Mapping[str, Verb]) -> dict[str, Verb]:
    """Return the fault commands of a board of hobby servos.

    Args:
        one: reads a channel.
        writes: what is sent to it without an answer, for "lose-writes".
        own: further commands of this make of board.
    """
    label = Argument(one.shown, or_all(one.read))
    return {
        **line_verbs(one),
        "lose-writes": lost("lose_writes", writes),
        "lose-bytes": lost("lose_bytes", "bytes of the host"),
        **adapter_verbs(),
        **own,
        "brown-out": Verb(HobbyFaults.brown_out, (),
                          "the board restarts as a dip of its supply makes it"),
        "power": Verb(HobbyFaults.power, (SWITCH,),
                      "supply of the servos; the board notices nothing"),
        "stick": Verb(HobbyFaults.stick, (label,), "jam the servo where it is"),
        "free": Verb(HobbyFaults.free, (label,), "let a jammed servo go"),
        "turn": Verb(HobbyFaults.turn, (label, Argument("STEPS", number(-1e5, 1e5, "quarter us"))),
                     "turn the servo by hand; with pulses it goes back"),
        **closing_verbs(one),
    }
# fmt: on

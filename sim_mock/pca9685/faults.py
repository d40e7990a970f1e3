"""What can go wrong with emulated PCA9685 boards and their servos, beside all on the line."""

from collections.abc import Callable
from typing import Protocol

from gazerig.sim_mock.faults.grammar import (
    SWITCH,
    TIME,
    Commands,
    Verb,
    Word,
    count,
    number,
    or_all,
    whole,
)
from gazerig.sim_mock.faults.hobby import HobbyFaults
from gazerig.sim_mock.faults.verbs import adapter_verbs, closing_verbs, line_verbs
from gazerig.sim_mock.hobby_servo import HobbyServo
from gazerig.sim_mock.pca9685.body import Body

CASES = {"oscillator-mhz": "MHZ"}


class Boards(Protocol):
    """What faults need of the boards they strike."""

    now_s: Callable[[], float]
    body: Body

    def here(self, place: int) -> HobbyServo:
        """Return the servo of a channel, brought up to now."""
        ...

    def restart(self) -> None:
        """Restart the boards as a dip of their supply makes it."""
        ...

    def choose(self, case: str, value: str) -> None:
        """Choose what the boards are like."""
        ...


class Pca9685Faults(HobbyFaults):
    """The faults of one I2C bus; an id is a channel."""

    def __init__(self, boards: Boards, commands: Commands, seed: int = 0) -> None:
        super().__init__(boards, commands, seed, header=b"S")
        self._boards = boards

    # --- on the bus

    def lose_bytes(self, number: int | None = None, seconds: float | None = None) -> str:
        """Let the next bytes of the host be lost on their way to the bridge."""
        return self._begin("lose_bytes", None, "bytes of the host are lost", number, seconds)

    def nack(self, count: int | None = None, seconds: float | None = None) -> str:
        """Let transfers not be acknowledged."""
        return self._begin("nack", None, "transfers are not acknowledged", count, seconds)

    def stuck(self, on: bool = True, seconds: float | None = None) -> str:
        """Let somebody hold the data line down: no transfer is possible."""
        return self._switch("stuck", on, "the bus is stuck", seconds)

    def absent(self, on: bool = True, seconds: float | None = None) -> str:
        """Take the boards off the bus; they keep their registers and their pulses."""
        return self._switch("absent", on, "the boards are off the bus", seconds)

    def foreign(self, on: bool = True, seconds: float | None = None) -> str:
        """Put chips of another kind in place of the boards."""
        return self._switch("foreign", on, "another chip answers", seconds)

    # --- what happens to the boards

    def brown_out(self) -> str:
        """Let the boards restart as a dip of the supply makes it: no answer tells."""
        self._boards.restart()
        return "the boards restart"

    # --- all

    def reports(self) -> list[dict[str, object]]:
        """Return what every channel sends and where its servo truly is."""
        body = self._boards.body
        body.advance()
        now_s = self._boards.now_s()
        return [
            {
                "id": place,
                "target": body.width_steps(place, now_s),
                "place": round(servo.place_steps, 1),
                "straining": servo.straining,
            }
            for place, servo in enumerate(body.servos)
        ]


_CHANNEL = Word("ID", whole(0, 255, "a channel"))
_WHO = Word("ID", or_all(_CHANNEL.read))
_N = Word("N", count, True)

# fmt: off
VERBS: dict[str, Verb] = {
    **line_verbs(_CHANNEL),
    "lose-writes": Verb(Pca9685Faults.lose_writes, (_N,),
                        "the next N transfers that only write are lost on their way", TIME),
    "lose-bytes": Verb(Pca9685Faults.lose_bytes, (_N,),
                       "the next N bytes of the host are lost on their way", TIME),
    **adapter_verbs(),
    "nack": Verb(Pca9685Faults.nack, (_N,), "the next N transfers are not acknowledged", TIME),
    "stuck": Verb(Pca9685Faults.stuck, (SWITCH,), "the data line is held down", TIME),
    "absent": Verb(Pca9685Faults.absent, (SWITCH,),
                   "the boards are off the bus, pulses go on", TIME),
    "foreign": Verb(Pca9685Faults.foreign, (SWITCH,), "chips of another kind answer", TIME),
    "brown-out": Verb(Pca9685Faults.brown_out, (),
                      "the boards restart as a dip of their supply makes it"),
    "power": Verb(Pca9685Faults.power, (SWITCH,),
                  "supply of the servos; the boards notice nothing"),
    "stick": Verb(Pca9685Faults.stick, (_WHO,), "jam the servo where it is"),
    "free": Verb(Pca9685Faults.free, (_WHO,), "let a jammed servo go"),
    "turn": Verb(Pca9685Faults.turn, (_WHO, Word("STEPS", number(-1e5, 1e5, "quarter us"))),
                 "turn the servo by hand; with pulses it goes back"),
    **closing_verbs(_CHANNEL),
}
# fmt: on

COMMANDS = Commands(VERBS, CASES, "a channel")

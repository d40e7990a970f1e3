"""Faults of the hobby servos on any kind of emulated board."""

from collections.abc import Mapping, Sequence

from gazerig.sim_mock.faults.grammar import CommandTable, Verb
from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.faults.verbs import (
    ADAPTER_VERBS,
    CLOSING_VERBS,
    LINE_VERBS,
    loss_verb,
    servo_verb,
)
from gazerig.sim_mock.hobby_servo import HobbyServo


class HobbyFaults(LineFaults):
    """Faults of a line, a board and its servos; an id is a channel."""

    def brown_out(self) -> str:
        """Restart the board as after a dip of the supply, which no answer shows."""
        self.chain.restart()
        return "the board restarts"

    def servos(self, channel: int | None) -> Sequence[HobbyServo]:
        """Return a servo, or all (None), advanced to the present time."""
        self.chain.advance()
        servos: Sequence[HobbyServo] = self.chain.servos
        return servos if channel is None else [self.chain.find_servo(channel)]

    def reports(self) -> list[dict[str, object]]:
        """Return every channel's commanded pulse and its servo's true position."""
        places = self.chain.positions_steps()
        return [
            {"id": nth, "target": self.chain.target_steps(nth), "place": round(place, 1)}
            for nth, place in enumerate(places)
        ]


def hobby_commands(
    highest: int, writes: str, own: Mapping[str, Verb] | None = None
) -> CommandTable:
    """Return the fault commands of a board of hobby servos.

    Args:
        highest: its highest channel.
        writes: name of its commands without an answer.
        own: verbs of its kind alone; None: it has none.
    """
    verbs = {
        **LINE_VERBS,
        "lose-writes": loss_verb("lose_writes", writes),
        **ADAPTER_VERBS,
        **(own or {}),
        "brown-out": Verb(HobbyFaults.brown_out),
        "stick": servo_verb(HobbyServo.jam, "is stuck"),
        "free": servo_verb(lambda servo: servo.jam(False), "is free"),
        "turn": servo_verb(
            lambda servo, steps: servo.turn(steps), "was turned by {:g} quarter us", "ID STEPS"
        ),
        **CLOSING_VERBS,
    }
    return CommandTable(verbs, highest)

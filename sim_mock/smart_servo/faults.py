"""Faults of emulated smart servos and their joints, in addition to those of their line."""

from collections.abc import Callable

from gazerig.sim_mock.faults.grammar import CommandTable, Verb
from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.faults.verbs import ADAPTER_VERBS, CLOSING_VERBS, LINE_VERBS
from gazerig.sim_mock.smart_servo.servo import EmulatedServo


class ServoFaults(LineFaults):
    """Faults of one chain."""

    def servos(self, servo_id: int | None) -> list[EmulatedServo]:
        """Return a servo, or all (None), advanced to the present time."""
        ids = self.chain.ids() if servo_id is None else (servo_id,)
        return [self.chain.find_servo(one) for one in ids]

    def reports(self) -> list[dict[str, object]]:
        """Return the state of every servo."""
        return [servo.report() for servo in self.servos(None)]


def _collide(faults: ServoFaults, servo_id: int) -> str:
    faults.chain.add_duplicate(servo_id)
    return f"two servos have id {servo_id} now"


def _verb(do: Callable[..., None], reply: str, words: str, description: str) -> Verb:
    """Return a command that acts on one servo or all; ``reply``: what follows its name."""

    def run(faults: ServoFaults, servo_id: int | None, *numbers: float) -> str:
        for servo in faults.servos(servo_id):
            do(servo, *numbers)
        return f"{faults.label(servo_id)} {reply.format(*numbers)}"

    return Verb(run, words, description)


# fmt: off
def commands_of(highest_id: int, reset: str) -> CommandTable:
    """Return the fault commands of one make of servos; ``reset``: its factory settings."""
    servo = EmulatedServo
    return CommandTable({
        **LINE_VERBS,
        **ADAPTER_VERBS,
        "collide": Verb(_collide, "ID", "a second servo with this id joins the bus"),
        "overload": _verb(servo.overload, "is overloaded", "ID", "trigger the overload protection"),
        "brown-out": _verb(servo.restart, "restarts", "ID", "restart as after a dip of the supply: no status shows it"),
        "reset": _verb(servo.reset_all, f"has factory settings: {reset}", "ID", f"restore factory settings: {reset}"),
        "voltage": _verb(servo.set_voltage, "has {:g} V", "ID V", "change the supply voltage"),
        "temperature": _verb(servo.set_temperature, "has {:g} degC", "ID C", "set the motor's temperature"),
        "stick": _verb(servo.jam, "is stuck", "ID", "jam the joint at its position"),
        "free": _verb(lambda servo: servo.jam(False), "is free", "ID", "free a jammed joint"),
        "turn": _verb(servo.turn, "was turned by {:g} steps", "ID STEPS", "turn the joint by hand"),
        **CLOSING_VERBS,
    }, "a servo's id", highest_id)
# fmt: on

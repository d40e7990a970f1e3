"""Faults of emulated smart servos and their joints, in addition to those of their line."""

from collections.abc import Callable
from typing import Protocol

from gazerig.sim_mock.faults.grammar import (
    Argument,
    CommandTable,
    Verb,
    id_or_all,
    integer_parser,
    number_parser,
)
from gazerig.sim_mock.faults.line import FaultTarget, LineFaults
from gazerig.sim_mock.faults.verbs import Do, adapter_verbs, closing_verbs, line_verbs
from gazerig.sim_mock.smart_servo.servo import EmulatedServo


class Chain(FaultTarget, Protocol):
    """Interface of a chain to its faults."""

    def find_servo(self, servo_id: int) -> EmulatedServo:
        """Return a servo by id, advanced to the present time."""
        ...

    def ids(self) -> tuple[int, ...]:
        """Return the ids."""
        ...

    def add_duplicate(self, servo_id: int) -> None:
        """Add a second servo with this id to the chain."""
        ...


class ServoFaults(LineFaults):
    """Faults of one chain."""

    def __init__(self, chain: Chain, commands: CommandTable, seed: int) -> None:
        super().__init__(chain, commands, seed)
        self.chain = chain

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


def _servo_command(do: Callable[..., None], text: str) -> Do:
    """Return a command that acts on one servo or all; ``text``: its reply."""

    def run(faults: ServoFaults, servo_id: int | None, *numbers: float) -> str:
        for servo in faults.servos(servo_id):
            do(servo, *numbers)
        return text.format(*numbers, label=faults.label(servo_id))

    return run


def _error_command(error: str) -> Do:
    """Return a command that triggers an error of servos."""
    return _servo_command(lambda servo: servo.fail(error), f"{{label}} protects itself: {error}")


def _quantity_command(attribute: str, unit: str) -> Do:
    """Return a command that sets a quantity of one servo, or of all."""
    return _servo_command(
        lambda servo, value: setattr(servo, attribute, value), f"{{label}} has {{:g}} {unit}"
    )


# fmt: off
def commands_of(highest_id: int, reset: str) -> CommandTable:
    """Return the fault commands of one make of servos; ``reset``: its factory settings."""
    one = Argument("ID", integer_parser(0, highest_id, "a servo id"))
    some = Argument("ID", id_or_all(one.read))
    volts = Argument("V", number_parser(0.0, 30.0, "volts"))
    celsius = Argument("C", number_parser(-40.0, 200.0, "degC"))
    steps = Argument("STEPS", number_parser(-1e6, 1e6, "steps"))
    newton_metres = Argument("NM", number_parser(-100.0, 100.0, "Nm"))
    return CommandTable({
        **line_verbs(one),
        **adapter_verbs(),
        "collide": Verb(_collide, (one,), "a second servo with this id joins the bus"),
        "overload": Verb(_error_command("overload"), (some,), "trigger the overload protection"),
        "overheat": Verb(_error_command("overheating"), (some,), "the motor is too hot"),
        "brown-out": Verb(_servo_command(EmulatedServo.restart, "{label} restarts"), (some,),
                          "restart as after a dip of the supply: no status shows it"),
        "reset": Verb(_servo_command(EmulatedServo.reset_all, f"{{label}} has factory settings: {reset}"),
                      (some,), f"restore factory settings: {reset}"),
        "voltage": Verb(_quantity_command("supply_v", "V"), (some, volts), "change the supply voltage"),
        "temperature": Verb(_quantity_command("temperature_c", "degC"), (some, celsius),
                            "set the motor's temperature"),
        "stick": Verb(_servo_command(lambda servo: servo.jam(True), "{label} is stuck"), (some,),
                      "jam the joint at its position"),
        "free": Verb(_servo_command(lambda servo: servo.jam(False), "{label} is free"), (some,),
                     "free a jammed joint"),
        "load": Verb(_servo_command(EmulatedServo.set_load, "{label} carries {:g} Nm"),
                     (some, newton_metres), "apply a constant torque to the joint"),
        "turn": Verb(_servo_command(EmulatedServo.turn, "{label} was turned by {:g} steps"),
                     (some, steps), "turn the joint by hand"),
        **closing_verbs(one),
    }, "a servo's id")
# fmt: on

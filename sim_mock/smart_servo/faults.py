"""Faults of emulated smart servos and their joints, in addition to those of their line."""

from collections.abc import Callable

from gazerig.sim_mock.faults.grammar import (
    Argument,
    CommandTable,
    Verb,
    id_or_all,
    integer_parser,
    number_parser,
)
from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.faults.verbs import Do, adapter_verbs, closing_verbs, line_verbs
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


def _servo_command(do: Callable[..., None], text: str) -> Do:
    """Return a command that acts on one servo or all; ``text``: its reply."""

    def run(faults: ServoFaults, servo_id: int | None, *numbers: float) -> str:
        for servo in faults.servos(servo_id):
            do(servo, *numbers)
        return text.format(*numbers, label=faults.label(servo_id))

    return run


# fmt: off
def commands_of(highest_id: int, reset: str) -> CommandTable:
    """Return the fault commands of one make of servos; ``reset``: its factory settings."""
    one = Argument("ID", integer_parser(0, highest_id, "a servo id"))
    some = Argument("ID", id_or_all(one.read))
    volts = Argument("V", number_parser(0.0, 30.0, "volts"))
    celsius = Argument("C", number_parser(-40.0, 200.0, "degC"))
    steps = Argument("STEPS", number_parser(-1e6, 1e6, "steps"))
    return CommandTable({
        **line_verbs(one),
        **adapter_verbs(),
        "collide": Verb(_collide, (one,), "a second servo with this id joins the bus"),
        "overload": Verb(_servo_command(lambda servo: servo.fail("overload"), "{label} is overloaded"),
                         (some,), "trigger the overload protection"),
        "overheat": Verb(_servo_command(lambda servo: servo.fail("overheating"), "{label} is too hot"), (some,), "the motor is too hot"),
        "brown-out": Verb(_servo_command(EmulatedServo.restart, "{label} restarts"), (some,),
                          "restart as after a dip of the supply: no status shows it"),
        "reset": Verb(_servo_command(EmulatedServo.reset_all, f"{{label}} has factory settings: {reset}"),
                      (some,), f"restore factory settings: {reset}"),
        "voltage": Verb(_servo_command(EmulatedServo.set_voltage, "{label} has {:g} V"), (some, volts), "change the supply voltage"),
        "temperature": Verb(_servo_command(EmulatedServo.set_temperature, "{label} has {:g} degC"), (some, celsius),
                            "set the motor's temperature"),
        "stick": Verb(_servo_command(lambda servo: servo.jam(True), "{label} is stuck"), (some,),
                      "jam the joint at its position"),
        "free": Verb(_servo_command(lambda servo: servo.jam(False), "{label} is free"), (some,),
                     "free a jammed joint"),
        "turn": Verb(_servo_command(EmulatedServo.turn, "{label} was turned by {:g} steps"),
                     (some, steps), "turn the joint by hand"),
        **closing_verbs(one),
    }, "a servo's id")
# fmt: on

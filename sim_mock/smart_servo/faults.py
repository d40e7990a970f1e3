"""Faults of emulated smart servos and their joints, in addition to those of their line."""

from collections.abc import Callable, Sequence
from typing import Protocol

from gazerig.sim_mock.faults.grammar import (
    Argument,
    CommandTable,
    Verb,
    id_or_all,
    integer_parser,
    number_parser,
)
from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.faults.verbs import (
    Do,
    adapter_verbs,
    closing_verbs,
    line_verbs,
    packet_verbs,
)
from gazerig.sim_mock.smart_servo.quirks import ChainQuirks, cases_of
from gazerig.sim_mock.smart_servo.servo import EmulatedServo


class Chain(Protocol):
    """Interface of a chain to its faults."""

    now_s: Callable[[], float]

    def find_servo(self, servo_id: int) -> EmulatedServo:
        """Return a servo by id, advanced to the present time."""
        ...

    def ids(self) -> tuple[int, ...]:
        """Return the ids."""
        ...

    def add_duplicate(self, servo_id: int) -> None:
        """Add a second servo with this id to the chain."""
        ...

    def choose_behaviour(self, case: str, value: str) -> None:
        """Choose the servos' behaviour where documents and devices differ."""
        ...


class ServoFaults(LineFaults):
    """Faults of one chain."""

    def __init__(self, chain: Chain, commands: CommandTable, seed: int, header: bytes) -> None:
        super().__init__(chain, commands, seed, header)
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


def _reset(faults: ServoFaults, servo_id: int) -> str:
    servo = faults.chain.find_servo(servo_id)
    error = servo.reset_all()
    if error:
        raise ValueError(f"servo {servo_id} refuses with error {error}: its torque is on")
    return f"servo {servo_id} has factory settings: id {servo.id}, {servo.baud} bit/s"


def _error_command(error: str) -> Do:
    """Return a command that triggers an error of one servo."""
    return lambda faults, servo_id: (
        f"servo {servo_id} {faults.chain.find_servo(servo_id).fail(error)}"
    )


def _servo_command(do: Callable[..., None], text: str) -> Do:
    """Return a command that acts on one servo or all; ``text``: its reply."""

    def run(faults: ServoFaults, servo_id: int | None, *numbers: float) -> str:
        for servo in faults.servos(servo_id):
            do(servo, *numbers)
        return text.format(*numbers, label=faults.label(servo_id))

    return run


def _quantity_command(attribute: str, unit: str) -> Do:
    """Return a command that sets a quantity of one servo, or of all."""
    return _servo_command(
        lambda s, value: setattr(s, attribute, value), f"{{label}} has {{:g}} {unit}"
    )


# fmt: off
def commands_of(
    highest_id: int, quirks: type[ChainQuirks], without: Sequence[str] = (), reset: str = ""
) -> CommandTable:
    """Return the fault commands of one make of servos."""
    one = Argument("ID", integer_parser(0, highest_id, "a servo id"))
    some = Argument("ID", id_or_all(one.read))
    verbs = {
        **line_verbs(one),
        **packet_verbs(one),
        **adapter_verbs(),
        "collide": Verb(_collide, (one,), "a second servo with this id joins the bus"),
        "overload": Verb(_error_command("overload"), (one,), "trigger the overload protection"),
        "overheat": Verb(_error_command("overheating"), (one,), "the motor is too hot"),
        "encoder": Verb(_error_command("encoder"), (one,), "the angle sensor is broken"),
        "shock": Verb(_error_command("electrical shock"), (one,), "latch the electrical shock error"),
        "brown-out": Verb(_servo_command(EmulatedServo.restart, "{label} restarts"), (one,),
                          "restart as after a dip of the supply: no status shows it"),
        "reset": Verb(_reset, (one,), f"restore factory settings: {reset}"),
        "voltage": Verb(_quantity_command("supply_v", "V"), (some, Argument("V", number_parser(0.0, 30.0, "volts"))),
                        "change the supply voltage"),
        "temperature": Verb(_quantity_command("temperature_c", "degC"),
                            (some, Argument("C", number_parser(-40.0, 200.0, "degC"))),
                            "set the motor's temperature, which then drifts"),
        "stick": Verb(_servo_command(lambda servo: servo.jam(True), "{label} is stuck"), (some,),
                      "jam the joint at its position"),
        "free": Verb(_servo_command(lambda servo: servo.jam(False), "{label} is free"), (some,),
                     "free a jammed joint"),
        "load": Verb(_servo_command(EmulatedServo.set_load, "{label} carries {:g} Nm"),
                     (some, Argument("NM", number_parser(-100.0, 100.0, "Nm"))),
                     "apply a constant torque to the joint"),
        "turn": Verb(_servo_command(EmulatedServo.turn, "{label} was turned by {:g} steps"),
                     (some, Argument("STEPS", number_parser(-1e6, 1e6, "steps"))), "turn the joint by hand"),
        **closing_verbs(one),
    }
    verbs = {name: verb for name, verb in verbs.items() if name not in without}
    return CommandTable(verbs, cases_of(quirks), "a servo's id")
# fmt: on

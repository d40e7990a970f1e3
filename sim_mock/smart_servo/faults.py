"""Faults of emulated smart servos and their joints, in addition to those of their line."""

from gazerig.sim_mock.faults.grammar import CommandTable, Verb
from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.faults.verbs import ADAPTER_VERBS, CLOSING_VERBS, LINE_VERBS, servo_verb
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


def commands_of(highest_id: int) -> CommandTable:
    """Return the fault commands of one make of servos."""
    servo = EmulatedServo
    return CommandTable(
        {
            **LINE_VERBS,
            **ADAPTER_VERBS,
            "collide": Verb(_collide, "ID"),
            "overload": servo_verb(servo.overload, "is overloaded"),
            "brown-out": servo_verb(servo.restart, "restarts"),
            "reset": servo_verb(servo.reset_all, "has factory settings"),
            "voltage": servo_verb(
                lambda one, volts: one.sense("input_voltage", 10.0 * volts), "has {:g} V", "ID V"
            ),
            "temperature": servo_verb(
                lambda one, celsius: one.sense("temperature", celsius), "has {:g} degC", "ID C"
            ),
            "stick": servo_verb(servo.jam, "is stuck"),
            "free": servo_verb(lambda servo: servo.jam(False), "is free"),
            "turn": servo_verb(servo.turn, "was turned by {:g} steps", "ID STEPS"),
            **CLOSING_VERBS,
        },
        highest_id,
    )

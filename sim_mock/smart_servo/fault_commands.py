"""What can be asked of an emulated Dynamixel bus as text; ``Faults`` does it."""

from sim_mock.dynamixel.quirks import cases
from sim_mock.faults.grammar import Commands, Verb, Word, number, or_all, whole
from sim_mock.faults.verbs import adapter_verbs, closing_verbs, line_verbs, packet_verbs
from sim_mock.smart_servo.faults import Faults

_ID = Word("ID", whole(0, 252, "a servo id"))
_WHO = Word("ID", or_all(_ID.read))

# fmt: off
VERBS: dict[str, Verb] = {
    **line_verbs(_ID),
    **packet_verbs(_ID),
    **adapter_verbs(),
    "collide": Verb(Faults.collide, (_ID,), "a second servo with this id joins the bus"),
    "overload": Verb(Faults.overload, (_ID,), "latch the overload error"),
    "overheat": Verb(Faults.overheat, (_ID,), "latch the overheating error"),
    "encoder": Verb(Faults.encoder, (_ID,), "latch the encoder error"),
    "shock": Verb(Faults.shock, (_ID,), "latch the electrical shock error"),
    "brown-out": Verb(Faults.brown_out, (_ID,), "restart as a dip of the supply makes it"),
    "reset": Verb(Faults.reset, (_ID,), "as from the factory: id 1, 57600 baud; needs torque off"),
    "voltage": Verb(Faults.voltage, (_WHO, Word("V", number(0.0, 30.0, "volts"))),
                    "supply with another voltage"),
    "temperature": Verb(Faults.temperature, (_WHO, Word("C", number(-40.0, 200.0, "degC"))),
                        "give the motor a temperature; it drifts on by itself"),
    "stick": Verb(Faults.stick, (_WHO,), "jam the joint where it is"),
    "free": Verb(Faults.free, (_WHO,), "let a jammed joint go"),
    "load": Verb(Faults.load, (_WHO, Word("NM", number(-100.0, 100.0, "Nm"))),
                 "hang a constant torque on the joint"),
    "turn": Verb(Faults.turn, (_WHO, Word("STEPS", number(-1e6, 1e6, "steps"))),
                 "turn the joint by hand"),
    **closing_verbs(_ID),
}
# fmt: on

COMMANDS = Commands(VERBS, cases(), "a servo's id")


def usage(name: str) -> str:
    """Show how a command is typed."""
    return COMMANDS.usage(name)

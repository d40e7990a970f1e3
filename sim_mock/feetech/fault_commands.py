"""What can be asked of an emulated STS bus as text; ``StsFaults`` does it."""

from drivers.feetech.memory_table import HIGHEST_ID
from sim_mock.faults.grammar import Commands, Verb, Word, number, or_all, whole
from sim_mock.faults.verbs import adapter_verbs, closing_verbs, line_verbs, packet_verbs
from sim_mock.feetech.faults import StsFaults
from sim_mock.feetech.quirks import cases

_ID = Word("ID", whole(0, HIGHEST_ID, "a servo id"))
_WHO = Word("ID", or_all(_ID.read))

# fmt: off
VERBS: dict[str, Verb] = {
    **line_verbs(_ID),
    **packet_verbs(_ID),
    **adapter_verbs(),
    "collide": Verb(StsFaults.collide, (_ID,), "a second servo with this id joins the bus"),
    "overload": Verb(StsFaults.overload, (_ID,), "let the overload protection act"),
    "overheat": Verb(StsFaults.overheat, (_ID,), "the motor is too hot; it cools by itself"),
    "encoder": Verb(StsFaults.encoder, (_ID,), "the angle sensor is broken until a restart"),
    "brown-out": Verb(StsFaults.brown_out, (_ID,), "restart as a dip of the supply makes it"),
    "reset": Verb(StsFaults.reset, (_ID,), "as from the factory: id 1, 1000000 bit/s"),
    "voltage": Verb(StsFaults.voltage, (_WHO, Word("V", number(0.0, 30.0, "volts"))),
                    "supply with another voltage"),
    "temperature": Verb(StsFaults.temperature, (_WHO, Word("C", number(-40.0, 200.0, "degC"))),
                        "give the motor a temperature; it drifts on by itself"),
    "stick": Verb(StsFaults.stick, (_WHO,), "jam the joint where it is"),
    "free": Verb(StsFaults.free, (_WHO,), "let a jammed joint go"),
    "load": Verb(StsFaults.load, (_WHO, Word("NM", number(-100.0, 100.0, "Nm"))),
                 "hang a constant torque on the joint"),
    "turn": Verb(StsFaults.turn, (_WHO, Word("STEPS", number(-1e6, 1e6, "steps"))),
                 "turn the joint by hand"),
    **closing_verbs(_ID),
}
# fmt: on

COMMANDS = Commands(VERBS, cases(), "a servo's id")

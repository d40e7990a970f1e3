"""What can go wrong with emulated smart servos and their joints, beside all on their line."""

from collections.abc import Callable, Sequence
from typing import Protocol

from gazerig.sim_mock.faults.grammar import Commands, Verb, Word, number, or_all, whole
from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.faults.verbs import adapter_verbs, closing_verbs, line_verbs, packet_verbs
from gazerig.sim_mock.smart_servo.quirks import ChainQuirks, cases_of
from gazerig.sim_mock.smart_servo.servo import SmartServo


class Chain(Protocol):
    """What faults need of the chain they strike."""

    now_s: Callable[[], float]

    def here(self, servo_id: int) -> SmartServo:
        """Return a servo by id, brought up to now."""
        ...

    def ids(self) -> tuple[int, ...]:
        """Return the ids."""
        ...

    def join(self, servo_id: int) -> None:
        """Put a second servo with this id on the chain."""
        ...

    def choose(self, case: str, value: str) -> None:
        """Choose what servos do where documents and devices differ."""
        ...


class ServoFaults(LineFaults):
    """The faults of one chain."""

    def __init__(self, chain: Chain, commands: Commands, seed: int, header: bytes) -> None:
        super().__init__(chain, commands, seed, header)
        self._bus = chain

    def reports(self) -> list[dict[str, object]]:
        """Return what every servo tells of itself."""
        return [self._bus.here(servo_id).report() for servo_id in self._bus.ids()]

    # --- one servo

    def collide(self, servo_id: int) -> str:
        """Put a second servo with the same id on the bus: both answer at once."""
        self._bus.join(servo_id)
        return f"two servos have id {servo_id} now"

    def overload(self, servo_id: int) -> str:
        """Let a servo's overload protection act."""
        return self._fail(servo_id, "overload")

    def overheat(self, servo_id: int) -> str:
        """Let a servo be too hot."""
        return self._fail(servo_id, "overheating")

    def encoder(self, servo_id: int) -> str:
        """Let a servo find its angle sensor broken."""
        return self._fail(servo_id, "encoder")

    def shock(self, servo_id: int) -> str:
        """Let a servo find an electrical shock."""
        return self._fail(servo_id, "electrical shock")

    def _fail(self, servo_id: int, error: str) -> str:
        return f"servo {servo_id} {self._bus.here(servo_id).fail(error)}"

    def brown_out(self, servo_id: int) -> str:
        """Let a servo restart as a dip of the supply makes it: no status tells."""
        self._bus.here(servo_id).restart()
        return f"servo {servo_id} restarts"

    def reset(self, servo_id: int) -> str:
        """Let a servo be as from the factory: id 1, and its make's baud rate."""
        servo = self._bus.here(servo_id)
        error = servo.reset_all()
        if error:
            raise ValueError(f"servo {servo_id} refuses with error {error}: its torque is on")
        return f"servo {servo_id} is as from the factory: id {servo.id}, {servo.baud} bit/s"

    # --- one servo, or all

    def voltage(self, servo_id: int | None, volts: float) -> str:
        """Supply a servo, or all, with another voltage."""
        for servo in self._servos(servo_id):
            servo.supply_v = volts
        return f"{self.who(servo_id)} has {volts:g} V"

    def temperature(self, servo_id: int | None, celsius: float) -> str:
        """Return a servo's motor a temperature, from which it drifts on by itself."""
        for servo in self._servos(servo_id):
            servo.temperature_c = celsius
        return f"{self.who(servo_id)} has {celsius:g} degC"

    def stick(self, servo_id: int | None) -> str:
        """Jam a joint where it is."""
        for servo in self._servos(servo_id):
            servo.hold_fast(True)
        return f"{self.who(servo_id)} is stuck"

    def free(self, servo_id: int | None) -> str:
        """Let a jammed joint go."""
        for servo in self._servos(servo_id):
            servo.hold_fast(False)
        return f"{self.who(servo_id)} is free"

    def load(self, servo_id: int | None, nm: float) -> str:
        """Hang a constant torque on a joint."""
        for servo in self._servos(servo_id):
            servo.pull(nm)
        return f"{self.who(servo_id)} carries {nm:g} Nm"

    def turn(self, servo_id: int | None, steps: float) -> str:
        """Turn a joint by hand."""
        for servo in self._servos(servo_id):
            servo.turn(steps)
        return f"{self.who(servo_id)} was turned by {steps:g} steps"

    def _servos(self, servo_id: int | None) -> list[SmartServo]:
        """Return a servo, or all (None), brought up to now."""
        ids = self._bus.ids() if servo_id is None else (servo_id,)
        return [self._bus.here(one) for one in ids]


# fmt: off
def commands_of(
    highest_id: int, quirks: type[ChainQuirks], without: Sequence[str] = (), reset: str = ""
) -> Commands:
    """Return what can be asked of one make of servos as text.

    reset: what the command of that name makes of a servo; without: what cannot happen to it
    """
    one = Word("ID", whole(0, highest_id, "a servo id"))
    some = Word("ID", or_all(one.read))
    verbs = {
        **line_verbs(one),
        **packet_verbs(one),
        **adapter_verbs(),
        "collide": Verb(ServoFaults.collide, (one,), "a second servo with this id joins the bus"),
        "overload": Verb(ServoFaults.overload, (one,), "let the overload protection act"),
        "overheat": Verb(ServoFaults.overheat, (one,), "the motor is too hot"),
        "encoder": Verb(ServoFaults.encoder, (one,), "the angle sensor is broken"),
        "shock": Verb(ServoFaults.shock, (one,), "latch the electrical shock error"),
        "brown-out": Verb(ServoFaults.brown_out, (one,), "restart as a dip of the supply makes it"),
        "reset": Verb(ServoFaults.reset, (one,), f"as from the factory: {reset}"),
        "voltage": Verb(ServoFaults.voltage, (some, Word("V", number(0.0, 30.0, "volts"))),
                        "supply with another voltage"),
        "temperature": Verb(ServoFaults.temperature,
                            (some, Word("C", number(-40.0, 200.0, "degC"))),
                            "give the motor a temperature; it drifts on by itself"),
        "stick": Verb(ServoFaults.stick, (some,), "jam the joint where it is"),
        "free": Verb(ServoFaults.free, (some,), "let a jammed joint go"),
        "load": Verb(ServoFaults.load, (some, Word("NM", number(-100.0, 100.0, "Nm"))),
                     "hang a constant torque on the joint"),
        "turn": Verb(ServoFaults.turn, (some, Word("STEPS", number(-1e6, 1e6, "steps"))),
                     "turn the joint by hand"),
        **closing_verbs(one),
    }
    verbs = {name: verb for name, verb in verbs.items() if name not in without}
    return Commands(verbs, cases_of(quirks), "a servo's id")
# fmt: on

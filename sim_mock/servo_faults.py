"""What can go wrong with emulated Dynamixel servos, beside all that can on their line."""

from collections.abc import Callable
from typing import Protocol

from sim_mock.fault_words import Commands
from sim_mock.line_faults import LineFaults
from sim_mock.servo import Servo

_REPORTED = {
    "position": ("present_position", 132, 4),
    "goal": ("goal_position", 116, 4),
    "torque": ("torque_enable", 64, 1),
    "error": ("hardware_error_status", 70, 1),
    "temperature_c": ("present_temperature", 146, 1),
    "voltage_01v": ("present_input_voltage", 144, 2),
}


class Chain(Protocol):
    """What faults need of the chain they strike."""

    now_s: Callable[[], float]

    def here(self, servo_id: int) -> Servo:
        """Give a servo by id, brought up to now."""
        ...

    def ids(self) -> tuple[int, ...]:
        """List the ids."""
        ...

    def join(self, servo_id: int) -> None:
        """Put a second servo with this id on the chain."""
        ...

    def refresh(self) -> None:
        """Look again at ids and bauds that were changed behind the chain's back."""
        ...

    def choose(self, case: str, value: str) -> None:
        """Choose what servos do where documents and devices differ."""
        ...


class Faults(LineFaults):
    """The faults of one chain."""

    def __init__(self, chain: Chain, commands: Commands, seed: int = 0) -> None:
        super().__init__(chain, commands, seed)
        self._bus = chain

    # --- what happens to a servo

    def collide(self, servo_id: int) -> str:
        """Put a second servo with the same id on the bus: both answer at once."""
        self._bus.join(servo_id)
        return f"two servos have id {servo_id} now"

    def overload(self, servo_id: int) -> str:
        """Let a servo's overload protection trip."""
        return self._fail(servo_id, "overload")

    def overheat(self, servo_id: int) -> str:
        """Let a servo's overheating protection trip."""
        return self._fail(servo_id, "overheating")

    def encoder(self, servo_id: int) -> str:
        """Let a servo find its encoder broken."""
        return self._fail(servo_id, "encoder")

    def shock(self, servo_id: int) -> str:
        """Let a servo find an electrical shock."""
        return self._fail(servo_id, "electrical shock")

    def brown_out(self, servo_id: int) -> str:
        """Let a servo restart as a dip of the supply makes it: no status tells."""
        self._bus.here(servo_id).brown_out()
        return f"servo {servo_id} restarts"

    def reset(self, servo_id: int) -> str:
        """Let a servo be as from the factory: id 1, 57600 baud."""
        error = self._bus.here(servo_id).factory_reset(0xFF)
        if error:
            raise ValueError(f"servo {servo_id} refuses with error {error}: its torque is on")
        self._bus.refresh()
        return f"servo {servo_id} is as from the factory: id 1, 57600 bit/s"

    def voltage(self, servo_id: int | None, volts: float) -> str:
        """Supply a servo, or all, with another voltage."""
        for servo in self._servos(servo_id):
            servo.supply_v = volts
        return f"{self.who(servo_id)} has {volts:g} V"

    def temperature(self, servo_id: int | None, celsius: float) -> str:
        """Give a servo's motor a temperature, from which it drifts on by itself."""
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

    def _servos(self, servo_id: int | None) -> list[Servo]:
        """Give a servo, or all (None), brought up to now."""
        ids = self._bus.ids() if servo_id is None else (servo_id,)
        return [self._bus.here(one) for one in ids]

    def _fail(self, servo_id: int, error: str) -> str:
        self._bus.here(servo_id).fail(error)
        return f"servo {servo_id} has latched: {error}"

    def reports(self) -> list[dict[str, object]]:
        """Give what the registers of every servo tell."""
        return [self._report(servo_id) for servo_id in self._bus.ids()]

    def _report(self, servo_id: int) -> dict[str, object]:
        servo = self._bus.here(servo_id)
        report: dict[str, object] = {"id": servo_id, "model": servo.model.name}
        for key, (_, address, size) in _REPORTED.items():
            raw = servo.read(address, size) or b""
            report[key] = int.from_bytes(raw, "little", signed=size == 4)
        return report

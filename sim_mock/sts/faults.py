"""What can go wrong with emulated STS servos, beside all that can on their line."""

from collections.abc import Callable
from typing import Protocol

from sim_mock.fault_words import Commands
from sim_mock.line_faults import LineFaults
from sim_mock.sts.packets import HEADER
from sim_mock.sts.servo import StsServo

TOO_HOT_C = 5.0
"""An overheated motor is so much above its limit."""


class Chain(Protocol):
    """What faults need of the chain they strike."""

    now_s: Callable[[], float]

    def here(self, servo_id: int) -> StsServo:
        """Give a servo by id, brought up to now."""
        ...

    def ids(self) -> tuple[int, ...]:
        """List the ids."""
        ...

    def join(self, servo_id: int) -> None:
        """Put a second servo with this id on the chain."""
        ...

    def choose(self, case: str, value: str) -> None:
        """Choose what servos do where documents and devices differ."""
        ...


class StsFaults(LineFaults):
    """The faults of one chain."""

    def __init__(self, chain: Chain, commands: Commands, seed: int = 0) -> None:
        super().__init__(chain, commands, seed, HEADER)
        self._bus = chain

    def collide(self, servo_id: int) -> str:
        """Put a second servo with the same id on the bus: both answer at once."""
        self._bus.join(servo_id)
        return f"two servos have id {servo_id} now"

    def overload(self, servo_id: int) -> str:
        """Let a servo's overload protection act."""
        self._bus.here(servo_id).trip()
        return f"servo {servo_id} protects itself: overload"

    def overheat(self, servo_id: int) -> str:
        """Let a servo's motor be too hot; it cools by itself."""
        servo = self._bus.here(servo_id)
        return self.temperature(servo_id, servo.memory.get("temperature_limit") + TOO_HOT_C)

    def encoder(self, servo_id: int) -> str:
        """Let a servo find its angle sensor broken."""
        self._bus.here(servo_id).lose_angle()
        return f"servo {servo_id} finds its angle sensor broken"

    def brown_out(self, servo_id: int) -> str:
        """Let a servo restart as a dip of the supply makes it: no status tells."""
        self._bus.here(servo_id).restart()
        return f"servo {servo_id} restarts"

    def reset(self, servo_id: int) -> str:
        """Let a servo be as from the factory: id 1, 1000000 bit/s."""
        self._bus.here(servo_id).factory_reset(1)
        return f"servo {servo_id} is as from the factory: id 1, 1000000 bit/s"

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

    def _servos(self, servo_id: int | None) -> list[StsServo]:
        """Give a servo, or all (None), brought up to now."""
        ids = self._bus.ids() if servo_id is None else (servo_id,)
        return [self._bus.here(one) for one in ids]

    def reports(self) -> list[dict[str, object]]:
        """Give the state of every servo, for ``status``."""
        return [_report(self._bus.here(servo_id)) for servo_id in self._bus.ids()]


def _report(servo: StsServo) -> dict[str, object]:
    return {
        "id": servo.id,
        "model": servo.model.name,
        "position": round(servo.position_steps),
        "goal": servo.memory.get("goal_position"),
        "torque": int(servo.torque),
        "error": servo.error,
        "temperature_c": round(servo.temperature_c),
        "voltage_01v": servo.read(62, 1)[0],
    }

"""What can happen to any emulated smart servo and its joint, beside all that can on their line."""

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from sim_mock.faults.grammar import Commands
from sim_mock.faults.line import LineFaults
from sim_mock.replies import HEADER


class Struck(Protocol):
    """A servo that can be supplied, heated, jammed, loaded and turned."""

    supply_v: float
    temperature_c: float

    def hold_fast(self, on: bool) -> None:
        """Jam the joint where it is, or let it go."""
        ...

    def pull(self, nm: float) -> None:
        """Hang a constant torque on the joint."""
        ...

    def turn(self, steps: float) -> None:
        """Turn the joint by hand."""
        ...


S = TypeVar("S", bound=Struck)
S_co = TypeVar("S_co", bound=Struck, covariant=True)


class Chain(Protocol[S_co]):
    """What faults need of the chain they strike."""

    now_s: Callable[[], float]

    def here(self, servo_id: int) -> S_co:
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


class JointFaults(LineFaults, Generic[S]):
    """The faults of one chain that do not depend on what its servos speak."""

    def __init__(
        self, chain: Chain[S], commands: Commands, seed: int = 0, header: bytes = HEADER
    ) -> None:
        super().__init__(chain, commands, seed, header)
        self._bus = chain

    def collide(self, servo_id: int) -> str:
        """Put a second servo with the same id on the bus: both answer at once."""
        self._bus.join(servo_id)
        return f"two servos have id {servo_id} now"

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

    def _servos(self, servo_id: int | None) -> list[S]:
        """Give a servo, or all (None), brought up to now."""
        ids = self._bus.ids() if servo_id is None else (servo_id,)
        return [self._bus.here(one) for one in ids]

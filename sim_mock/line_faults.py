"""All that can go wrong on an emulated bus, on request: on the line, in a servo, at the plug.

Every method does one thing and says what it did. What happens to answers lasts for
``count`` of them, for ``seconds`` of the chain's time, or until ``clear``; the id None
stands for every servo. ``command`` takes the same as a line of text.
"""

import json
from collections.abc import Callable
from typing import Protocol

from sim_mock.servo import Servo
from sim_mock.wire_faults import ActiveFaults, Fault

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


class Faults:
    """The faults of one chain."""

    def __init__(self, chain: Chain, seed: int = 0) -> None:
        self._chain = chain
        self.wire = ActiveFaults(seed)

    def command(self, text: str) -> str:
        """Carry out a line such as ``lose 3 count 2``; gives what was done.

        Raises:
            ValueError: names the word that is wrong and what would be right.
        """
        from sim_mock.fault_commands import obey

        return obey(self, text)

    def _begin(
        self,
        kind: str,
        servo_id: int | None,
        says: str,
        count: int | None,
        seconds: float | None,
        numbers: tuple[float, ...] = (),
        data: bytes | None = None,
    ) -> str:
        if servo_id is not None:
            self._chain.here(servo_id)
        until_s = None if seconds is None else self._chain.now_s() + seconds
        self.wire.add(Fault(kind, servo_id, numbers, data, count, until_s))
        span = "" if count is None else f" {count} times"
        span += "" if seconds is None else f" for {seconds:g} s"
        return says + (span or " until cleared")

    # --- what arrives of an answer

    def lose(
        self, servo_id: int | None, count: int | None = None, seconds: float | None = None
    ) -> str:
        """Let a servo stay silent though it obeys."""
        return self._begin("lose", servo_id, f"{who(servo_id)} does not answer", count, seconds)

    def delay(
        self,
        servo_id: int | None,
        ms: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers come late; in a group those behind wait as well."""
        says = f"{who(servo_id)} answers {ms:g} ms late"
        return self._begin("delay", servo_id, says, count, seconds, (ms,))

    def truncate(
        self,
        servo_id: int | None,
        kept: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let only the first bytes of answers arrive."""
        says = f"only {kept} bytes arrive of what {who(servo_id)} answers"
        return self._begin("truncate", servo_id, says, count, seconds, (kept,))

    def duplicate(
        self, servo_id: int | None, count: int | None = None, seconds: float | None = None
    ) -> str:
        """Let answers arrive twice."""
        says = f"what {who(servo_id)} answers arrives twice"
        return self._begin("duplicate", servo_id, says, count, seconds)

    def corrupt(
        self,
        servo_id: int | None,
        bit: int | None = None,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Flip one bit of answers, counted from the first byte's lowest; by dice where None."""
        numbers = () if bit is None else (float(bit),)
        says = f"a bit flips in what {who(servo_id)} answers"
        return self._begin("corrupt", servo_id, says, count, seconds, numbers)

    def drop(
        self,
        servo_id: int | None,
        byte: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let one byte of answers be lost, 0 for the first, -1 for the last."""
        says = f"byte {byte} is lost of what {who(servo_id)} answers"
        return self._begin("drop", servo_id, says, count, seconds, (byte,))

    def stall(
        self,
        servo_id: int | None,
        ms: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers stop half-way for a while."""
        says = f"{who(servo_id)} stops for {ms:g} ms half-way through its answer"
        return self._begin("stall", servo_id, says, count, seconds, (ms,))

    def noise(
        self,
        where: str,
        data: bytes | None = None,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Put bytes (None: eight random ones) ``before`` or ``after`` whatever is answered."""
        if where not in ("before", "after"):
            raise ValueError(f"noise {where!r}: it can be before or after the answer")
        what = "random bytes" if data is None else data.hex(" ")
        says = f"noise ({what}) {where} answers"
        return self._begin(f"noise_{where}", None, says, count, seconds, (), data)

    def fragment(
        self,
        servo_id: int | None = None,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Put a header without a packet before the real one."""
        says = f"a loose header FF FF FD 00 before what {who(servo_id)} answers"
        return self._begin("fragment", servo_id, says, count, seconds)

    def reorder(self, count: int | None = None, seconds: float | None = None) -> str:
        """Let the answers of a group come in the wrong order."""
        return self._begin("reorder", None, "groups answer in reverse order", count, seconds)

    # --- what a servo says

    def wrong_id(
        self,
        servo_id: int | None,
        other: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers carry another id, with a right CRC."""
        says = f"{who(servo_id)} answers as {other}"
        return self._begin("wrong_id", servo_id, says, count, seconds, (other,))

    def short(
        self,
        servo_id: int | None,
        fewer: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers hold fewer parameter bytes, with a right CRC and no error."""
        says = f"{who(servo_id)} answers {fewer} bytes too few"
        return self._begin("short", servo_id, says, count, seconds, (fewer,))

    def long(
        self,
        servo_id: int | None,
        more: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers hold more parameter bytes, with a right CRC and no error."""
        says = f"{who(servo_id)} answers {more} bytes too many"
        return self._begin("long", servo_id, says, count, seconds, (more,))

    def refuse(
        self,
        servo_id: int | None,
        number: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers carry an error number and no parameters."""
        says = f"{who(servo_id)} answers with error {number} and no data"
        return self._begin("refuse", servo_id, says, count, seconds, (number,))

    # --- what the line does

    def echo(self, on: bool = True, seconds: float | None = None) -> str:
        """Let the host hear its own bytes."""
        return self._switch("echo", on, "the line echoes the host", seconds)

    def babble(self, on: bool = True, seconds: float | None = None) -> str:
        """Let a broken node send headers and noise all the time."""
        return self._switch("babble", on, "a broken node babbles", seconds)

    def lose_writes(self, count: int | None = None, seconds: float | None = None) -> str:
        """Let sync and bulk writes be lost on their way; no status tells."""
        return self._begin("lose_writes", None, "group writes are lost", count, seconds)

    def unplug(self, seconds: float | None = None) -> str:
        """Pull the adapter out of the host."""
        return self._switch("unplug", True, "unplugged", seconds)

    def plug(self) -> str:
        """Put the adapter back."""
        return self._switch("unplug", False, "unplugged", None)

    def deny(self, on: bool = True, seconds: float | None = None) -> str:
        """Let opening the port be forbidden."""
        return self._switch("deny", on, "opening is forbidden", seconds)

    def block(self, on: bool = True, seconds: float | None = None) -> str:
        """Let the adapter take no bytes: its buffer is full and stays so."""
        return self._switch("block", on, "the adapter takes no bytes", seconds)

    def _switch(self, kind: str, on: bool, says: str, seconds: float | None) -> str:
        self.wire.remove(kind)
        if on:
            return self._begin(kind, None, says, None, seconds)
        return f"no longer: {says}"

    # --- what happens to a servo

    def collide(self, servo_id: int) -> str:
        """Put a second servo with the same id on the bus: both answer at once."""
        self._chain.join(servo_id)
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
        self._chain.here(servo_id).brown_out()
        return f"servo {servo_id} restarts"

    def reset(self, servo_id: int) -> str:
        """Let a servo be as from the factory: id 1, 57600 baud."""
        error = self._chain.here(servo_id).factory_reset(0xFF)
        if error:
            raise ValueError(f"servo {servo_id} refuses with error {error}: its torque is on")
        self._chain.refresh()
        return f"servo {servo_id} is as from the factory: id 1, 57600 bit/s"

    def voltage(self, servo_id: int | None, volts: float) -> str:
        """Supply a servo, or all, with another voltage."""
        for servo in self._servos(servo_id):
            servo.supply_v = volts
        return f"{who(servo_id)} has {volts:g} V"

    def temperature(self, servo_id: int | None, celsius: float) -> str:
        """Give a servo's motor a temperature, from which it drifts on by itself."""
        for servo in self._servos(servo_id):
            servo.temperature_c = celsius
        return f"{who(servo_id)} has {celsius:g} degC"

    def stick(self, servo_id: int | None) -> str:
        """Jam a joint where it is."""
        for servo in self._servos(servo_id):
            servo.hold_fast(True)
        return f"{who(servo_id)} is stuck"

    def free(self, servo_id: int | None) -> str:
        """Let a jammed joint go."""
        for servo in self._servos(servo_id):
            servo.hold_fast(False)
        return f"{who(servo_id)} is free"

    def load(self, servo_id: int | None, nm: float) -> str:
        """Hang a constant torque on a joint."""
        for servo in self._servos(servo_id):
            servo.pull(nm)
        return f"{who(servo_id)} carries {nm:g} Nm"

    def turn(self, servo_id: int | None, steps: float) -> str:
        """Turn a joint by hand."""
        for servo in self._servos(servo_id):
            servo.turn(steps)
        return f"{who(servo_id)} was turned by {steps:g} steps"

    def _servos(self, servo_id: int | None) -> list[Servo]:
        """Give a servo, or all (None), brought up to now."""
        ids = self._chain.ids() if servo_id is None else (servo_id,)
        return [self._chain.here(one) for one in ids]

    def _fail(self, servo_id: int, error: str) -> str:
        self._chain.here(servo_id).fail(error)
        return f"servo {servo_id} has latched: {error}"

    # --- all

    def on(self, kind: str) -> bool:
        """Tell whether echo, babble, unplug, deny or block is on now."""
        return self.wire.on(kind, self._chain.now_s())

    def choose(self, case: str, value: str) -> str:
        """Choose what servos do where documents and devices differ.

        Raises:
            ValueError: there is no such case or value.
        """
        self._chain.choose(case, value)
        return f"{case} is {value}"

    def clear(self, servo_id: int | None = None) -> str:
        """End every fault of the line (of one servo's answers); what servos suffered stays."""
        return f"{self.wire.remove(None, servo_id)} faults cleared"

    def status(self) -> str:
        """Give all servos and the faults in force as one line of JSON."""
        servos = [self._report(servo_id) for servo_id in self._chain.ids()]
        faults = [
            f"{fault.kind} {'all' if fault.servo_id is None else fault.servo_id}"
            for fault in self.wire.listed(self._chain.now_s())
        ]
        return json.dumps({"servos": servos, "faults": faults})

    def _report(self, servo_id: int) -> dict[str, object]:
        servo = self._chain.here(servo_id)
        report: dict[str, object] = {"id": servo_id, "model": servo.model.name}
        for key, (_, address, size) in _REPORTED.items():
            raw = servo.read(address, size) or b""
            report[key] = int.from_bytes(raw, "little", signed=size == 4)
        return report


def who(servo_id: int | None) -> str:
    """Name a servo for people."""
    return "everybody" if servo_id is None else f"servo {servo_id}"

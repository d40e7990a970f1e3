"""Settings of servos: comparison with the required values, and correction.

Only registers that differ are written: EEPROM wears out, and a write to it requires torque off, or
a lock to be opened and closed. Every write is logged.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog, register_label
from gazerig.drivers.servo_bus.family import Register
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.drivers.servo_bus.torque import switch_off
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig


class Difference(NamedTuple):
    """A register of a servo with a wrong value."""

    servo_id: int
    register: Register
    found: int
    wanted: int


class Provisioning:
    """Comparison and correction of servo settings.

    Args:
        line: Exchanges with groups of servos.
        registers: Exchanges with single servos.
        setups: The servos.
        log: Records every write.
    """

    def __init__(
        self,
        line: Transactions,
        registers: Registers,
        setups: Sequence[ServoConfig],
        log: EventLog,
    ) -> None:
        self._line, self._family = line, line.family
        self._registers = registers
        self._log = log
        self.set_target(setups)

    def set_target(self, setups: Sequence[ServoConfig]) -> None:
        """Set the required settings."""
        self._setups = {setup.id: setup for setup in setups}
        self._wanted = {setup.id: self._family.wanted_settings(setup) for setup in setups}

    def wanted(self, servo_id: int) -> Mapping[str, int]:
        """Return the required values of a servo's registers, by name."""
        return self._wanted[servo_id]

    def apply(self, ids: Sequence[int]) -> None:
        """Set servos to position mode with their limits, speeds and gains.

        Torque is switched off on servos whose EEPROM differs.

        Raises:
            ServoMissing: a servo does not answer or rejects a setting.
            BusLost: the port is lost.
        """
        for _ in range(self._family.correction_passes):
            differences = self._differences(ids)
            if not differences:
                break
            self._correct(differences)
        else:
            differences = self._differences(ids)
        if differences:
            named = "; ".join(
                f"{self._setups[servo_id].label()} does not accept "
                f"{register_label(register.name)} {wanted}, it has {found}"
                for servo_id, register, found, wanted in differences
            )
            raise ServoMissing(
                f"{self._port_name}: {named}: restart its power or correct the rig file"
            )

    def disable(self, ids: Sequence[int]) -> None:
        """Make servos answer every instruction, and switch torque and bus watchdog off.

        Raises:
            ServoMissing: a servo does not confirm it.
        """
        # A servo may be set to answer only reads; this write needs no answer and changes that.
        self._registers.write_all(ids, "status_return_level", self._family.answer_level)
        released = switch_off(self._line, ids)
        self._raise_missing(released.unconfirmed_ids, (), "torque_enable")
        if released.holding_ids:
            named = ", ".join(self._setups[i].label() for i in released.holding_ids)
            raise ServoMissing(f"{self._port_name}: {named} keeps its torque: restart its power")

    def _differences(self, ids: Sequence[int]) -> list[Difference]:
        """Read servos and return the registers with wrong values."""
        different, registers = list[Difference](), self._family.registers
        for first, last in self._family.read_spans:
            start, stop = registers[first].address, registers[last].address + registers[last].size
            concerned = {
                i: names
                for i in ids
                if (names := [n for n in self._wanted[i] if start <= registers[n].address < stop])
            }
            if not concerned:
                continue
            found = self._line.ask_bytes(tuple(concerned), start, stop - start)
            self._raise_missing(concerned, found, first)
            for servo_id, names in concerned.items():
                for register in map(registers.__getitem__, names):
                    at = register.address - start
                    value = register.decode(found[servo_id][at : at + register.size])
                    wanted = self._wanted[servo_id][register.name]
                    wanted = self._family.corrected_value(register.name, value, wanted)
                    if value != wanted:
                        different.append(Difference(servo_id, register, value, wanted))
        return different

    def _correct(self, differences: Sequence[Difference]) -> None:
        """Write the registers that differ; EEPROM without torque and with the lock open."""
        lock = self._family.lock_register
        ids = dict.fromkeys(one.servo_id for one in differences)
        for servo_id in ids:
            self._write(servo_id, "torque_enable", 0)
            if lock:
                self._write(servo_id, lock, 0)
        try:
            for servo_id, register, found, wanted in differences:
                who = self._setups[servo_id].label()
                if register.name == lock or self._write(servo_id, register.name, wanted):
                    self._log.add(f"{who}: {register_label(register.name)} {found} -> {wanted}")
        finally:
            for servo_id in ids if lock else ():
                self._write(servo_id, str(lock), 1)

    def _write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register; return whether the servo accepted it."""
        written = self._registers.write(servo_id, name, value)
        if not written and not self._registers.refusal:
            self._raise_missing((servo_id,), (), name)
        return written

    def _raise_missing(self, ids: Iterable[int], found: Collection[int], what: str) -> None:
        missing = [self._setups[i].label() for i in ids if i not in found]
        if missing:
            fault = (
                f"{self._port_name}: {', '.join(missing)} does not answer when asked for its "
                f"{register_label(what)}"
            )
            remedy, now_s = "check its cable, restart its power", self._line.port.now_s()
            raise ServoMissing(self._line.lateness.blame(fault, remedy, now_s))

    @property
    def _port_name(self) -> str:
        return self._line.port.port_name

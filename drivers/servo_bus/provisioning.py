"""Settings of servos: comparison with the required values, and correction.

Only registers that differ are written: EEPROM wears out, and a write to it requires torque off, or
a lock to be opened and closed. Every write is logged.
"""

from collections.abc import Mapping, Sequence

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog, register_label
from gazerig.drivers.servo_bus.torque import raise_missing, write_verified
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig

Differences = dict[int, dict[str, tuple[int, int]]]
"""Found and wanted values of registers that differ, by servo and name."""


class Provisioning:
    """Comparison and correction of servo settings.

    Args:
        line: Exchanges on the bus.
        setups: The servos by id, with the present setups.
        log: Records every write.
    """

    def __init__(
        self, line: Transactions, setups: Mapping[int, ServoConfig], log: EventLog
    ) -> None:
        self._line, self._family = line, line.family
        self._setups, self._log = setups, log

    def wanted(self, servo_id: int) -> Mapping[str, int]:
        """Return the required values of a servo's registers, by name."""
        return self._family.wanted_settings(self._setups[servo_id])

    def apply(self, ids: Sequence[int]) -> None:
        """Set servos to position mode with their limits, speeds and gains.

        Torque is switched off on servos whose settings differ.

        Raises:
            ServoMissing: a servo does not answer or rejects a setting.
            BusLost: the port is lost.
        """
        for _ in range(2):  # a first correction may reset other settings
            differences = self._differences(ids)
            if not differences:
                return
            for servo_id, settings in differences.items():
                self._correct(servo_id, settings)
        for servo_id, settings in self._differences(ids).items():
            name, (found, wanted) = next(iter(settings.items()))
            raise ServoMissing(
                f"{self._line.port.port_name}: {self._line.label(servo_id)} changes "
                f"{register_label(name)} {wanted} to {found}: restart its power"
            )

    def _differences(self, ids: Sequence[int]) -> Differences:
        """Read servos and return the settings that differ."""
        different: Differences = {}
        registers = self._family.registers
        wanted = {servo_id: self.wanted(servo_id) for servo_id in ids}
        for span in self._family.read_spans:
            low, high = (registers[name].address for name in span)
            concerned = [
                i for i in ids if any(low <= registers[n].address <= high for n in wanted[i])
            ]
            found = read_registers(self._line, concerned, *span)
            raise_missing(self._line, [i for i in concerned if i not in found])
            for servo_id, values in found.items():
                for name in filter(values.__contains__, wanted[servo_id]):
                    value = values[name]
                    target = self._family.corrected_value(name, value, wanted[servo_id][name])
                    if value != target:
                        different.setdefault(servo_id, {})[name] = value, target
        return different

    def _correct(self, servo_id: int, settings: Mapping[str, tuple[int, int]]) -> None:
        """Write settings without torque and with the EEPROM's lock open."""
        line, lock = self._line, self._family.lock_register
        write_verified(line, "torque_enable", {servo_id: 0})
        if lock:
            write_verified(line, lock, {servo_id: 0})
        try:
            for name, (found, wanted) in settings.items():
                if name != lock:
                    write_verified(line, name, {servo_id: wanted})
                self._log.add(f"{line.label(servo_id)}: {register_label(name)} {found} -> {wanted}")
        finally:
            if lock:
                write_verified(line, lock, {servo_id: 1})


def read_registers(
    line: Transactions, ids: Sequence[int], first: str, last: str
) -> dict[int, dict[str, int]]:
    """Read a range of registers of some servos; return the values by id and name."""
    registers = line.family.registers
    start, stop = registers[first].address, registers[last].address + registers[last].size
    inside = [one for one in registers.values() if start <= one.address < stop]
    return {
        servo_id: {
            one.name: one.decode(data[one.address - start : one.address - start + one.size])
            for one in inside
        }
        for servo_id, data in line.ask_bytes(ids, start, stop - start).items()
    }

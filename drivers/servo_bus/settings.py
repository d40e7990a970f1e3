"""Settings of servos: comparison with the required values, and correction.

Only registers that differ are written: EEPROM wears out, and a write to it requires torque off, or
a lock to be opened and closed. Every write is logged.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog, register_label
from gazerig.drivers.servo_bus.torque import raise_missing, write_verified
from gazerig.drivers.servo_bus.transaction import Transactions

if TYPE_CHECKING:
    from gazerig.drivers.types import ServoConfig


def apply_settings(
    line: Transactions, setups: Mapping[int, "ServoConfig"], ids: Sequence[int], log: EventLog
) -> None:
    """Set servos to position mode with their limits, speeds and gains.

    Torque is switched off on servos whose settings differ.

    Raises:
        ServoMissing: a servo does not answer or rejects a setting.
        BusLost: the port is lost.
    """
    for _ in range(2):  # a first correction may reset other settings
        differences = _differences(line, setups, ids)
        if not differences:
            return
        for servo_id, settings in differences.items():
            write_settings(line, servo_id, {name: wanted for name, (_, wanted) in settings.items()})
            for name, (found, wanted) in settings.items():
                log.add(f"{line.label(servo_id)}: {register_label(name)} {found} -> {wanted}")
    for servo_id, settings in _differences(line, setups, ids).items():
        name, (found, wanted) = next(iter(settings.items()))
        raise ServoMissing(
            f"{line.port.port_name}: {line.label(servo_id)} changes {register_label(name)} {wanted} "
            f"to {found}: restart its power"
        )


def _differences(
    line: Transactions, setups: Mapping[int, "ServoConfig"], ids: Sequence[int]
) -> dict[int, dict[str, tuple[int, int]]]:
    """Return the found and wanted values of settings that differ, by servo and name."""
    different: dict[int, dict[str, tuple[int, int]]] = {}
    family = line.family
    wanted = {servo_id: family.wanted_settings(setups[servo_id]) for servo_id in ids}
    for span in family.read_spans:
        low, high = (family.registers[name].address for name in span)
        concerned = [
            i for i in ids if any(low <= family.registers[n].address <= high for n in wanted[i])
        ]
        found = line.ask_span(concerned, *span)
        raise_missing(line, [i for i in concerned if i not in found])
        for servo_id, values in found.items():
            for name in filter(values.__contains__, wanted[servo_id]):
                target = family.corrected_value(name, values[name], wanted[servo_id][name])
                if values[name] != target:
                    different.setdefault(servo_id, {})[name] = values[name], target
    return different


def write_settings(line: Transactions, servo_id: int, values: Mapping[str, int]) -> None:
    """Write settings without torque and with the EEPROM's lock open, and read them back.

    Raises:
        ServoMissing: the servo does not answer or rejects one.
        BusLost: the port is lost.
    """
    lock = line.family.lock_register
    write_verified(line, "torque_enable", {servo_id: 0})
    if lock:
        write_verified(line, lock, {servo_id: 0})
    try:
        for name, value in values.items():
            if name != lock:
                write_verified(line, name, {servo_id: value})
    finally:
        if lock:
            write_verified(line, lock, {servo_id: 1})

"""Bringing STS servos into the state the driver needs.

Registers are written only where they differ: the EEPROM wears out. It is written with the
torque off and the lock (55) open, and the lock is closed again. Every write is noted in
the log.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from drivers.errors import ServoMissing
from drivers.event_log import EventLog, register_label, servo_label
from drivers.feetech.line import FeetechLine
from drivers.feetech.memory_table import MULTI_TURN, REGISTERS, TORQUE_FULL, Register
from drivers.feetech.registers import StsRegisters
from drivers.types import ServoSetup

POSITION_MODE = 0

SPANS = (("return_delay_time", "operating_mode"), ("torque_limit", "lock"))
"""First and last of registers that are read together."""


class Difference(NamedTuple):
    """A register of a servo that is not as it should be."""

    servo_id: int
    register: Register
    found: int
    wanted: int


class Fitting:
    """Compares servos with what they should be, and makes them so.

    Args:
        line, registers: the bus, for groups and for single servos.
        setups: the servos.
        log: notes every write.
    """

    def __init__(
        self,
        line: FeetechLine,
        registers: StsRegisters,
        setups: Sequence[ServoSetup],
        log: EventLog,
    ) -> None:
        self._line = line
        self._registers = registers
        self.want(setups)
        self._log = log

    def want(self, setups: Sequence[ServoSetup]) -> None:
        """Say what servos should be like from the next fitting on."""
        self._setups = {setup.id: setup for setup in setups}
        self._wanted = {setup.id: wanted_settings(setup) for setup in setups}

    def fit(self, ids: Sequence[int]) -> None:
        """Bring servos into position mode with their limits, gains and torque limits.

        Takes the torque away from those whose EEPROM differs.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer, or does not take a setting.
            drivers.errors.BusLost: the port is gone.
        """
        differences = self.differences(ids)
        if differences:
            self._correct(differences)
            self._refuse(self.differences(ids))

    def rest(self, ids: Sequence[int]) -> None:
        """Make every order be answered, and take the torque.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer.
        """
        # A servo may be set to answer questions alone; this takes no answer and ends that.
        self._registers.write_all(ids, "status_return_level", 1)
        found = self._line.ask(ids, "torque_enable")
        self._raise_missing(ids, found, "torque_enable")
        torque = REGISTERS["torque_enable"]
        self._correct([Difference(i, torque, on, 0) for i, on in found.items() if on])

    def differences(self, ids: Sequence[int]) -> list[Difference]:
        """Read servos and give what is not as it should be.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer.
        """
        different: list[Difference] = []
        for first, last in SPANS:
            start = REGISTERS[first].address
            length = REGISTERS[last].address + REGISTERS[last].size - start
            found = self._line.ask_bytes(ids, start, length)
            self._raise_missing(ids, found, first)
            for servo_id in ids:
                different += self._compare(servo_id, start, found[servo_id])
        return different

    def _compare(self, servo_id: int, start: int, data: bytes) -> list[Difference]:
        different = []
        for name, wanted in self._wanted[servo_id].items():
            register = REGISTERS[name]
            at = register.address - start
            if not 0 <= at < len(data):
                continue
            found = register.decode(data[at : at + register.size])
            if name == "phase":
                # One bit of several others, which belong to the servo's own making.
                wanted = found & ~MULTI_TURN
            if found != wanted:
                different.append(Difference(servo_id, register, found, wanted))
        return different

    def _correct(self, differences: Sequence[Difference]) -> None:
        """Write what differs: RAM as it is, EEPROM without torque and with the lock open."""
        kept = dict.fromkeys(d.servo_id for d in differences if d.register.area == "eeprom")
        for servo_id in kept:
            self._write(servo_id, "torque_enable", 0)
            self._write(servo_id, "lock", 0)
        try:
            for servo_id, register, found, wanted in differences:
                if register.name != "lock":
                    self._write(servo_id, register.name, wanted)
                who = servo_label(self._setups[servo_id])
                self._log.add(f"{who}: {register_label(register.name)} {found} -> {wanted}")
        finally:
            open_ones = [d.servo_id for d in differences if d.register.name == "lock"]
            for servo_id in dict.fromkeys([*kept, *open_ones]):
                self._write(servo_id, "lock", 1)

    def _write(self, servo_id: int, name: str, value: int) -> None:
        """Write a register.

        Raises:
            drivers.errors.ServoMissing: the servo does not confirm it.
        """
        if not self._registers.write(servo_id, name, value):
            self._raise_missing((servo_id,), {}, name)

    def _refuse(self, differences: Sequence[Difference]) -> None:
        """Raise what is still not as it should be."""
        if not differences:
            return
        named = "; ".join(
            f"{servo_label(self._setups[servo_id])} does not take "
            f"{register_label(register.name)} {wanted}, "
            f"it has {found}"
            for servo_id, register, found, wanted in differences
        )
        raise ServoMissing(f"{self._where}: {named}: restart its power or correct the rig file")

    def _raise_missing(self, ids: Iterable[int], found: Mapping[int, object], what: str) -> None:
        missing = [servo_label(self._setups[i]) for i in ids if i not in found]
        if missing:
            raise ServoMissing(
                f"{self._where}: {', '.join(missing)} does not answer when asked for its "
                f"{register_label(what)}: check its cable, restart its power"
            )

    @property
    def _where(self) -> str:
        return self._line.port.port_name


def wanted_settings(setup: ServoSetup) -> dict[str, int]:
    """Give the registers a servo must have, by name, in register units.

    Of "phase" only the bit for many turns is meant: it must be 0.
    """
    wanted = {
        "return_delay_time": 0,
        "status_return_level": 1,
        "min_position_limit": max(0, setup.min_steps),
        # Both limits 0 would mean none at all.
        "max_position_limit": max(1, setup.max_steps),
        "phase": 0,
        "angular_resolution": 1,
        "operating_mode": POSITION_MODE,
        "lock": 1,
    }
    if setup.strength is not None:
        wanted["torque_limit"] = round(setup.strength * TORQUE_FULL)
    if setup.gains is not None:
        names = ("position_p_gain", "position_i_gain", "position_d_gain")
        wanted |= dict(zip(names, setup.gains, strict=True))
    return wanted

"""Bringing servos into the state the driver needs, one register at a time.

Registers are written only where they differ: the EEPROM wears out, and a write to it
needs the torque off. Every write is noted in the log.
"""

import struct
from collections.abc import Iterable, Mapping, Sequence
from math import ceil
from typing import NamedTuple

from drivers.dynamixel.control_table import (
    ACCELERATION_UNIT_STEPS_S2,
    MODELS,
    PWM_FULL,
    REGISTERS,
    VELOCITY_UNIT_STEPS_S,
    IndirectBlock,
    Register,
)
from drivers.errors import ServoMissing
from drivers.event_log import EventLog, register_label, servo_label
from drivers.servo_bus.line import Line
from drivers.servo_bus.read_windows import INDIRECT_MAP
from drivers.servo_bus.registers import Registers
from drivers.types import ServoSetup

POSITION_MODE = 3

STEEPEST_PWM = 255
"""PWM Slope: with the factory's 140 a motor needs 36 ms from full drive to full brake, in which a
lid at 600 deg/s runs 4 deg too far."""

MOST_ACCELERATION = 32767
"""Largest Profile Acceleration."""

SPANS = (
    ("return_delay_time", "drive_mode", "operating_mode"),
    ("pwm_limit",),
    ("pwm_slope",),
    ("velocity_limit", "max_position_limit", "min_position_limit"),
    ("position_d_gain", "position_i_gain", "position_p_gain"),
    ("profile_acceleration", "profile_velocity"),
)
"""Registers side by side, read together; written in this order, as a new operating mode
puts gains and profile back."""


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
        block: where the indirect map goes, None where there is none.
        log: notes every write.
    """

    def __init__(
        self,
        line: Line,
        registers: Registers,
        setups: Sequence[ServoSetup],
        block: IndirectBlock | None,
        log: EventLog,
    ) -> None:
        self._line = line
        self._registers = registers
        self.want(setups)
        self._block = block
        self._log = log

    def want(self, setups: Sequence[ServoSetup]) -> None:
        """Say what servos should be like from the next fitting on."""
        self._setups = {setup.id: setup for setup in setups}
        self._wanted = {setup.id: wanted_settings(setup) for setup in setups}

    def fit(self, ids: Sequence[int]) -> None:
        """Bring servos into position mode with their limits, speeds and gains.

        Takes the torque away from those that differ.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer, or does not take a setting.
            drivers.errors.BusLost: the port is gone.
        """
        differences = self.differences(ids)
        if differences:
            self._correct(differences)
            # What was changed is read again; a new operating mode has changed other things.
            self._correct(self.differences(ids))
            self._refuse(self.differences(ids))
        if self._block is not None:
            self._map(ids, self._block)

    def rest(self, ids: Sequence[int]) -> None:
        """Torque off and bus watchdog off, where they are not.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer.
        """
        # A servo may be set to answer pings alone; this takes no answer and ends that.
        self._registers.write_all(ids, "status_return_level", 2)
        for name in ("torque_enable", "bus_watchdog"):
            register = REGISTERS[name]
            found = self._line.ask_bytes(ids, register.address, register.size)
            self._raise_missing(ids, found, name)
            self._correct(
                [Difference(i, register, data[0], 0) for i, data in found.items() if data[0]]
            )

    def differences(self, ids: Sequence[int]) -> list[Difference]:
        """Read servos and give what is not as it should be.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer.
        """
        different = []
        for names in SPANS:
            concerned = [i for i in ids if any(name in self._wanted[i] for name in names)]
            if not concerned:
                continue
            registers = [REGISTERS[name] for name in names]
            start = registers[0].address
            length = registers[-1].address + registers[-1].size - start
            found = self._line.ask_bytes(concerned, start, length)
            self._raise_missing(concerned, found, names[0])
            for servo_id in concerned:
                different += self._compare(servo_id, registers, found[servo_id])
        return different

    def _compare(
        self, servo_id: int, registers: Iterable[Register], data: bytes
    ) -> list[Difference]:
        different, at = [], 0
        for register in registers:
            value = int.from_bytes(data[at : at + register.size], "little", signed=register.signed)
            at += register.size
            wanted = self._wanted[servo_id].get(register.name, value)
            # A higher velocity limit than needed may stay.
            enough = register.name == "velocity_limit" and value > wanted
            if value != wanted and not enough:
                different.append(Difference(servo_id, register, value, wanted))
        return different

    def _correct(self, differences: Sequence[Difference]) -> None:
        """Write what differs, the torque off."""
        for servo_id in dict.fromkeys(difference.servo_id for difference in differences):
            self._write(servo_id, "torque_enable", 0)
        for servo_id, register, found, wanted in differences:
            who = servo_label(self._setups[servo_id])
            if self._write(servo_id, register.name, wanted):
                self._log.add(f"{who}: {register_label(register.name)} {found} -> {wanted}")

    def _write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register; tells whether the servo has taken it.

        Raises:
            drivers.errors.ServoMissing: it does not answer.
        """
        written = self._registers.write(servo_id, name, value)
        if not written and not self._registers.refusal:
            self._raise_missing((servo_id,), {}, name)
        return written

    def _map(self, ids: Sequence[int], block: IndirectBlock) -> None:
        """Lay the indirect block out where it is not yet."""
        wanted = struct.pack(f"<{len(INDIRECT_MAP)}H", *INDIRECT_MAP)
        for servo_id, data in self._addresses(ids, block, len(wanted)).items():
            if data != wanted:
                self._registers.write_bytes(servo_id, block.address_base, wanted)
                who = servo_label(self._setups[servo_id])
                self._log.add(f"{who}: Indirect Addresses set")
        found = self._addresses(ids, block, len(wanted))
        bad = [servo_label(self._setups[i]) for i, data in found.items() if data != wanted]
        if bad:
            raise ServoMissing(
                f"{self._where}: {', '.join(bad)} does not take the indirect addresses: restart "
                "the servo power, or set indirect_block: false"
            )

    def _addresses(self, ids: Sequence[int], block: IndirectBlock, length: int) -> dict[int, bytes]:
        found = self._line.ask_bytes(ids, block.address_base, length)
        self._raise_missing(ids, found, "indirect addresses")
        return found

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

    def _raise_missing(self, ids: Iterable[int], found: Mapping[int, bytes], what: str) -> None:
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
    """Give the registers a servo must have, by name, in register units."""
    model = MODELS[setup.model]
    speed = speed_units(setup.max_speed_steps_s)
    wanted = {
        "return_delay_time": 0,
        "drive_mode": 0,
        "operating_mode": POSITION_MODE,
        "min_position_limit": setup.min_steps,
        "max_position_limit": setup.max_steps,
        "velocity_limit": min(speed, model.velocity_limit),
        "profile_acceleration": acceleration_units(setup.max_accel_steps_s2),
        "profile_velocity": speed,
    }
    if model.family == "x330":
        wanted["pwm_slope"] = STEEPEST_PWM
    if setup.strength is not None:
        wanted["pwm_limit"] = round(setup.strength * PWM_FULL)
    if setup.gains is not None:
        names = ("position_p_gain", "position_i_gain", "position_d_gain")
        wanted |= dict(zip(names, setup.gains, strict=True))
    return wanted


def speed_units(speed_steps_s: float) -> int:
    """Give a speed in units of Profile Velocity, at least 1: there 0 means no limit."""
    return max(1, int(speed_steps_s / VELOCITY_UNIT_STEPS_S))


def acceleration_units(accel_steps_s2: float | None) -> int:
    """Return an acceleration in units of Profile Acceleration; 0, which is no limit, for none."""
    if accel_steps_s2 is None:
        return 0
    return min(MOST_ACCELERATION, max(1, ceil(accel_steps_s2 / ACCELERATION_UNIT_STEPS_S2)))

"""Dynamixel X servos on one serial bus (Protocol 2.0): one read and one write a tick."""

from collections.abc import Mapping, Sequence
from math import ceil
from struct import pack

from drivers.dynamixel.control_table import (
    FAST_READ_SINCE,
    MODELS,
    WATCHDOG_UNIT_S,
    IndirectBlock,
    indirect_blocks,
)
from drivers.dynamixel.family import DYNAMIXEL
from drivers.dynamixel.params import DynamixelParams as DynamixelParams
from drivers.dynamixel.protocol import ERROR_NUMBER
from drivers.dynamixel.registers import Registers
from drivers.errors import BusLost, PortError, ServoFault, ServoMissing
from drivers.event_log import EventLog, servo_label
from drivers.serial.port import BusPort
from drivers.serial.reconnect import LastingPort
from drivers.servo_bus.discovery import find
from drivers.servo_bus.faults import Health
from drivers.servo_bus.feedback import Readings
from drivers.servo_bus.goals import clipped
from drivers.servo_bus.poll_list import Roll
from drivers.servo_bus.provisioning import AddressMap, Provisioning
from drivers.servo_bus.read_windows import INDIRECT_MAP, alone_turns, direct_turns, indirect_turns
from drivers.servo_bus.recovery import Recovery
from drivers.servo_bus.supervisor import Care
from drivers.servo_bus.sync_read import Heard, Reader, Whole
from drivers.servo_bus.torque import switch_off
from drivers.servo_bus.transaction import Line
from drivers.types import BusHealth, ServoReading, ServoSetup

RESTART_S = 0.1
"""Servos that were all silent for so long may all have restarted: their power was cut."""


class DynamixelBus:
    """A chain of Dynamixel servos in position mode; implements drivers.types.ServoBus.

    Args:
        port: drivers.serial.port.BlockingPort, or an emulated port with its methods.
        setups: the servos, in the order of every sequence given and taken.
        params: how to speak with them.
    """

    def __init__(
        self, port: BusPort, setups: Sequence[ServoSetup], params: DynamixelParams
    ) -> None:
        self._port = port
        self._setups = self._wanted = tuple(setups)
        self._params = params
        self._ids = tuple(setup.id for setup in setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._limits = tuple((setup.min_steps, setup.max_steps) for setup in setups)
        self._goals = DYNAMIXEL.goals(self._ids)
        self._watchdog = ceil(params.watchdog_ms / 1000.0 / WATCHDOG_UNIT_S)
        self._log = EventLog()
        self._line = Line(
            port,
            DYNAMIXEL,
            params.prompt_timeout_ms / 1000.0,
            params.reply_timeout_ms / 1000.0,
            params.baud,
            {setup.id: servo_label(setup) for setup in setups},
        )
        self._opened = False
        self._now_s = 0.0
        self._assemble(None, False)

    def _assemble(self, block: IndirectBlock | None, fast: bool) -> None:
        """Make the parts, with a clean sheet, for what the servos can do."""
        by_id = self._by_id = {setup.id: setup for setup in self._setups}
        self._fast, self._block = fast, block
        self._link = LastingPort(
            self._port, self._params.baud, self._params.give_up_s, self._log, self._trust_nobody
        )
        self._roll = Roll(self._ids)
        self._readings = Readings(self._setups)
        self._health = Health(by_id, self._log)
        together = indirect_turns(block) if block else direct_turns()
        self._reader = Reader(self._line, self._roll, together, alone_turns(), fast)
        self._provisioning = Provisioning(
            self._line, Registers(self._port, tries=1), self._setups, self._log, _address_map(block)
        )
        self._recovery = Recovery(
            self._line, self._provisioning, by_id, self._watchdog, self._health, self._log
        )
        self._care = Care(
            self._line,
            by_id,
            self._watchdog,
            self._recovery,
            self._health,
            self._readings,
            covered=block is not None,
        )

    # --- the bus as others see it

    def open(self) -> None:
        """Open the port, find every servo, check and prepare it; torque stays off.

        Raises:
            drivers.errors.PortError: the port cannot be opened.
            drivers.errors.ServoMissing: servos are absent, of another model or refuse.
        """
        self._take_wanted()
        where, baud = self._port.port_name, self._params.baud
        if not self._port.setBaudRate(baud):
            raise PortError(f"{where} cannot run at {baud} bit/s: choose 57600 or 1000000")
        registers = Registers(self._port)
        try:
            firmware = find(self._line, registers, self._setups, self._log)
            self._assemble(self._common_block(firmware), self._all_fast(firmware))
            provisioning = Provisioning(
                self._line, registers, self._setups, self._log, _address_map(self._block)
            )
            provisioning.disable(self._ids)
            provisioning.apply(self._ids)
            self._line.starved = False
            self._care.find_alerts(self._ids)
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._opened = True

    def read(self, now_s: float) -> tuple[ServoReading | None, ...]:
        """Read all servos in one exchange; None where no fresh answer came.

        A servo that keeps silent is left out of the exchange and asked alone now and
        then, so whatever is wrong, a read takes a bounded time. While the port is gone all
        is None, and the port is tried again now and then.

        Raises:
            drivers.errors.BusLost: port or servos have been gone for longer than ``give_up_s``.
        """
        self._now_s = now_s
        if self._link.down and not self._link.returned(now_s):
            return (None,) * len(self._ids)
        if self._link.release_due and not self._caught_up():
            return (None,) * len(self._ids)
        try:
            readings = self._read(now_s)
        except BusLost as lost:
            self._lose(lost)
            return (None,) * len(self._ids)
        if self._roll.troubled:
            self._mind_silence(now_s)
        return readings

    def engage(self) -> tuple[int, ...]:
        """Set every goal to the present position (clipped to its limits), then torque on.

        A joint outside its limits is brought inside at 30 deg/s. Returns the goals that
        are now in force, in steps.

        Raises:
            drivers.errors.BusLost: the port is gone.
            drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
            drivers.errors.ServoFault: a servo has latched an error or lost its zero.
        """
        try:
            self._take_wanted()
            # A servo may have restarted since it was prepared.
            self._provisioning.apply(self._ids)
            goals, outside = self._recovery.enable(self._ids)
        except (ServoMissing, ServoFault):
            self.release()
            raise
        except BusLost:
            self._link.refused_release()  # some may have their torque already
            raise
        self._link.release_due = False
        self._care.take_on(outside)
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo in one packet; goals are clipped to the limits.

        Sends nothing while the torque is off, the port is gone, or servos that stopped by
        themselves have not been given their present positions as goals yet: the next
        read sees to that.

        Raises:
            ValueError: a goal is not a number, or there are not as many as servos.
        """
        goals = clipped(goals_steps, self._limits)
        if not self._care.engaged or self._link.down or self._line.starved:
            return
        try:
            self._line.send(self._goals.packet(goals, ()))
        except BusLost as lost:
            self._lose(lost)

    def retune(self, setups: Sequence[ServoSetup]) -> None:
        """Set the servos up so when the torque comes on the next time; the same ids and models.

        Ranges and speeds are in the servos' EEPROM, which they only write without torque,
        so under torque everything stays as it is.

        Raises:
            ValueError: these are other servos.
        """
        same = [(s.id, s.model) for s in setups] == [(s.id, s.model) for s in self._setups]
        if not same:
            raise ValueError("other servos need another bus: ids and models must stay")
        self._wanted = tuple(setups)

    def _take_wanted(self) -> None:
        """Put in force what was asked for since the torque was on last."""
        if self._wanted == self._setups:
            return
        self._setups = self._wanted
        self._limits = tuple((setup.min_steps, setup.max_steps) for setup in self._setups)
        self._by_id.update({setup.id: setup for setup in self._setups})
        self._provisioning.set_target(self._setups)

    def faults(self) -> tuple[str, ...]:
        """Name every fault that servos suffer from now, e.g. "neck_yaw (servo 7): overload"."""
        return tuple(
            f"{self._line.who(i)}: {fault}" for i, fault in sorted(self._health.faults.items())
        )

    def events(self) -> tuple[str, ...]:
        """Say what has happened since the last call."""
        return self._log.drain()

    def release(self) -> None:
        """Torque off on every servo, confirmed; never raises for a servo that does not answer.

        Raises:
            drivers.errors.BusLost: the port is gone, and stays so when tried once more; the
                torque is taken off by the first read after it is back.
        """
        self._care.let_go()
        if not self._opened:
            return
        if self._link.down and not self._link.open_once_more(self._now_s):
            self._link.refused_release()
            raise BusLost(self._cannot_release())
        self._switch_all_off()

    def _caught_up(self) -> bool:
        """Take off the torque that was asked off while the port was gone; True if that is done."""
        try:
            self._switch_all_off()
        except BusLost:
            return False
        return True

    def _switch_all_off(self) -> None:
        """Take the torque off, see that it is gone, and say where it is not.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        try:
            released = switch_off(self._line, self._ids)
        except BusLost as lost:
            self._lose(lost)
            self._link.refused_release()
            raise BusLost(self._cannot_release()) from lost
        self._link.released()
        self._line.errors["refused"] += len(released.holding)
        for kind, ids in (("still reports torque", released.holding), ("mute", released.mute)):
            for servo_id in ids:
                what = kind if kind != "mute" else "does not confirm that its torque is off"
                self._log.add(f"{self._line.who(servo_id)} {what}: cut the servo power")

    def health(self) -> BusHealth:
        """Give byte and error counts of all exchanges."""
        errors = {kind: count for kind, count in self._line.errors.items() if count}
        return BusHealth(self._line.tx_bytes, self._line.rx_bytes, errors)

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self._opened = False
        self._care.let_go()
        self._port.closePort()

    # --- what the servos can do

    def _all_fast(self, firmware: Mapping[int, int]) -> bool:
        """Tell whether everybody understands fast sync read."""
        return self._params.fast_sync_read and all(
            firmware[setup.id] >= FAST_READ_SINCE[MODELS[setup.model].family]
            for setup in self._setups
        )

    def _common_block(self, firmware: Mapping[int, int]) -> IndirectBlock | None:
        """Give the indirect block that all have in the same place, None where there is none."""
        if not self._params.indirect_block:
            return None
        blocks = [indirect_blocks(MODELS[s.model], firmware[s.id])[0] for s in self._setups]
        same = len({(block.address_base, block.data_base) for block in blocks}) == 1
        return blocks[0] if same else None

    # --- reading

    def _read(self, now_s: float) -> tuple[ServoReading | None, ...]:
        if self._line.starved:
            self._care.heal(self._roll.group)
        answer = self._reader.read(now_s)
        readings = self._readings.whole(answer) if isinstance(answer, Whole) else None
        if readings is None:
            readings = self._take(answer, now_s)
        elif self._health.returning:
            self._health.heard_again(now_s, self._line.lateness)
        self._care.tend(readings, self._roll.group, now_s)
        return tuple(readings)

    def _take(self, answer: Whole | dict[int, Heard], now_s: float) -> list[ServoReading | None]:
        """Take an answer servo by servo, each with its errors."""
        heard = answer.each() if isinstance(answer, Whole) else answer
        readings: list[ServoReading | None] = [None] * len(self._ids)
        if heard and self._health.silent_for_s(now_s) >= RESTART_S:
            self._care.suspect_all()
        dark = not self._roll.group
        for servo_id, one in heard.items():
            slot = self._slot[servo_id]
            was_out = self._roll.answered(servo_id)
            believed = self._care.judge(servo_id, one.sample)
            if was_out and self._care.engaged:
                self._care.check(servo_id)
            if one.sample.error & ERROR_NUMBER:
                self._line.errors["refused"] += 1
            elif was_out and dark:
                continue  # the first answer after long silence may be an old one
            elif believed and self._readings.believes(slot, one):
                readings[slot] = self._readings.one(slot, one)
            elif believed:
                self._line.errors["implausible"] += 1
        self._health.note_silent(
            self._roll.out, now_s, self._roll.garbling, self._line.lateness, bool(heard)
        )
        return readings

    def _mind_silence(self, now_s: float) -> None:
        """Give up where nobody has answered for too long.

        Raises:
            drivers.errors.BusLost: so it is.
        """
        silent_s = self._health.silent_for_s(now_s)
        if silent_s >= self._params.give_up_s:
            raise BusLost(
                f"{self._port.port_name}: no servo has answered for {silent_s:.1f} s: "
                "check servo power and the cable"
            )

    # --- a port that goes away

    def _lose(self, lost: BusLost) -> None:
        self._link.lose(lost, self._now_s)

    def _trust_nobody(self) -> None:
        """Begin anew with a port that was away."""
        self._roll = self._reader.roll = Roll(self._ids)
        self._line.starved = False
        self._care.suspect_all()

    def _cannot_release(self) -> str:
        """Say what servos do that cannot be told to let go."""
        rest = (
            f"their bus watchdog stops them within {self._watchdog * WATCHDOG_UNIT_S:.2f} s "
            "and they hold their place"
            if self._watchdog
            else "they go on to their last goal and hold it"
        )
        return (
            f"{self._port.port_name} is gone: torque could not be switched off; servos that have "
            f"power keep their torque, {rest}: cut the servo power to free them"
        )


def _address_map(block: IndirectBlock | None) -> AddressMap | None:
    """Return what the addresses of an indirect block must be."""
    if block is None:
        return None
    return AddressMap(block.address_base, pack(f"<{len(INDIRECT_MAP)}H", *INDIRECT_MAP))

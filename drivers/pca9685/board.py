"""PCA9685 boards as a board of hobby servos: sixteen channels each, ramped by the driver.

They hold pulses without any speed limit: each goal is sent as a series of intermediate pulses, and
the last one stays. A servo's id is sixteen times the number of its board plus its channel. Source:
NXP, PCA9685 data sheet, rev. 4 (16 April 2015), section 7.3.
"""

from collections.abc import Sequence
from math import ceil, floor
from typing import TYPE_CHECKING

from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import TRIES, Board
from gazerig.drivers.hobby_board.params import US_STEPS
from gazerig.drivers.i2c.transfers import FAILURES, OK, READ_STATUS, STUCK, read, write
from gazerig.drivers.pca9685.params import (
    ADDRESSES,
    CHANNELS,
    COUNTS,
    LEAST_PRESCALE,
    Pca9685Params,
)
from gazerig.drivers.serial.port import BusPort, wait_until

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.hobby_board.channel import Channel
    from gazerig.drivers.types import ServoConfig

MODE1, MODE2, LED0, ALL_LED, PRESCALE = 0x00, 0x01, 0x06, 0xFA, 0xFE
BYTES = 4
"""Bytes of one channel: ON low and high, OFF low and high."""

RESTART, EXTCLK, AUTO_INCREMENT, SLEEP = 0x80, 0x40, 0x20, 0x10
SILENT = SLEEP | RESTART | EXTCLK
"""Modes without pulses."""
AWAKE = AUTO_INCREMENT
"""MODE1 in operation: the board does not answer at the all-call address."""
TOTEM_POLE = 0x04
"""MODE2: outputs drive high and low, and change at the stop condition, never within a pulse."""
FULL_OFF = 0x10
"""Bit in the high byte of OFF: no pulses, for any value of ON (7.3.3)."""

START_S = 0.001
"""The oscillator is stable .5 ms after the end of sleep; a restart must not be requested earlier
(7.3.1.1)."""


def output_register(channel: int) -> int:
    """Return the first register of a channel."""
    return LED0 + BYTES * channel


def pulse_registers(counts: int) -> bytes:
    """Return the registers of a channel for a pulse; 0: none."""
    return bytes((0, 0, counts & 0xFF, counts >> 8)) if counts else bytes((0, 0, 0, FULL_OFF))


def counts_of(registers: bytes) -> int:
    """Return the counts of a channel's pulse from its registers; 0: none."""
    on_low, on_high, off_low, off_high = registers
    if off_high & FULL_OFF:
        return 0
    if on_high & FULL_OFF:
        return COUNTS
    return ((off_low | (off_high & 0x0F) << 8) - (on_low | (on_high & 0x0F) << 8)) % COUNTS


class Pca9685Board(Board):
    """The boards of one I2C bus.

    The port is a gazerig.drivers.i2c.port.I2cPort, or a serial or emulated port with a bridge.

    failure: error of the last exchange, "" for none
    """

    remedy = "is another program using the board? check power, SDA, SCL and ground"
    longest_ramp_s = 0.05
    params: Pca9685Params

    def __init__(self, port: BusPort, params: Pca9685Params, timing: BusTiming = TIMING) -> None:
        super().__init__(port, params, timing)
        self.failure = ""
        # Length of one 4096th of the period, quarter microseconds.
        self._grain_steps = self._grain(params.prescale)

    def _grain(self, prescale: int) -> float:
        return (prescale + 1) / self.params.oscillator_hz * 1e6 * US_STEPS

    def _place(self, servo_id: int) -> tuple[int, int]:
        """Return the address of a servo's board, and its channel on this board."""
        board, channel = divmod(servo_id, CHANNELS)
        return self.params.addresses[board], channel

    def _addresses(self, ids: Sequence[int]) -> list[int]:
        """Return the addresses of the boards of servos."""
        return list(dict.fromkeys(self._place(servo_id)[0] for servo_id in ids))

    # --- detection and setup

    def find(self, setups: "Sequence[ServoConfig]", log: EventLog) -> tuple[int, ...]:
        """Check that the boards answer and return the pulses of these servos; nothing changes.

        Raises:
            ServoMissing: a board does not answer, or another chip does.
        """
        for address in self._addresses([setup.id for setup in setups]):
            self._check_board(address)
        return self.read_all(setups)

    def is_pca9685(self, address: int) -> bool | None:
        """Return whether the chip at an address can be one; None without an answer.

        Reserved bits of its registers are 0. They are read one by one, which needs no setting.
        """
        for _ in range(TRIES):
            found = self._ask([(read(address, at, 1), 1) for at in (*range(LED0), PRESCALE)])
            if found is not None:
                registers = b"".join(found)
                wrong = registers[MODE2] & 0xE0 or any(byte & 1 for byte in registers[2:LED0])
                return not wrong and registers[-1] >= LEAST_PRESCALE
        return None

    def _check_board(self, address: int) -> None:
        where = f"{self.port.port_name}: "
        found = self.is_pca9685(address)
        if found is None:
            fault = f"{where}no PCA9685 answers at {address:#x}"
            remedy = (
                "does the board have its logic supply (VCC, not only V+)? check SDA, SCL and "
                "ground; its jumpers set the address"
            )
            if self.failure == STUCK:
                fault = f"{where}the I2C bus is stuck, its data or clock line is held low"
                remedy = (
                    "switch the supply of its devices off and on, check SDA and SCL for a short"
                )
            elif self.failure not in FAILURES.values():
                fault = f"{where}no answer as an I2C bus ({self.failure})"
                remedy = (
                    "a PCA9685 is reached over an I2C bus such as /dev/i2c-1: write it under "
                    "bus.port"
                )
            raise ServoMissing(self.blame(fault, remedy))
        if not found:
            raise ServoMissing(
                f"{where}the chip at {address:#x} is not a PCA9685: another chip has this "
                "address; close a jumper and write the new one under bus.pca9685.address"
            )
        modes = self._modes(address)
        if modes is not None and modes[0] & EXTCLK:
            raise ServoMissing(
                f"{where}the board at {address:#x} was set to an external clock: switch its logic "
                "supply off and on"
            )

    def _modes(self, address: int) -> tuple[int, int, int] | None:
        """Read both modes and the prescaler; None after a failure."""
        found = self._ask([(read(address, at, 1), 1) for at in (MODE1, MODE2, PRESCALE)])
        return None if found is None else (found[0][0], found[1][0], found[2][0])

    def _ensure_set_up(self, address: int) -> bool:
        """Set a board up if it is not, which stops all its pulses; return whether it is set up."""
        wanted = (AWAKE, TOTEM_POLE, self.params.prescale)
        modes = self._modes(address)
        if modes in (None, wanted):
            return modes == wanted
        # From any state: no pulses, sleep, prescaler, then wake.
        for register, byte in (
            (ALL_LED + BYTES - 1, FULL_OFF),
            (MODE1, SLEEP | AUTO_INCREMENT),
            (PRESCALE, self.params.prescale),
            (MODE2, TOTEM_POLE),
            (MODE1, AWAKE),
        ):
            if self._ask([(write(address, register, bytes((byte,))), 0)]) is None:
                return False
        wait_until(self.port, self.port.now_s() + START_S)
        # Channels that slept with pulses on would resume here; there are none now.
        self._ask([(write(address, MODE1, bytes((RESTART | AWAKE,))), 0)])
        return self._modes(address) == wanted

    # --- reading

    def _ask(self, transfers: Sequence[tuple[bytes, int]]) -> list[bytes] | None:
        """Send transfers and return the bytes that each of them reads; None if one failed.

        Args:
            transfers: Transfers, each with the number of bytes that it reads.
        """
        packet = b"".join([transfer + READ_STATUS for transfer, _ in transfers])
        wanted = sum(length + 1 for _, length in transfers)
        answer = self.exchange(packet, wanted)
        found, statuses, at = list[bytes](), list[int](), 0
        for _, length in transfers if len(answer) == wanted else ():
            found.append(answer[at : at + length])
            statuses.append(answer[at + length])
            at += length + 1
        # A failed transfer returns only its status.
        failures = [FAILURES[one] for one in statuses or answer if one in FAILURES]
        self.failure = ""
        if failures:
            self.failure = failures[0]
            self._owed_bytes = 0
        elif len(answer) < wanted:
            self.failure = "incomplete" if answer else "timeout"
        elif any(one != OK for one in statuses):
            self.failure = "damaged"
        if not self.failure:
            return found
        self.errors[self.failure] += 1
        return None

    def read_status(self, channel: int) -> tuple[int, tuple[str, ...]] | None:
        """Read a channel's pulse and the board's errors since the last read; None: no answer.

        A board that was reset sleeps and outputs no pulses, with any content of its registers.
        """
        address, nth = self._place(channel)
        output = read(address, output_register(nth), BYTES)
        found = self._ask([(read(address, MODE1, 1), 1), (output, BYTES)])
        if found is None:
            return None
        is_on = found[0][0] == AWAKE
        return (round(counts_of(found[1]) * self._grain_steps) if is_on else 0), ()

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Read pulses, quarter microseconds, 0 for none; None without an answer."""
        pulses: dict[int, int] = {}
        for address in self._addresses(channels):
            own = [servo_id for servo_id in channels if self._place(servo_id)[0] == address]
            modes = self._modes(address)
            # Register by register, as the board might not auto-increment.
            places = [output_register(one % CHANNELS) + k for one in own for k in range(BYTES)]
            found = self._ask([(read(address, at, 1), 1) for at in places])
            if modes is None or found is None:
                return None
            outputs = b"".join(found)
            for k, servo_id in enumerate(own):
                counts = counts_of(outputs[BYTES * k : BYTES * (k + 1)])
                is_on = not modes[0] & SILENT
                pulses[servo_id] = round(counts * self._grain(modes[2])) if is_on else 0
        return tuple(pulses[servo_id] for servo_id in channels)

    # --- sending

    def send_limits(self, channels: "Sequence[Channel]") -> bool:
        """Set the ramp limits of channels; return whether their boards are configured."""
        for channel in channels:
            channel.ramp.speed_steps_s = channel.top_speed_steps_s
            channel.ramp.accel_steps_s2 = channel.setup.max_accel_steps_s2 or 0.0
        return all(map(self._ensure_set_up, self._addresses([one.id for one in channels])))

    def send_goals(self, channels: "Sequence[Channel]") -> None:
        """Send the intermediate pulses of channels towards their goals."""
        self.send(b"".join([self._goal_transfer(channel) for channel in channels]))

    def _goal_transfer(self, channel: "Channel") -> bytes:
        address, nth = self._place(channel.id)
        steps, setup, grain = round(channel.ramp.pulse_steps), channel.setup, self._grain_steps
        counts = round(steps / grain)
        if setup.min_steps <= steps <= setup.max_steps:  # then the pulse sent is inside, too
            counts = max(min(counts, floor(setup.max_steps / grain)), ceil(setup.min_steps / grain))
        return write(address, output_register(nth), pulse_registers(counts))

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses, each by one register, in any state; on the last try all of a board."""
        places = [(address, output_register(nth)) for address, nth in map(self._place, channels)]
        if last_try:
            places += [(address, ALL_LED) for address in self._addresses(channels)]
        off = bytes((FULL_OFF,))
        self.send(b"".join([write(address, at + BYTES - 1, off) for address, at in places]))


def probe(port: BusPort, params: Pca9685Params) -> tuple[int, ...]:
    """Return the addresses of the boards on a bus; nothing changes, and the port stays open.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    board, found = Pca9685Board(port, params), []
    board.open_port()
    for address in ADDRESSES:
        if board.is_pca9685(address):
            found.append(address)
        elif board.failure and board.failure not in FAILURES.values():
            break  # no I2C bus
    return tuple(found)

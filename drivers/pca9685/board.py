"""A PCA9685 as a board of hobby servos: sixteen channels, ramped by the driver.

It holds pulses without any speed limit: each goal is sent as a series of intermediate pulses, and
the last one stays. Source: NXP, PCA9685 data sheet, rev. 4 (16 April 2015), section 7.3.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor
from typing import TYPE_CHECKING, Annotated, ClassVar

from gazerig.drivers.bus.servo_models import US_STEPS
from gazerig.drivers.hobby_board.board import TRIES, Board, HobbyBoardParams
from gazerig.drivers.i2c.transfers import OK, READ_STATUS, read, write
from gazerig.drivers.serial.port import BusPort, open_port, wait_until
from gazerig.params import Bounds

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

NO_ACKNOWLEDGES, NOT_ACKNOWLEDGED = (0xF1, 0xF2, 0xF3), "not acknowledged"

START_S = 0.001
"""The oscillator is stable .5 ms after the end of sleep; a restart must not be requested earlier
(7.3.1.1)."""


CHANNELS, COUNTS = 16, 4096
LEAST_PRESCALE = 3

PULSES_HZ = 50.0
"""Analogue servos need 50 pulses per second."""

RESERVED = (0x70, *range(0x78, 0x80))
"""All boards answer at 70 after power-up; from 78 on addresses have another meaning on I2C."""

ADDRESSES = tuple(address for address in range(0x40, 0x80) if address not in RESERVED)


@dataclass(frozen=True, slots=True)
class Pca9685Params(HobbyBoardParams):
    """Address and timing of a board."""

    # fmt: off
    address: Annotated[int, Bounds(0x40, 0x77), "I2C address of the board; 0x40 (64) unless address jumpers are closed."] = 0x40
    oscillator_hz: Annotated[float, Bounds(22_000_000, 28_000_000),
        "Frequency of the board's oscillator. It differs from board to board by some percent, and the pulse widths with it."] = 25e6
    # fmt: on
    pulse_range_us: ClassVar[tuple[float, float, str]] = (500.0, 2500.0, "what most servos accept")

    def __post_init__(self) -> None:
        """Check the address.

        Raises:
            ValueError: no board can have it.
        """
        if self.address in RESERVED:
            raise ValueError(f"address {self.address:#x} is reserved: boards have 0x40 to 0x77")

    @property
    def prescale(self) -> int:
        """Return the divider of the oscillator for the rate of the pulses."""
        return max(LEAST_PRESCALE, round(self.oscillator_hz / (COUNTS * PULSES_HZ)) - 1)

    @property
    def grain_steps(self) -> float:
        """Return the length of one 4096th of the period, quarter microseconds."""
        return (self.prescale + 1) / self.oscillator_hz * 1e6 * US_STEPS

    @property
    def channels(self) -> int:
        """Return the number of channels."""
        return CHANNELS


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


def channel_register(channel: int) -> int:
    """Return the first register of a channel."""
    return LED0 + BYTES * channel


class Pca9685Board(Board):
    """The board at one address of an I2C bus.

    The port is a gazerig.drivers.i2c.port.I2cPort, or a serial or emulated port with a bridge.

    failure: error of the last exchange, "" for none
    """

    remedy = "is another program using the board? check power, SDA, SCL and ground"
    longest_ramp_s = 0.05
    params: Pca9685Params
    failure = ""

    # --- detection and setup

    def find(self, setups: "Sequence[ServoConfig]") -> tuple[int, ...]:
        """Check that the board answers and return the pulses of these servos; nothing changes."""
        is_one, address = self.is_pca9685(), f"{self.params.address:#x}"
        if is_one:
            return self.read_all(setups)
        if is_one is False:
            raise self.missing(
                f"the chip at {address} is not a PCA9685, or noise has changed its settings",
                "switch its logic supply off and on; if that does not help, another chip has this "
                "address: close a jumper and write the new one under bus.pca9685.address",
            )
        if self.failure != NOT_ACKNOWLEDGED:
            raise self.missing(
                f"no answer as an I2C bus ({self.failure})",
                "a PCA9685 is reached over an I2C bus such as /dev/i2c-1: write it under bus.port",
            )
        raise self.missing(
            f"no PCA9685 answers at {address}",
            "does the board have its logic supply (VCC, not only V+)? check SDA, SCL and ground; "
            "its jumpers set the address",
        )

    def is_pca9685(self) -> bool | None:
        """Return whether the chip at the address can be one of ours; None without an answer.

        Reserved bits of its registers are 0. An external clock, once set, ends with the supply.
        """
        for _ in range(TRIES):
            found = self._read_single((*range(LED0), PRESCALE))
            if found is not None:
                wrong = found[MODE1] & EXTCLK or found[MODE2] & 0xE0
                is_odd = any(byte & 1 for byte in found[2:LED0])
                return not wrong and not is_odd and found[-1] >= LEAST_PRESCALE
        return None

    def _ensure_set_up(self) -> bool:
        """Set the board up if it is not, which stops all pulses; return whether it is set up."""
        wanted = bytes((AWAKE, TOTEM_POLE, self.params.prescale))
        modes = self._read_single((MODE1, MODE2, PRESCALE))
        if modes in (None, wanted):
            return modes == wanted
        # From any state: no pulses, sleep, prescaler, then wake. Channels that slept with pulses on
        # would resume at the restart; there are none now.
        for register, byte in (
            (ALL_LED + BYTES - 1, FULL_OFF),
            (MODE1, SLEEP | AUTO_INCREMENT),
            (PRESCALE, self.params.prescale),
            (MODE2, TOTEM_POLE),
            (MODE1, AWAKE),
            (MODE1, RESTART | AWAKE),
        ):
            if self._ask(write(self.params.address, register, bytes((byte,))), 0) is None:
                return False
            wait_until(self.port, self.port.now_s() + START_S)
        return self._read_single((MODE1, MODE2, PRESCALE)) == wanted

    # --- reading

    def _ask(self, transfer: bytes, length: int) -> bytes | None:
        """Send one transfer and return the bytes that it reads; None if it failed."""
        answer = self.exchange(transfer + READ_STATUS, length + 1)
        self.failure = ""
        if len(answer) == 1 and answer[0] in NO_ACKNOWLEDGES:
            # A failed transfer returns only its status.
            self.failure, self._owed_bytes = NOT_ACKNOWLEDGED, 0
        elif len(answer) <= length:
            self.failure = "incomplete" if answer else "timeout"
        elif answer[-1] != OK:
            self.failure = "damaged"
        self.errors.update([self.failure] if self.failure else ())
        return None if self.failure else answer[:-1]

    def _read_single(self, registers: Sequence[int]) -> bytes | None:
        """Read registers one by one, which needs no particular setting; None after a failure."""
        found = b""
        for register in registers:
            byte = self._ask(read(self.params.address, register, 1), 1)
            if byte is None:
                return None
            found += byte
        return found

    def read_status(self, channel: int) -> tuple[int, tuple[str, ...]] | None:
        """Read a channel's pulse; None without an answer.

        A board that was reset sleeps and outputs no pulses, with any content of its registers.
        """
        mode = self._read_single((MODE1,))
        if mode is None:
            return None
        output = self._ask(read(self.params.address, channel_register(channel), BYTES), BYTES)
        if output is None:
            return None
        return (round(counts_of(output) * self.params.grain_steps) if mode[0] == AWAKE else 0), ()

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Read pulses, quarter microseconds, 0 for none; None without an answer."""
        pulses = []
        for register in map(channel_register, channels):
            outputs = range(register, register + BYTES)
            found = self._read_single((MODE1, PRESCALE, *outputs))
            if found is None:
                return None
            grain_steps = self.params.grain_steps * (found[1] + 1) / (self.params.prescale + 1)
            is_on = not found[0] & SILENT
            pulses.append(round(counts_of(found[2:]) * grain_steps) if is_on else 0)
        return tuple(pulses)

    # --- sending

    def send_limits(self, channels: "Sequence[Channel]") -> bool:
        """Set the speed limits of channels; return whether the board is set up."""
        for channel in channels:
            channel.speed_steps_s = channel.top_speed_steps_s
        return self._ensure_set_up()

    def send_goals(self, channels: "Sequence[Channel]") -> None:
        """Send the intermediate pulses of channels towards their goals."""
        self.send(b"".join([self._goal_transfer(channel) for channel in channels]))

    def _goal_transfer(self, channel: "Channel") -> bytes:
        steps, setup, grain = round(channel.pulse_steps), channel.setup, self.params.grain_steps
        counts = round(steps / grain)
        if setup.min_steps <= steps <= setup.max_steps:  # then the pulse sent is inside, too
            counts = max(min(counts, floor(setup.max_steps / grain)), ceil(setup.min_steps / grain))
        register = channel_register(channel.id)
        return write(self.params.address, register, pulse_registers(counts))

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses, each by one register, in any state; on the last try all of the board."""
        registers = [*map(channel_register, channels), *([ALL_LED] if last_try else [])]
        off, address = bytes((FULL_OFF,)), self.params.address
        self.send(b"".join([write(address, at + BYTES - 1, off) for at in registers]))


def probe(port: BusPort) -> tuple[int, ...]:
    """Return the addresses of the boards on a bus; nothing changes, and the port stays open.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    found = []
    open_port(port, Pca9685Params.baud)
    for address in ADDRESSES:
        board = Pca9685Board(port, Pca9685Params(address))
        if board.is_pca9685():
            found.append(address)
        elif board.failure not in ("", NOT_ACKNOWLEDGED):
            break  # no I2C bus
    return tuple(found)

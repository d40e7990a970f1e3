"""PCA9685 boards as a board of hobby servos: sixteen channels each, ramped by the driver.

They hold pulses without any speed limit: each goal is sent as a series of intermediate pulses, and
the last one stays. A servo's id is sixteen times the number of its board plus its channel.
"""

from collections import defaultdict
from collections.abc import Sequence

from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import ChannelStatus
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.supervisor import read_every_pulse
from gazerig.drivers.i2c.line import I2cLine, read, write
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.pca9685.probe import check_board
from gazerig.drivers.pca9685.registers import (
    ALL_LED,
    AUTO_INCREMENT,
    AWAKE,
    BYTES,
    CHANNELS,
    EXTCLK,
    FULL_OFF,
    MODE1,
    MODE2,
    PRESCALE,
    RESTART,
    SLEEP,
    START_S,
    TOTEM_POLE,
    adjacent_runs,
    counts_of,
    output_register,
    pulse_registers,
)
from gazerig.drivers.serial.port import BusPort, wait_until
from gazerig.drivers.types import ServoConfig

SILENT = SLEEP | RESTART | EXTCLK
"""Modes without pulses."""

SETTINGS_CHANGED = "settings changed"

PRESCALE_EVERY = 8
"""Number of status reads per read of the prescaler."""


class Pca9685Board(I2cLine):
    """The boards of one bus; implements gazerig.drivers.hobby_board.board.Board.

    Args:
        port: gazerig.drivers.i2c.port.I2cPort, or a serial or emulated port with a bridge.
        params: Addresses and clock of the boards.
    """

    remedy = "is another program using the board? check power, SDA, SCL and ground"
    longest_ramp_s = 0.05
    """Longest time for which a ramp advances after a pause."""

    def __init__(self, port: BusPort, params: Pca9685Params, timing: BusTiming = TIMING) -> None:
        super().__init__(port, params.baud, timing.reply_timeout_s)
        self.params, self.timing = params, timing
        self.name = "board " + " and ".join(f"{address:#x}" for address in params.addresses)
        self._clock = params.clock
        self._status_reads = 0

    def _place(self, servo_id: int) -> tuple[int, int]:
        """Return the address of a servo's board, and its channel on this board."""
        board, channel = divmod(servo_id, CHANNELS)
        return self.params.addresses[board], channel

    def _addresses(self, ids: Sequence[int]) -> list[int]:
        """Return the addresses of the boards of servos."""
        return list(dict.fromkeys(self._place(servo_id)[0] for servo_id in ids))

    # --- detection and setup

    def find(self, setups: Sequence[ServoConfig], log: EventLog) -> tuple[int, ...]:
        """Check that the boards answer and return the pulses of these servos; nothing changes.

        Raises:
            BusLost: the port is lost.
            ServoMissing: a board does not answer, or another chip does.
        """
        for address in self._addresses([setup.id for setup in setups]):
            check_board(self, address)
        return read_every_pulse(self, setups)

    def prepare(self, log: EventLog) -> None:
        """Do nothing: boards are set up, if needed, before their first pulse."""

    def _ensure_set_up(self, address: int) -> bool:
        """Set a board up if it is not, which stops all its pulses; return whether it is set up."""
        wanted = (AWAKE, TOTEM_POLE, self._clock.prescale)
        modes = self._modes(address)
        if modes is None or modes == wanted:
            return modes == wanted
        mode1, _, prescale = modes
        if not mode1 & SILENT and prescale == self._clock.prescale:
            return self.write_confirmed(
                write(address, MODE1, bytes((AWAKE,))),
                write(address, MODE2, bytes((TOTEM_POLE,))),
            )
        # From any state: no pulses, sleep, prescaler, then wake.
        asleep = self.write_confirmed(
            write(address, ALL_LED + BYTES - 1, bytes((FULL_OFF,))),
            write(address, MODE1, bytes((SLEEP | AUTO_INCREMENT,))),
            write(address, PRESCALE, bytes((self._clock.prescale,))),
            write(address, MODE2, bytes((TOTEM_POLE,))),
            write(address, MODE1, bytes((AWAKE,))),
        )
        if not asleep:
            return False
        wait_until(self.port, self.port.now_s() + START_S)
        # Channels that slept with pulses on would resume here; there are none now.
        self.write_confirmed(write(address, MODE1, bytes((RESTART | AWAKE,))))
        return self._modes(address) == wanted

    def _modes(self, address: int) -> tuple[int, int, int] | None:
        """Read both modes and the prescaler, twice; None after a failure."""
        questions = [(read(address, at, 1), 1) for at in (MODE1, MODE2, PRESCALE)]
        found = self.ask(questions * 2)
        if found is None or found[:3] != found[3:]:
            self.errors["damaged"] += found is not None
            return None
        return found[0][0], found[1][0], found[2][0]

    # --- status

    def read_status(self, channel: Channel) -> ChannelStatus | None:
        """Read a channel's pulse and its board's mode; None without an answer.

        A board that was reset sleeps and outputs no pulses, with any content of its registers.
        """
        address, nth = self._place(channel.id)
        questions = [
            (read(address, MODE1, 1), 1),
            (read(address, output_register(nth), BYTES), BYTES),
            (read(address, PRESCALE, 1), 1),
        ]
        self._status_reads += 1
        with_prescale = self._status_reads % PRESCALE_EVERY == 0
        found = self.ask(questions if with_prescale else questions[:2])
        if found is None:
            return None
        mode = found[0][0]
        if mode & SILENT:
            return ChannelStatus(0)
        changed = mode != AWAKE or (with_prescale and found[2][0] != self._clock.prescale)
        errors = (SETTINGS_CHANGED,) if changed and channel.held else ()
        return ChannelStatus(round(counts_of(found[1]) * self._clock.resolution_steps), errors)

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Return the present pulses of channels, read twice; None if the reads differ or fail."""
        first = self._pulses_once(channels)
        second = None if first is None else self._pulses_once(channels)
        if second is not None and first != second:
            self.errors["damaged"] += 1
            return None
        return second

    def _pulses_once(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        pulses: dict[int, int] = {}
        for address in self._addresses(channels):
            own = [servo_id for servo_id in channels if self._place(servo_id)[0] == address]
            modes = self.ask([(read(address, at, 1), 1) for at in (MODE1, PRESCALE)])
            if modes is None:
                return None
            mode, prescale = modes[0][0], modes[1][0]
            if mode & SILENT:
                pulses.update(dict.fromkeys(own, 0))
                continue
            # Each channel in one transfer only if the board auto-increments.
            size = BYTES if mode & AUTO_INCREMENT else 1
            places = [
                output_register(servo_id % CHANNELS) + k
                for servo_id in own
                for k in range(0, BYTES, size)
            ]
            found = self.ask([(read(address, at, size), size) for at in places])
            if found is None:
                return None
            outputs, grain = b"".join(found), self._clock._replace(prescale=prescale)
            for k, servo_id in enumerate(own):
                counts = counts_of(outputs[BYTES * k : BYTES * (k + 1)])
                pulses[servo_id] = round(counts * grain.resolution_steps)
        return tuple(pulses[servo_id] for servo_id in channels)

    # --- sending

    def send_limits(self, channels: Sequence[Channel]) -> bool:
        """Set the ramp limits of channels; return whether their boards are configured."""
        for channel in channels:
            channel.ramp.speed_steps_s = channel.top_speed_steps_s
            channel.ramp.accel_steps_s2 = channel.setup.max_accel_steps_s2 or 0.0
        return all(map(self._ensure_set_up, self._addresses([one.id for one in channels])))

    def send_goals(self, channels: Sequence[Channel]) -> None:
        """Send the intermediate pulses of channels towards their goals, one transfer per board."""
        boards: dict[int, dict[int, bytes]] = defaultdict(dict)
        for channel in channels:
            address, nth = self._place(channel.id)
            steps, setup = round(channel.ramp.pulse_steps), channel.setup
            counts = self._clock.counts_within(steps, setup.min_steps, setup.max_steps)
            boards[address][nth] = pulse_registers(counts)
        packet = b"".join(
            [
                write(address, output_register(run[0]), b"".join([outputs[nth] for nth in run]))
                for address, outputs in boards.items()
                for run in adjacent_runs(sorted(outputs))
            ]
        )
        self.send(packet)

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses, each by one register, in any state; on the last try all of a board."""
        places = [(address, output_register(nth)) for address, nth in map(self._place, channels)]
        if last_try:
            places += [(address, ALL_LED) for address in self._addresses(channels)]
        off = bytes((FULL_OFF,))
        self.send(b"".join([write(address, at + BYTES - 1, off) for address, at in places]))


class Pca9685Bus(HobbyBoardBus):
    """The channels of the boards on one I2C bus; see HobbyBoardBus for its arguments."""

    board_class = Pca9685Board

"""PCA9685 boards as a board of hobby servos: sixteen channels each, ramped by the driver.

They hold pulses without any speed limit: each goal is sent as a series of intermediate pulses, and
the last one stays. A servo's id is sixteen times the number of its board plus its channel.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence

from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import BoardTexts, ChannelStatus
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.start import read_every_pulse
from gazerig.drivers.i2c import bridge
from gazerig.drivers.i2c.line import I2cLine
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
    SOFTWARE_RESET,
    START_S,
    TOTEM_POLE,
    adjacent_runs,
    counts_of,
    counts_within,
    output_register,
    pulse_registers,
)
from gazerig.drivers.serial.port import BusPort, wait_until
from gazerig.drivers.types import ServoConfig

LONGEST_LEAD_S = 0.05
"""Longest time for which a ramp advances after a pause."""

FOLLOW_UP_S = 0.015
"""Time without goals after which reads send the intermediate pulses."""

SILENT = SLEEP | RESTART | EXTCLK
"""Modes without pulses."""

NO_CLOCK = "it was set to an external clock, so it was reset"

PRESCALE_EVERY = 8
"""Number of status reads per read of the prescaler."""


class Pca9685Board:
    """The boards of one bus; implements gazerig.drivers.hobby_board.board.Board.

    Args:
        port: gazerig.drivers.i2c.port.I2cPort, or a serial or emulated port with a bridge.
        params: Addresses and clock of the boards.
    """

    noise_errors = ("damaged", "incomplete")

    longest_ramp_s = LONGEST_LEAD_S

    def __init__(self, port: BusPort, params: Pca9685Params, timing: BusTiming = TIMING) -> None:
        self.params, self.timing = params, timing
        self.line = I2cLine(port, params.baud, timing.reply_timeout_s)
        named = " and ".join(f"{address:#x}" for address in params.addresses)
        again = "is another program using the board? check SDA, SCL and ground"
        self.texts = BoardTexts(
            name=f"board {named}",
            no_pulses_remedy=again,
            other_pulse_remedy=again,
            noise_remedy="check SDA, SCL and ground, and the length of the cable",
            no_answer_remedy="check power, SDA, SCL and ground of its board",
            unreachable_behaviour="the board keeps its last pulses while it has power",
        )
        self._clock = params.clock
        self._places = [(address, nth) for address in params.addresses for nth in range(CHANNELS)]
        self._questions: dict[int, list[tuple[bytes, int]]] = {}
        self._sent: dict[int, tuple[int, int]] = {}
        self._sent_s = 0.0
        self._next_look = 0

    # --- addresses and units

    def _boards(self, ids: Sequence[int]) -> dict[int, list[int]]:
        """Return the channels of servos by the addresses of their boards."""
        boards: dict[int, list[int]] = defaultdict(list)
        for servo_id in ids:
            address, channel = self._places[servo_id]
            boards[address].append(channel)
        return boards

    # --- detection

    def find(self, setups: Sequence[ServoConfig], log: EventLog) -> tuple[int, ...]:
        """Check that the boards answer and return the pulses of these servos; nothing changes.

        Raises:
            BusLost: the port is lost.
            ServoMissing: a board does not answer, or another chip does.
        """
        self._sent.clear()
        for address in self._boards([setup.id for setup in setups]):
            check_board(self.line, address)
        return read_every_pulse(self, setups)

    # --- setup

    def prepare(self, log: EventLog) -> None:
        """Do nothing: boards are set up, if needed, before their first pulse."""

    def _ensure_set_up(self, address: int) -> bool:
        """Set a board up if it is not, which stops all its pulses; return whether it is set up."""
        now = self._modes(address)
        if now is None:
            return False
        mode1, mode2, prescale = now
        if (mode1, mode2, prescale) == (AWAKE, TOTEM_POLE, self._clock.prescale):
            return True
        if mode1 & SILENT or prescale != self._clock.prescale:
            # From any state: no pulses, sleep, prescaler, then wake.
            mine = [servo_id for servo_id in self._sent if self._places[servo_id][0] == address]
            for servo_id in mine:
                del self._sent[servo_id]
            asleep = self.line.write_confirmed(
                bridge.write(address, ALL_LED + BYTES - 1, bytes((FULL_OFF,))),
                bridge.write(address, MODE1, bytes((SLEEP | AUTO_INCREMENT,))),
                bridge.write(address, PRESCALE, bytes((self._clock.prescale,))),
                bridge.write(address, MODE2, bytes((TOTEM_POLE,))),
                bridge.write(address, MODE1, bytes((AWAKE,))),
            )
            if not asleep:
                return False
            wait_until(self.line.port, self.line.port.now_s() + START_S)
            # Channels that slept with pulses on would resume here; there are none now.
            self.line.write_confirmed(bridge.write(address, MODE1, bytes((RESTART | AWAKE,))))
            return self._modes(address) == (AWAKE, TOTEM_POLE, self._clock.prescale)
        return self.line.write_confirmed(
            bridge.write(address, MODE1, bytes((AWAKE,))),
            bridge.write(address, MODE2, bytes((TOTEM_POLE,))),
        )

    def _modes(self, address: int) -> tuple[int, int, int] | None:
        """Read both modes and the prescaler, twice; None after a failure.

        A board on an external clock has no prescaler, and only a reset of all boards ends that
        (7.3.1).
        """
        questions = [(bridge.read(address, at, 1), 1) for at in (MODE1, MODE2, PRESCALE)]
        found = self.line.ask(questions * 2)
        if found is None:
            return None
        first, second = found[:3], found[3:]
        if first != second:
            self.line.errors["damaged"] += 1
            return None
        mode1, mode2, prescale = (byte[0] for byte in first)
        if mode1 & EXTCLK:
            self._sent.clear()
            self.line.send(bridge.write_all(SOFTWARE_RESET))
        return mode1, mode2, prescale

    # --- status

    def read_status(self, channel: Channel) -> ChannelStatus | None:
        """Read a channel's pulse and its board's mode; None without an answer.

        A board that was reset sleeps and outputs no pulses, with any content of its registers.
        """
        address, nth = self._places[channel.id]
        self._next_look += 1
        with_prescale = self._next_look % PRESCALE_EVERY == 0
        questions = self._questions.get(channel.id)
        if questions is None:
            questions = self._questions[channel.id] = [
                (bridge.read(address, MODE1, 1), 1),
                (bridge.read(address, output_register(nth), BYTES), BYTES),
                (bridge.read(address, PRESCALE, 1), 1),
            ]
        found = self.line.ask(questions if with_prescale else questions[:2])
        if found is None:
            return None
        usual = self._clock.prescale
        prescale = found[2][0] if with_prescale else usual
        if found[0][0] == AWAKE and prescale == usual:
            return ChannelStatus(self._pulse_steps(channel.id, counts_of(found[1]), prescale))
        # The board has lost its setup, or was read badly.
        address, _ = self._places[channel.id]
        now, pulses = self._modes(address), self.read_pulses((channel.id,))
        if now is None or pulses is None:
            return None
        well = now[0] & ~RESTART == AWAKE and now[2] == self._clock.prescale
        if now[0] & EXTCLK:
            return ChannelStatus(0, (NO_CLOCK,))
        asleep = bool(now[0] & SILENT)
        changed = () if well or asleep or not channel.held else ("settings changed",)
        return ChannelStatus(pulses[0], changed)

    def _pulse_steps(self, servo_id: int, counts: int, prescale: int) -> int:
        """Return the pulse of counts: exactly the sent pulse if the counts are those sent."""
        sent = self._sent.get(servo_id)
        if sent is not None and sent[0] == counts and prescale == self._clock.prescale:
            return sent[1]
        return round(counts * self._clock._replace(prescale=prescale).resolution_steps)

    def read_errors(self) -> tuple[str, ...] | None:
        """Check whether the first board answers."""
        mode = self.line.ask([(bridge.read(self.params.address, MODE1, 1), 1)])
        return None if mode is None else ()

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Return the present pulses of channels, read twice; None if the reads differ or fail."""
        first = self._pulses_once(channels)
        second = None if first is None else self._pulses_once(channels)
        if second is not None and first != second:
            self.line.errors["damaged"] += 1
            return None
        return second

    def _pulses_once(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        pulses: dict[int, int] = {}
        for address, own in self._boards(channels).items():
            questions = [(bridge.read(address, at, 1), 1) for at in (MODE1, PRESCALE)]
            modes = self.line.ask(questions)
            if modes is None:
                return None
            mode, prescale = modes[0][0], modes[1][0]
            base = CHANNELS * self.params.addresses.index(address)
            if mode & SILENT:
                pulses.update(dict.fromkeys((base + channel for channel in own), 0))
                continue
            # Each channel in one transfer only if the board auto-increments.
            size = BYTES if mode & AUTO_INCREMENT else 1
            places = [
                output_register(channel) + k for channel in own for k in range(0, BYTES, size)
            ]
            found = self.line.ask([(bridge.read(address, at, size), size) for at in places])
            if found is None:
                return None
            each = BYTES // size
            outputs = [b"".join(found[k : k + each]) for k in range(0, len(found), each)]
            for channel, registers in zip(own, outputs, strict=True):
                servo_id = base + channel
                pulses[servo_id] = self._pulse_steps(servo_id, counts_of(registers), prescale)
        return tuple(pulses[servo_id] for servo_id in channels)

    # --- sending

    def send_limits(self, channels: Sequence[Channel], confirmed: bool) -> bool:
        """Set the ramp limits of channels; return whether their boards are configured."""
        for channel in channels:
            channel.ramp.speed_steps_s = channel.top_speed_steps_s
            channel.ramp.accel_steps_s2 = channel.setup.max_accel_steps_s2 or 0.0
        if not confirmed:
            return True
        return all(
            self._ensure_set_up(address) for address in self._boards([c.id for c in channels])
        )

    def send_goals(self, channels: Sequence[Channel]) -> None:
        """Send the intermediate pulses of channels towards their goals, one transfer per board."""
        counts: dict[int, int] = {}
        for channel in channels:
            servo_id, setup, steps = channel.id, channel.setup, round(channel.ramp.pulse_steps)
            # The intermediate pulse, within the limits of the channel.
            width = counts_within(
                steps, setup.min_steps, setup.max_steps, self._clock.resolution_steps
            )
            counts[servo_id], self._sent[servo_id] = width, (width, steps)
            channel.sent_steps = steps
        self._send(counts)

    def _send(self, counts: Mapping[int, int]) -> None:
        """Send pulses by servo id, with as few writes per board as possible."""
        boards: dict[int, dict[int, bytes]] = defaultdict(dict)
        for servo_id, width in counts.items():
            address, nth = self._places[servo_id]
            boards[address][nth] = pulse_registers(width)
        packet = b"".join(
            [
                bridge.write(
                    address, output_register(run[0]), b"".join([outputs[nth] for nth in run])
                )
                for address, outputs in boards.items()
                for run in adjacent_runs(sorted(outputs))
            ]
        )
        self.line.send(packet)
        self._sent_s = self.line.port.now_s()

    def resend_pulses(self, channels: Sequence[Channel]) -> None:
        """Send the last pulses once more, as a byte lost in a series of them shifts the rest."""
        self._send({c.id: self._sent[c.id][0] for c in channels if c.id in self._sent})

    def advance_pulses(self, channels: Sequence[Channel]) -> None:
        """Advance moving pulses a little if no goals arrive."""
        if self.line.port.now_s() - self._sent_s < FOLLOW_UP_S:
            return
        sent, none = self._sent, (0, 0)
        moving = [c for c in channels if round(c.ramp.pulse_steps) != sent.get(c.id, none)[1]]
        if moving:
            self.send_goals(moving)

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses, each by one register, in any state; on the last try all of a board."""
        packets = []
        for servo_id in channels:
            address, nth = self._places[servo_id]
            self._sent.pop(servo_id, None)
            packets.append(
                bridge.write(address, output_register(nth) + BYTES - 1, bytes((FULL_OFF,)))
            )
        if last_try:
            for address in self._boards(channels):
                packets.append(bridge.write(address, ALL_LED + BYTES - 1, bytes((FULL_OFF,))))
        self.line.send(b"".join(packets))


class Pca9685Bus(HobbyBoardBus):
    """The channels of the boards on one I2C bus; implements gazerig.drivers.types.ServoBus.

    Args:
        port: gazerig.drivers.i2c.port.I2cPort, or a serial or emulated port with a bridge.
        setups: The servos, in the order of all sequences; a servo's id is its channel, and steps
            are quarter microseconds.
        params: Addresses and clock of the boards.
        timing: Times of the bus.

    Raises:
        ValueError: a servo has a channel or a pulse width that the boards do not have.
    """

    def __init__(
        self,
        port: BusPort,
        setups: Sequence[ServoConfig],
        params: Pca9685Params,
        timing: BusTiming = TIMING,
    ) -> None:
        super().__init__(Pca9685Board(port, params, timing), setups)

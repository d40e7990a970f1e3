"""PCA9685 boards as a board of hobby servos: sixteen channels each, led by the driver.

They hold pulses and know nothing of speed: each goal is sent as a place on the way to it, and a
goal that is not followed up stands. What a servo's id is: sixteen times its board, and channel.
"""

from collections import defaultdict
from collections.abc import Sequence

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import BoardTexts, Seen, Timing
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.release import TRIES
from gazerig.drivers.hobby_board.start import every_pulse
from gazerig.drivers.i2c import bridge
from gazerig.drivers.i2c.line import I2cLine
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.pca9685.registers import (
    ALL_LED,
    AUTO_INCREMENT,
    AWAKE,
    BYTES,
    CHANNELS,
    EXTCLK,
    FULL_OFF,
    LED0,
    MODE1,
    MODE2,
    PRESCALE,
    RESTART,
    SLEEP,
    START_S,
    TOTEM_POLE,
    US_STEPS,
    counts_of,
    counts_within,
    output,
    plausible,
    prescale_of,
    pulse,
    runs,
    steps_per_count,
)
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoSetup

LONGEST_LEAD_S = 0.05
"""A pulse on its way goes on for no longer than this after a pause."""

FOLLOW_UP_S = 0.015
"""Pulses on their way are sent by reads where no goals have come for so long."""

PRESCALE_EVERY = 8
"""The prescaler is looked at in every so many looks."""


class Pca9685Board:
    """The boards of one bus; implements gazerig.drivers.hobby_board.board.Board.

    Args:
        port: gazerig.drivers.i2c.port.I2cPort, or a serial or emulated port with a bridge behind
            it.
        params: how to reach them.
    """

    damage = ("damaged", "incomplete")

    def __init__(self, port: BusPort, params: Pca9685Params) -> None:
        self.params = params
        self.line = I2cLine(port, params.baud, params.reply_timeout_ms)
        self.timing = Timing(
            params.baud,
            params.watch_ms / 1000.0,
            params.stagger_ms / 1000.0,
            params.give_up_s,
            LONGEST_LEAD_S,
        )
        named = " and ".join(f"{address:#x}" for address in params.addresses)
        again = "is another program using the board? check SDA, SCL and ground"
        self.texts = BoardTexts(
            name=f"board {named}",
            no_pulses=again,
            other_pulse=again,
            noise="check SDA, SCL and ground, and the length of the cable",
            unheard="check power, SDA, SCL and ground of its board",
            left_alone="the board goes on with its last pulses as long as it has power",
        )
        self._prescale = prescale_of(params.frequency_hz, params.oscillator_hz)
        self._sent: dict[int, tuple[int, int]] = {}
        self._sent_s = 0.0
        self._looks = 0

    # --- places and units

    def check(self, setup: ServoSetup) -> None:
        """Refuse a servo that no channel of the boards can have.

        Raises:
            ValueError: so it is; the message names the servo and what would be right.
        """
        params = self.params
        if not 0 <= setup.id < params.channels:
            raise ValueError(
                f"channel {setup.id}: {len(params.addresses)} PCA9685 have 0..{params.channels - 1}"
            )
        low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
        if not params.min_pulse_us <= low <= high <= params.max_pulse_us:
            raise ValueError(
                f"channel {setup.id}: {low:g}..{high:g} us must ascend within min_pulse_us "
                f"{params.min_pulse_us:g} and max_pulse_us {params.max_pulse_us:g}"
            )

    def _place(self, servo_id: int) -> tuple[int, int]:
        """Return the address of a servo's board, and its channel there."""
        board, channel = divmod(servo_id, CHANNELS)
        return self.params.addresses[board], channel

    def _boards(self, ids: Sequence[int]) -> dict[int, list[int]]:
        """Return the channels of servos by the addresses of their boards."""
        boards: dict[int, list[int]] = defaultdict(list)
        for servo_id in ids:
            address, channel = self._place(servo_id)
            boards[address].append(channel)
        return boards

    def _steps(self, counts: int, prescale: int) -> float:
        return counts * steps_per_count(prescale, self.params.oscillator_hz)

    # --- finding

    def find(self, setups: Sequence[ServoSetup], log: EventLog) -> tuple[int, ...]:
        """See that the boards are there and return the pulses of these servos; nothing changes.

        Raises:
            BusLost: the port is gone.
            ServoMissing: a board does not answer, or another chip does.
        """
        self._sent.clear()
        for address in self._boards([setup.id for setup in setups]):
            self._see_board(address)
        return every_pulse(self, setups)

    def _see_board(self, address: int) -> None:
        """See that what answers at an address is a PCA9685.

        Raises:
            ServoMissing: it is not, or nothing answers.
        """
        where = f"{self.line.port.port_name}: "
        tries = (self._registers(address) for _ in range(TRIES))
        found = next((one for one in tries if one is not None), None)
        if found is None and self.line.why == "bus stuck":
            raise ServoMissing(
                f"{where}the I2C bus is stuck, its data or clock line is held down: switch what "
                "hangs on it off and on, check SDA and SCL for a short"
            )
        if found is None and self.line.why != "not acknowledged":
            raise ServoMissing(
                f"{where}nobody answers as an I2C bus ({self.line.why}): a PCA9685 is reached over "
                "an I2C bus such as /dev/i2c-1: write it under bus.port"
            )
        if found is None:
            raise ServoMissing(
                f"{where}no PCA9685 answers at {address:#x}: has the board its logic supply (VCC, "
                "not V+ alone)? check SDA, SCL and ground; its jumpers make the address"
            )
        first_six, outputs, prescale = found
        if not plausible(first_six, outputs, prescale):
            raise ServoMissing(
                f"{where}what answers at {address:#x} is no PCA9685: another chip has this "
                "address; close a jumper and write the new one under bus.pca9685.address"
            )
        if first_six[MODE1] & EXTCLK:
            raise ServoMissing(
                f"{where}the board at {address:#x} was set to an external clock: switch its logic "
                "supply off and on"
            )

    def answers(self, address: int) -> bool:
        """Return whether something at an address is by its registers a PCA9685."""
        if self.line.ask([(bridge.read(address, MODE1, 1), 1)]) is None:
            return False
        found = self._registers(address)
        return found is not None and plausible(*found)

    def _registers(self, address: int) -> tuple[bytes, bytes, int] | None:
        """Read all registers of a board one by one, which needs no setting of it."""
        single = [*range(LED0), *range(LED0, LED0 + CHANNELS * BYTES), PRESCALE]
        found = self.line.ask([(bridge.read(address, register, 1), 1) for register in single])
        if found is None:
            return None
        flat = b"".join(found)
        return flat[:LED0], flat[LED0:-1], flat[-1]

    # --- setting up

    def prepare(self, log: EventLog) -> None:
        """Prepare nothing: boards are set up where they need it, before their first pulse."""

    def _ready(self, address: int) -> bool:
        """See that a board is set up, and set it up where it is not; all its pulses end then."""
        now = self._modes(address)
        if now is None:
            return False
        mode1, mode2, prescale = now
        if (mode1, mode2, prescale) == (AWAKE, TOTEM_POLE, self._prescale):
            return True
        if mode1 & (SLEEP | RESTART) or prescale != self._prescale:
            return self._set_up(address)
        return self.line.tell(
            bridge.write(address, MODE1, bytes((AWAKE,))),
            bridge.write(address, MODE2, bytes((TOTEM_POLE,))),
        )

    def _modes(self, address: int) -> tuple[int, int, int] | None:
        """Read both modes and the prescaler, twice; None where that did not succeed."""
        questions = [(bridge.read(address, at, 1), 1) for at in (MODE1, MODE2, PRESCALE)]
        found = self.line.ask(questions * 2)
        if found is None:
            return None
        first, second = found[:3], found[3:]
        if first != second:
            self.line.errors["damaged"] += 1
            return None
        mode1, mode2, prescale = (byte[0] for byte in first)
        return mode1, mode2, prescale

    def _set_up(self, address: int) -> bool:
        """Set a board up from any state: no pulses, asleep, the prescaler, then awake."""
        self._forget(address)
        asleep = self.line.tell(
            bridge.write(address, ALL_LED + BYTES - 1, bytes((FULL_OFF,))),
            bridge.write(address, MODE1, bytes((SLEEP | AUTO_INCREMENT,))),
            bridge.write(address, PRESCALE, bytes((self._prescale,))),
            bridge.write(address, MODE2, bytes((TOTEM_POLE,))),
            bridge.write(address, MODE1, bytes((AWAKE,))),
        )
        if not asleep:
            return False
        self.line.wait(self.line.port.now_s() + START_S)
        # What slept with pulses on holds them back until this; there are none now.
        self.line.tell(bridge.write(address, MODE1, bytes((RESTART | AWAKE,))))
        return self._modes(address) == (AWAKE, TOTEM_POLE, self._prescale)

    def _forget(self, address: int) -> None:
        """Forget what was sent to a board."""
        mine = [servo_id for servo_id in self._sent if self._place(servo_id)[0] == address]
        for servo_id in mine:
            del self._sent[servo_id]

    # --- looking

    def look(self, channel: Channel) -> Seen | None:
        """Ask for a channel's pulse and its board's mode; None where no answer came.

        A board that was reset sleeps: then it gives no pulses, whatever else is there.
        """
        address, nth = self._place(channel.id)
        self._looks += 1
        with_prescale = self._looks % PRESCALE_EVERY == 0
        questions = [
            (bridge.read(address, MODE1, 1), 1),
            (bridge.read(address, output(nth), BYTES), BYTES),
        ]
        if with_prescale:
            questions.append((bridge.read(address, PRESCALE, 1), 1))
        found = self.line.ask(questions)
        if found is None:
            return None
        prescale = found[2][0] if with_prescale else self._prescale
        if found[0][0] == AWAKE and prescale == self._prescale:
            return Seen(self._told(channel.id, counts_of(found[1]), prescale))
        return self._look_closer(channel)

    def _look_closer(self, channel: Channel) -> Seen | None:
        """Look again at a board that is not as it was set up, or was not heard well."""
        address, _ = self._place(channel.id)
        now, pulses = self._modes(address), self.pulses((channel.id,))
        if now is None or pulses is None:
            return None
        well = now[0] & ~RESTART == AWAKE and now[2] == self._prescale
        asleep = bool(now[0] & (SLEEP | RESTART))
        changed = () if well or asleep or not channel.held else ("settings changed",)
        return Seen(pulses[0], changed)

    def _told(self, servo_id: int, counts: int, prescale: int) -> int:
        """Return the pulse that counts make: as it was sent, where they are what was sent."""
        sent = self._sent.get(servo_id)
        if sent is not None and sent[0] == counts and prescale == self._prescale:
            return sent[1]
        return round(self._steps(counts, prescale))

    def wake(self) -> tuple[str, ...] | None:
        """Ask the first board whether it is there."""
        mode = self.line.ask([(bridge.read(self.params.address, MODE1, 1), 1)])
        return None if mode is None else ()

    def pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Return what channels give now, asked twice; None where both differ or do not come."""
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
            if mode & (SLEEP | RESTART):
                pulses.update(dict.fromkeys((base + channel for channel in own), 0))
                continue
            outputs = self._outputs(address, own, bool(mode & AUTO_INCREMENT))
            if outputs is None:
                return None
            for channel, registers in zip(own, outputs, strict=True):
                servo_id = base + channel
                pulses[servo_id] = self._told(servo_id, counts_of(registers), prescale)
        return tuple(pulses[servo_id] for servo_id in channels)

    def _outputs(self, address: int, channels: Sequence[int], runs_on: bool) -> list[bytes] | None:
        """Read the registers of channels: each at once where the board counts on by itself."""
        if runs_on:
            whole = [(bridge.read(address, output(channel), BYTES), BYTES) for channel in channels]
            return self.line.ask(whole)
        single = [
            (bridge.read(address, output(channel) + k, 1), 1)
            for channel in channels
            for k in range(BYTES)
        ]
        found = self.line.ask(single)
        if found is None:
            return None
        return [b"".join(found[k : k + BYTES]) for k in range(0, len(found), BYTES)]

    # --- sending

    def send_limits(self, channels: Sequence[Channel], confirmed: bool) -> bool:
        """Take over what limits the speed of channels, and see that their boards are set up."""
        for channel in channels:
            channel.ramp.speed_steps_s = channel.top_speed_steps_s
            channel.ramp.accel_steps_s2 = channel.setup.max_accel_steps_s2 or 0.0
        if not confirmed:
            return True
        return all(self._ready(address) for address in self._boards([c.id for c in channels]))

    def send_goals(self, channels: Sequence[Channel]) -> None:
        """Send channels to where they are on the way to their goals, those of a board at once."""
        boards: dict[int, dict[int, bytes]] = defaultdict(dict)
        for channel in channels:
            self._sent[channel.id] = self._due(channel)
            address, nth = self._place(channel.id)
            boards[address][nth] = pulse(self._sent[channel.id][0])
        packet = b"".join(
            bridge.write(address, output(run[0]), b"".join(outputs[nth] for nth in run))
            for address, outputs in boards.items()
            for run in runs(sorted(outputs))
        )
        self.line.send(packet)
        self._sent_s = self.line.port.now_s()

    def _due(self, channel: Channel) -> tuple[int, int]:
        """Return where a channel is on its way: in counts inside its limits, and in steps."""
        steps, setup = round(channel.ramp.pulse_steps), channel.setup
        grain = self._steps(1, self._prescale)
        return counts_within(steps, setup.min_steps, setup.max_steps, grain), steps

    def lead(self, channels: Sequence[Channel]) -> None:
        """Send pulses that are on their way a little farther, where no goals come."""
        if self.line.port.now_s() - self._sent_s < FOLLOW_UP_S:
            return
        moving = [
            c for c in channels if round(c.ramp.pulse_steps) != self._sent.get(c.id, (0, 0))[1]
        ]
        if moving:
            self.send_goals(moving)

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses, each by one register, whatever is set; on the last try all of a board."""
        packets = []
        for servo_id in channels:
            address, nth = self._place(servo_id)
            self._sent.pop(servo_id, None)
            packets.append(bridge.write(address, output(nth) + BYTES - 1, bytes((FULL_OFF,))))
        if last_try:
            for address in self._boards(channels):
                packets.append(bridge.write(address, ALL_LED + BYTES - 1, bytes((FULL_OFF,))))
        self.line.send(b"".join(packets))

    def wait(self, until_s: float) -> None:
        """Let time pass."""
        self.line.wait(until_s)

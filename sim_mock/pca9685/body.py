"""Emulated PCA9685 boards with a hobby servo on each channel, and the I2C bus they are on.

Time passes in whole steps of 10 ms; a servo gets a new pulse once a period of its board.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from operator import and_

from gazerig.sim_mock.faults.grammar import SWITCH, TIME, Argument, CommandTable, Verb, count
from gazerig.sim_mock.faults.hobby import channel_word, hobby_verbs
from gazerig.sim_mock.faults.verbs import counted_command, switch_command
from gazerig.sim_mock.hobby_servo import HobbyServo
from gazerig.sim_mock.pca9685.chip import CHANNELS, Chip

CASES = {"oscillator-mhz": "MHZ"}

# fmt: off
OWN: dict[str, Verb] = {
    "nack": Verb(counted_command("nack", "transfers are not acknowledged"), (Argument("N", count, True),),
                 "the next N transfers are not acknowledged", TIME),
    "stuck": Verb(switch_command("stuck", "the bus is stuck"), (SWITCH,),
                  "the data line is held low: no transfer is possible", TIME),
    "absent": Verb(switch_command("absent", "the boards are off the bus"), (SWITCH,),
                   "the boards are off the bus, pulses continue", TIME),
    "foreign": Verb(switch_command("foreign", "another chip answers"), (SWITCH,),
                    "chips of another kind answer", TIME),
}
# fmt: on

COMMANDS = CommandTable(
    hobby_verbs(channel_word(255), "transfers that only write", OWN), CASES, "a channel"
)


STEPS_S = 100
US_STEPS = 4
GENERAL_CALL, SOFTWARE_RESET = 0x00, b"\x06"
STRANGE = 0xA5
"""Answer of a chip of another kind to every read."""


class NotAcknowledged(Exception):
    """No device has acknowledged an address or a byte."""


class BusStuck(Exception):
    """The lines stay low, and the adapter times out."""


def _wired_and(*bytes_at_once: int) -> int:
    return reduce(and_, bytes_at_once)


class Pca9685Body:
    """The bus with its boards and servos.

    Args:
        chips: chips by their addresses.
        servos: sixteen servos per board, in the order of the boards.

    servo_power: whether the servos have their supply
    stuck: whether a device holds the data line low
    absent: whether the boards are missing; foreign: whether chips of another kind replace them
    """

    def __init__(
        self, chips: Mapping[int, Chip], servos: Sequence[HobbyServo], now_s: Callable[[], float]
    ) -> None:
        self.now_s = now_s
        self.chips = dict(chips)
        self.servos = tuple(servos)
        self.servo_power = True
        self.stuck = self.absent = self.foreign = False
        self._outputs = [
            (chip, channel) for chip in self.chips.values() for channel in range(CHANNELS)
        ]
        self._step = self._step_number(now_s())

    # --- transfers

    def write(self, address: int, data: bytes) -> None:
        """Write up to a stop condition.

        Raises:
            NotAcknowledged: no device has this address.
            BusStuck: the lines stay low.
        """
        self.advance()
        if self.stuck:
            raise BusStuck
        if self.foreign:
            self._chips_at(address)
            return
        if address == GENERAL_CALL and data == SOFTWARE_RESET:
            for chip in self.chips.values():
                chip.reset()
            return
        for chip in self._chips_at(address):
            chip.write(data, self.now_s())
        self._end_past_pulses()

    def _chips_at(self, address: int) -> list[Chip]:
        """Return the chips that answer at an address."""
        chips = [c for own, c in self.chips.items() if address in (own, *c.further_addresses)]
        if self.absent or not chips:
            raise NotAcknowledged
        return chips

    def read(self, address: int, length: int) -> bytes:
        """Read up to a stop condition.

        Raises:
            NotAcknowledged: no device has this address.
            BusStuck: the lines stay low.
        """
        self.advance()
        if self.stuck:
            raise BusStuck
        chips = self._chips_at(address)
        if self.foreign:
            return bytes([STRANGE] * length)
        # If several chips answer simultaneously, a 0 of any chip pulls the line down.
        return bytes(map(_wired_and, *(chip.read(length) for chip in chips)))

    def restart(self) -> None:
        """Restart all boards as after a dip of their supply."""
        self.advance()
        for chip in self.chips.values():
            chip.reset()
        self._end_past_pulses()

    # --- time

    @staticmethod
    def _step_number(now_s: float) -> int:
        # The margin keeps 0.03 s from being two steps.
        return int(now_s * STEPS_S + 1e-3)

    def width_steps(self, place: int, now_s: float) -> int:
        """Return the true pulses of a channel, quarter microseconds; 0: none."""
        chip, channel = self._outputs[place]
        return round(chip.width_s(channel, now_s) * 1e6 * US_STEPS)

    def advance(self) -> None:
        """Advance to the present time."""
        until = self._step_number(self.now_s())
        while self._step < until:
            now_s = self.now_s()
            if all(
                servo.is_resting and servo.width_steps == self._pulse_steps(place, now_s)
                for place, servo in enumerate(self.servos)
            ):
                self._step = until
                return
            self._step += 1
            self._run_step(self._step)

    def _end_past_pulses(self) -> None:
        """End pulses that have ended immediately: a servo gets none from then on."""
        now_s = self.now_s()
        for place, servo in enumerate(self.servos):
            if servo.width_steps and not self._pulse_steps(place, now_s):
                servo.width_steps = 0

    def _pulse_steps(self, place: int, now_s: float) -> int:
        return self.width_steps(place, now_s) if self.servo_power else 0

    def _run_step(self, step: int) -> None:
        now_s = step / STEPS_S
        for place, servo in enumerate(self.servos):
            period_s = self._outputs[place][0].period_s
            if int(now_s / period_s) != int((now_s - 1.0 / STEPS_S) / period_s):
                servo.width_steps = self._pulse_steps(place, now_s)
            servo.step()

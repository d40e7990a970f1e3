"""A Pololu Maestro as a board of hobby servos: it ramps its pulses to their goals itself.

Its own serial timeout, set with Pololu's program, helps if the cable or the computer fails.
"""

from collections.abc import Sequence
from math import inf

from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import ChannelStatus
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.supervisor import read_every_pulse
from gazerig.drivers.maestro.commands import (
    ACCEL_STEPS_S2,
    ERRORS,
    GET_ERRORS,
    GET_POSITION,
    MOST_INPUT,
    SET_ACCELERATION,
    SET_SPEED,
    SPEED_STEPS_S,
    accel_units,
    name_errors,
    speed_units,
)
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig


class MaestroBoard(MaestroLink):
    """One board; implements gazerig.drivers.hobby_board.board.Board."""

    name = "the board"
    remedy = "set its channel to Servo and widen its range in Pololu's program, without a script"
    longest_ramp_s = inf

    def __init__(self, port: BusPort, params: MaestroParams, timing: BusTiming = TIMING) -> None:
        super().__init__(port, params, timing)
        self.params, self.timing = params, timing
        self._errors_first = False

    def find(self, setups: Sequence[ServoConfig], log: EventLog) -> tuple[int, ...]:
        """Find the board and return the pulses of these servos; nothing moves.

        Raises:
            BusLost: the port is lost.
            ServoMissing: it does not answer, or a channel is not a servo channel.
        """
        where = self.port.port_name
        register = self.read_errors()
        if register is None:
            remedy = (
                "take the first of its two USB ports and set it to 'USB Dual Port' in Pololu's "
                f"program; its CRC must be {'on' if self.params.crc else 'off'}"
            )
            fault = f"{where}: no Maestro answers"
            raise ServoMissing(self.lateness.blame(fault, remedy, self.port.now_s()))
        if not self.expects_crc():
            raise ServoMissing(
                f"{where}: the board expects no CRC: switch Enable CRC on in Pololu's program, as "
                "noise moves servos without it, or set crc to false"
            )
        if register:
            named = ", ".join(name_errors(register))
            log.add(f"the board had earlier errors, cleared now: {named}")
        pulses = read_every_pulse(self, setups)
        for setup, pulse in zip(setups, pulses, strict=True):
            if 0 < pulse <= MOST_INPUT:
                raise ServoMissing(
                    f"{where}: channel {setup.id} is an input, {setup.label('channel')} cannot "
                    "move: set it to Servo in Pololu's program"
                )
        return pulses

    def prepare(self, log: EventLog) -> None:
        """Stop the board's own script if one runs, as it would also move servos."""
        if self.is_script_running():
            self.stop_script()
            log.add("the board was running its own script: stopped")

    def read_status(self, channel: Channel) -> ChannelStatus | None:
        """Read one channel's pulse and the error register; None without an answer."""
        codec = self.codec
        position, errors = codec.command(GET_POSITION, channel.id), codec.command(GET_ERRORS)
        # The order alternates: on a line that repeats its last answer a pulse width takes the place
        # of the register, which is detected.
        self._errors_first = not self._errors_first
        found = self.ask_words(errors + position if self._errors_first else position + errors, 2)
        if found is None:
            return None
        pulse, register = found[::-1] if self._errors_first else found
        if register >> len(ERRORS):
            # Such errors do not exist: it is a pulse width instead of the register, or noise.
            self.errors["damaged"] += 1
            return None
        return ChannelStatus(pulse, name_errors(register))

    def send_limits(self, channels: Sequence[Channel]) -> bool:
        """Arm speed and acceleration; return whether the board has found no error.

        On an error it may have stopped all pulses, so no command that moves a servo may follow.
        """
        packet, codec = b"", self.codec
        for channel in channels:
            speed = speed_units(channel.top_speed_steps_s)
            accel = accel_units(channel.setup.max_accel_steps_s2)
            channel.ramp.speed_steps_s = speed * SPEED_STEPS_S
            channel.ramp.accel_steps_s2 = accel * ACCEL_STEPS_S2
            packet += codec.number(SET_SPEED, channel.id, speed)
            packet += codec.number(SET_ACCELERATION, channel.id, accel)
        found = self.ask_words(packet + codec.command(GET_ERRORS), 1)
        return found is not None and not found[0]

    def send_goals(self, channels: Sequence[Channel]) -> None:
        """Send the goals of channels."""
        self.send(self.codec.targets({one.id: one.goal_steps for one in channels}))


class MaestroBus(HobbyBoardBus):
    """The channels of one Maestro; see HobbyBoardBus for its arguments."""

    board_class = MaestroBoard

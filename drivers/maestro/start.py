"""Finding a board and taking hold of its channels, with every trouble named for a person."""

from collections.abc import Sequence
from math import inf

from drivers.bus_journal import Journal, call
from drivers.errors import ServoMissing
from drivers.maestro.channel import Channel
from drivers.maestro.commands import MOST_INPUT, name_errors
from drivers.maestro.hold import Outcome, refusal, take
from drivers.maestro.line import Line
from drivers.maestro.params import MaestroParams
from drivers.maestro.release import TRIES


def find(line: Line, channels: Sequence[Channel], params: MaestroParams, journal: Journal) -> None:
    """Greet the board and look at every channel; nothing moves.

    Raises:
        drivers.errors.BusLost: the port is gone.
        drivers.errors.ServoMissing: it does not answer, or a channel is no servo's.
    """
    where = line.port.port_name
    register = line.greet()
    if register is None:
        raise ServoMissing(f"{where}: no Maestro answers: {_mute_causes(params)}")
    if not line.takes_crc():
        raise ServoMissing(
            f"{where}: the board wants no CRC: switch Enable CRC on in Pololu's program, as noise "
            "moves servos without it, or set crc to false"
        )
    if register:
        named = ", ".join(name_errors(register))
        journal.say(f"the board held errors from before, cleared now: {named}")
    for channel, pulse in zip(channels, _pulses(line, channels, params), strict=True):
        if 0 < pulse <= MOST_INPUT:
            raise ServoMissing(
                f"{where}: channel {channel.id} is an input, {call(channel.setup)} cannot "
                "move: set it to Servo in Pololu's program"
            )
        channel.settle(pulse)


def _mute_causes(params: MaestroParams) -> str:
    """Say what keeps a board from answering."""
    number = f", its device number {params.device}" if params.protocol == "pololu" else ""
    check_byte = "on" if params.crc else "off"
    return (
        "on USB take the first of its two ports and set it to 'USB Dual Port' in Pololu's "
        f"program; on its serial pins check TX, RX, ground and {params.baud} bit/s{number}; "
        f"its CRC must be {check_byte}"
    )


def _pulses(line: Line, channels: Sequence[Channel], params: MaestroParams) -> tuple[int, ...]:
    """Ask for every pulse.

    Raises:
        drivers.errors.ServoMissing: a channel does not answer.
    """
    ids = tuple(channel.id for channel in channels)
    for _ in range(TRIES):
        pulses = line.pulses(ids)
        if pulses is not None:
            return pulses
    where = line.port.port_name
    for channel in channels:
        if line.pulses((channel.id,)) is None:
            raise ServoMissing(
                f"{where}: no answer about {call(channel.setup)}: has the board "
                f"{params.channels} channels?"
            )
    raise ServoMissing(f"{where}: answers get lost: check cable and baud rate")


def take_on(
    line: Line, channels: Sequence[Channel], params: MaestroParams, journal: Journal
) -> None:
    """Take hold of every channel, those without pulses one after another.

    Raises:
        drivers.errors.BusLost: the port is gone.
        drivers.errors.ServoMissing: the board does not answer, or a channel does not take
            its goal.
    """
    _stop_script(line, journal)
    pulses = _pulses(line, channels, params)
    for channel, pulse in zip(channels, pulses, strict=True):
        channel.found(pulse)
    limp = [call(channel.setup) for channel in channels if not channel.on]
    if limp:
        journal.say(f"{', '.join(limp)} had no pulses: they go to their places at once")
    start_s = -inf
    for channel, pulse in zip(channels, pulses, strict=True):
        if not pulse:
            line.wait(start_s + params.stagger_ms / 1000.0)
            start_s = line.port.now_s()
        _insist(line, channel, pulse)


def _stop_script(line: Line, journal: Journal) -> None:
    """Stop the board's own script where one runs: it would move servos against us."""
    if line.ask(line.speech.script_status(), 1) == b"\0":
        line.send(line.speech.stop_script())
        journal.say("the board ran a script of its own: stopped")


def _insist(line: Line, channel: Channel, pulse: int) -> None:
    """Take hold of one channel.

    Raises:
        drivers.errors.ServoMissing: it does not take its goal.
    """
    for _ in range(TRIES):
        outcome = take(line, channel, pulse)
        if outcome is Outcome.HELD:
            return
        if outcome is Outcome.ELSEWHERE and channel.on:
            break
    where = line.port.port_name
    if outcome is Outcome.MUTE:
        raise ServoMissing(f"{where}: no answer about {call(channel.setup)}: check its cable")
    raise ServoMissing(f"{where}: {refusal(channel)}")

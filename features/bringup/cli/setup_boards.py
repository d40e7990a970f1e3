"""Which servo hangs on which channel of a board: each is moved a little, and a person says."""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from math import radians
from pathlib import Path

import typer

from gazerig.config.faults import ConfigError
from gazerig.config.save import save_rig
from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.files.file_output import write_file
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.maestro.board import MaestroBoard
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.maestro.probe import USB_CHANNELS
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.pca9685.registers import CHANNELS, COUNTS, PulseClock
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.serial.port_owner import POLOLU
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import FINE_STEPS, ChannelPosition, given, walk
from gazerig.features.bringup.cli import ports as bench
from gazerig.features.bringup.maestro_settings import clipped, instructions, settings_file
from gazerig.robot.cli.terminal import say, signals
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams

WIGGLE_DEG = 5.0

Explain = Callable[[ServoConfig, ChannelPosition], str]
"""Says why a board's pulse is not where it was sent, and the cure."""


def try_channels(
    board: Board,
    setups: Sequence[ServoConfig],
    joints: Mapping[str, JointParams],
    yes: bool,
    explain: Explain,
) -> list[str]:
    """Move one channel after the other; return the joints that were skipped.

    Raises:
        ServoMissing: the board does not answer, and no user is asked (``yes``).
        ServoFault: pulses could not be stopped.
        BusLost: the port is gone.
    """
    say(
        "Now each channel moves its servo a little. Keep fingers away: as a servo's pulses begin "
        "it goes to its rest place at once, wherever it is."
    )
    left = []
    for n, setup in enumerate(setups, 1):
        say(f"{n} of {len(setups)}: {servo_label(setup)}")
        if not _channel(board, setup, joints[setup.name], yes, explain):
            left.append(setup.name)
    return left


def walked(
    board: Board, setup: ServoConfig, places: Sequence[int], *speed_steps_s: float
) -> tuple[ChannelPosition, ...]:
    """Lead a channel over places; a request to end is obeyed with pulses off.

    Raises:
        KeyboardInterrupt: the user asked for the end.
    """
    clock = RealClock()
    with signals() as stopped:
        stopped.never_raise()

        def sleep_until(t_s: float) -> None:
            stopped.refuse()
            clock.sleep_until(t_s)

        return walk(board, setup, places, sleep_until, *speed_steps_s)


def rest_steps(setup: ServoConfig) -> int:
    """Return the pulse at which a joint rests, within its range."""
    middle = (setup.min_steps + setup.max_steps) // 2
    rest = middle if setup.rest_steps is None else setup.rest_steps
    return min(max(rest, setup.min_steps), setup.max_steps)


def _channel(
    board: Board, setup: ServoConfig, joint: JointParams, yes: bool, explain: Explain
) -> bool:
    """Move one channel's servo until the person knows it, or skips it."""
    rest, low, high = wiggle(setup, joint)
    while True:
        at = f"it goes to {rest / US_STEPS:g} us at once, then {WIGGLE_DEG:g} deg to and fro"
        if not yes and not typer.confirm(f"   move it? {at}", default=False, err=True):
            return False
        try:
            gone = walked(board, setup, (rest, low, high, rest))
        except ServoFault:
            raise
        except DriverError as error:
            if yes:
                raise
            say(f"   {error}")
            continue
        for one in gone:
            if abs(one.asked - one.got) > FINE_STEPS:
                say(f"   {explain(setup, one)}")
                break
        name = setup.name.replace("_", " ")
        if yes or typer.confirm(f"   did the {name} move, and nothing else?", err=True):
            return True
        say(
            f"   then plug its servo into channel {setup.id}, or write the channel that it is on "
            f"as joints.{setup.name}.id; n at the next question skips it"
        )


def wiggle(setup: ServoConfig, joint: JointParams) -> tuple[int, int, int]:
    """Return the rest place and two places about it, in steps, all within the joint's range."""
    made, rest = joint.made(), rest_steps(setup)
    angle = made.angle_rad(rest)
    least, most = radians(joint.min_deg), radians(joint.max_deg)
    ends = (max(least, angle - radians(WIGGLE_DEG)), min(most, angle + radians(WIGGLE_DEG)))
    low, high = (min(max(round(made.steps(end)), setup.min_steps), setup.max_steps) for end in ends)
    return rest, low, high


QUICK_STEPS_S = 90.0 / 360.0 * 16_000.0
"""Speed of a range that is tried out without servo supply, should that be on after all."""


def set_up_board(
    line: BusPort,
    params: MaestroParams,
    setups: Sequence[ServoConfig],
    joints: Mapping[str, JointParams],
    yes: bool,
) -> list[str]:
    """Go through a board's settings and channels; return the joints that were skipped.

    Raises:
        PortError: the port cannot be opened, or no board answers.
        ServoFault: pulses could not be stopped.
        BusLost: the port is gone.
    """
    for text in instructions(params, setups, on_usb(line.port_name)):
        say(f"   {text}")
    if not yes:
        typer.prompt(
            "   Enter: it is set, and Pololu's program is closed; Ctrl-C: end ",
            default="", show_default=False, prompt_suffix="", err=True,
        )  # fmt: skip
    _refuse_size(setups, bench.usb_id(line.port_name), line.port_name)
    line.setBaudRate(params.baud)
    board, log = MaestroBoard(line, params), EventLog()
    board.find((), log)
    board.prepare(log)
    for event in log.drain():
        say(f"   {event}")
    _ranges(board, setups, yes)
    return try_channels(board, setups, joints, yes, _explain)


def _explain(setup: ServoConfig, place: ChannelPosition) -> str:
    return clipped(setup, place.asked, place.got)


def write_settings(
    file: Path, params: MaestroParams, setups: Sequence[ServoConfig], port: str
) -> None:
    """Write what to set on a board as a file of Pololu's programs, and say how it is loaded.

    Raises:
        SetupError: the file cannot be written.
    """
    write_file(file, settings_file(params, setups, on_usb(port)), force=True)
    say(f"   all that is to be set is in {file}: in Pololu's Maestro Control Center File, Open")
    say(f"   settings file, then Apply Settings; or without it: UscCmd --configure {file}")


def _refuse_size(setups: Sequence[ServoConfig], usb: str, where: str) -> None:
    """See that a board whose size its USB product tells has all the channels."""
    size = USB_CHANNELS.get(usb)
    beyond = [servo_label(setup) for setup in setups if size is not None and setup.id >= size]
    if beyond:
        raise ServoMissing(
            f"{where}: this board has channels 0..{(size or 0) - 1}, not those of "
            f"{', '.join(beyond)}: correct their ids in the YAML"
        )


def on_usb(path: str) -> bool:
    """Return whether a port is a board's own on USB, and not one of adaptor and serial pins."""
    usb = bench.usb_id(path)
    if usb:
        return usb.startswith(POLOLU)
    return not os.path.realpath(path).startswith(("/dev/ttyS", "/dev/ttyAMA"))


# --- ranges


def _ranges(board: MaestroBoard, setups: Sequence[ServoConfig], yes: bool) -> None:
    """Try out every channel's range, where the person says that nothing can move."""
    if yes:
        say("   the channels' ranges are not tried out: --yes cannot know that the supply is off")
        return
    question = (
        "   Switch the SERVO SUPPLY OFF (the board lives on USB) to try the channels' ranges "
        "out. Is it off?"
    )
    if not typer.confirm(question, default=False, err=True):
        say("   the channels' ranges are not tried out")
        return
    cut = [text for setup in setups for text in _range(board, setup)]
    for text in cut:
        say(f"   {text}")
    if not cut:
        say(f"   all {len(setups)} channels reach both ends of their joints' ranges")
    typer.prompt(
        "   Enter: the servo supply is on again; Ctrl-C: end ",
        default="", show_default=False, prompt_suffix="", err=True,
    )  # fmt: skip


def _range(board: MaestroBoard, setup: ServoConfig) -> list[str]:
    """Lead a channel from end to end of its joint's range; return what cuts it."""
    places = (rest_steps(setup), setup.min_steps, setup.max_steps, rest_steps(setup))
    gone = walked(board, setup, places, QUICK_STEPS_S)
    wrong = [one for one in gone if abs(one.asked - one.got) > FINE_STEPS]
    return list(dict.fromkeys(_explain(setup, one) for one in wrong))


def set_up_boards(
    line: BusPort,
    params: Pca9685Params,
    setups: Sequence[ServoConfig],
    joints: Mapping[str, JointParams],
    every: Sequence[ServoConfig],
    rig: str,
    key: str,
    yes: bool,
) -> list[str]:
    """Go through the boards of one bus and their channels; return the joints that were skipped.

    Args:
        line: its port.
        params: how to reach them.
        setups: the servos to try.
        joints: theirs.
        every: all servos of the bus.
        rig: name or file, into which measured clocks are written.
        key: of the section of the boards in it, "bus.pca9685".
        yes: nothing is asked.

    Raises:
        PortError: the port cannot be opened.
        ServoMissing: a board does not answer.
        ServoFault: pulses could not be stopped.
        BusLost: the port is gone.
    """
    line.setBaudRate(params.baud)
    for address in params.addresses:
        closed = [f"A{bit}" for bit in range(6) if address >> bit & 1]
        say(f"   board {address:#x}: jumpers {', '.join(closed) or 'none'} closed")
    for one in setups:
        board, channel = divmod(one.id, CHANNELS)
        say(f"   {one.name}: channel {channel} of board {params.addresses[board]:#x}")
    if yes:
        say("   the boards' clocks are not measured: --yes has no meter")
    else:
        params = _measured(line, params, frozenset(one.id for one in every), rig, key)
    return try_channels(Pca9685Board(line, params), setups, joints, yes, _explain_pca9685)


def _explain_pca9685(setup: ServoConfig, place: ChannelPosition) -> str:
    sent, got = f"{place.asked / US_STEPS:g} us", f"{place.got / US_STEPS:g} us"
    return (
        f"{servo_label(setup)} is sent to {sent} and gets {got}: is another program using the "
        "board? gazerig doctor looks at it"
    )


# --- the clock


def _measured(
    line: BusPort, params: Pca9685Params, used: frozenset[int], rig: str, key: str
) -> Pca9685Params:
    """Let the user measure every board's clock; return the params with the measured values."""
    say(
        "   A board's clock is up to 8 % off, and so are all its pulses: 4 deg of a servo at 3 %. "
        "With a meter that shows Hz, an oscilloscope or a logic analyser it is known for good."
    )
    found = [clock.oscillator_hz for clock in params.clocks.values()]
    for n, address in enumerate(params.addresses):
        channel = free_channel(params, address, used)
        if channel is None:
            say(f"   board {address:#x}: all channels have joints, none is free to be measured")
            continue
        with given(Pca9685Board(line, params), free_pulse(channel)):
            found[n] = _asked(params, address, channel % CHANNELS, found[n])
    changed = replace(params, oscillator_hz=found[0], further_oscillators_hz=tuple(found[1:]))
    if changed.clocks == params.clocks:
        return params
    _write(changed, rig, key)
    return changed


def _asked(params: Pca9685Params, address: int, channel: int, known_hz: float) -> float:
    """Ask for the meter's reading until it is plausible; Enter keeps the known value."""
    question = (
        f"   board {address:#x}: channel {channel}, where no joint is, gives 1500 us at "
        f"{params.frequency_hz:g} Hz. What is measured at its signal pin, in Hz or us? "
        "Enter: skip "
    )
    while True:
        typed = typer.prompt(question, default="", show_default=False, prompt_suffix="", err=True)
        if not typed:
            return known_hz
        try:
            hz = oscillator_hz(params.clocks[address], typed)
        except ValueError as error:
            say(f"   {error}")
            continue
        off = 100.0 * (known_hz / hz - 1.0)
        say(
            f"   its clock has {hz / 1e6:g} MHz: pulses were {abs(off):.1f} % too "
            f"{'long' if off > 0 else 'short'}"
        )
        return hz


def _write(params: Pca9685Params, rig: str, key: str) -> None:
    """Write the clocks into the rig's file after a yes; say them where that cannot be."""
    wanted: dict[str, float | tuple[float, ...]] = {f"{key}.oscillator_hz": params.oscillator_hz}
    if params.further_oscillators_hz:
        wanted[f"{key}.further_oscillators_hz"] = params.further_oscillators_hz
    named = ", ".join(f"{name}: {value}" for name, value in wanted.items())
    if not typer.confirm(f"   write {named} into {rig}?", default=True, err=True):
        return
    try:
        saved = save_rig(rig, wanted, datetime.now())
    except ConfigError as error:
        say(f"   not written: {error}")
        say(f"   write it yourself: {named}")
        return
    say(f"   written into {saved.path}; as it was: {saved.backup}")


PULSE_STEPS = 1500 * US_STEPS
LOW_HZ, HIGH_HZ = 22e6, 28e6
"""No board has been seen outside; bounds of oscillator_hz, too."""

_MEASURED = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(hz|us)\s*", re.IGNORECASE)


def free_channel(params: Pca9685Params, address: int, used: frozenset[int]) -> int | None:
    """Return the last id of a board on which there is no joint, None where all have one."""
    first = CHANNELS * params.addresses.index(address)
    free = [one for one in range(first, first + CHANNELS) if one not in used]
    return free[-1] if free else None


def free_pulse(channel: int) -> ServoConfig:
    """Return the setup of a channel that gives 1500 us, with no servo on it."""
    return ServoConfig(
        channel, "hobby", PULSE_STEPS, PULSE_STEPS, 1.0, "no joint", rest_steps=PULSE_STEPS
    )


def oscillator_hz(clock: PulseClock, typed: str) -> float:
    """Return the frequency of an oscillator, whole kilohertz.

    Args:
        clock: what it was taken for while the pulses of 1500 us were measured.
        typed: "50.9 Hz" or "1473 us", as the meter shows.

    Raises:
        ValueError: these are no such words, or no PCA9685 could give that.
    """
    found = _MEASURED.fullmatch(typed)
    if found is None:
        raise ValueError(f"{typed!r}: type the frequency or the pulse, such as 50.9 Hz or 1473 us")
    value, unit = float(found[1]), found[2].lower()
    periods = clock.prescale + 1
    if unit == "hz":
        hz = value * COUNTS * periods
    else:
        counts = round(PULSE_STEPS / clock.grain_steps)
        hz = counts * periods * 1e6 / value if value else 0.0
    if not LOW_HZ <= hz <= HIGH_HZ:
        usual = clock.oscillator_hz / COUNTS / periods
        raise ValueError(
            f"{typed.strip()} would be a clock of {hz / 1e6:.2f} MHz, and there is none below "
            f"{LOW_HZ / 1e6:g} or above {HIGH_HZ / 1e6:g}: about {usual:.1f} Hz or 1500 us is to "
            "be expected; measure again"
        )
    return round(hz, -3)

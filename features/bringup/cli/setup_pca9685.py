"""Setting PCA9685 boards up: addresses, the true clock of each, then channel by channel.

A board keeps nothing without power: the program sets it up at every start.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime

import typer

from gazerig.config.faults import ConfigError
from gazerig.config.save import save_rig
from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.pca9685.registers import CHANNELS
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import ChannelPosition, given
from gazerig.features.bringup.cli.setup_channels import try_channels
from gazerig.features.bringup.oscillator import free_channel, free_pulse, oscillator_hz
from gazerig.robot.cli.terminal import say
from gazerig.robot.model.joint import JointParams


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
    return try_channels(Pca9685Board(line, params), setups, joints, yes, _explain)


def _explain(setup: ServoConfig, place: ChannelPosition) -> str:
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

"""Setup of boards of hobby servos: settings, the clock of a PCA9685, then channel by channel.

The serial line cannot set anything in a Maestro, and cannot read the range of a channel: ranges are
tested with the servo supply off, when nothing moves. A PCA9685 loses its settings without power, so
the program sets it up at every start. Its oscillator has 25 MHz by the data sheet, but boards of 23
to 27 MHz are reported, which scales every pulse equally. Each servo is moved a little, so that a
person can confirm its channel.
"""

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from math import radians
from pathlib import Path
from typing import NamedTuple

import typer

from gazerig.config.faults import ConfigError
from gazerig.config.rig import BusConfig, Rig
from gazerig.config.save import save_rig
from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.files.file_output import write_file
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.params import US_STEPS
from gazerig.drivers.maestro.board import MaestroBoard
from gazerig.drivers.maestro.probe import USB_CHANNELS
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.pca9685.registers import CHANNELS, COUNTS, PulseClock
from gazerig.drivers.serial.list_ports import POLOLU
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import (
    FINE_STEPS,
    ChannelPosition,
    start_pulses,
    walk_channel,
)
from gazerig.features.bringup.cli import ports as bench
from gazerig.features.bringup.maestro_settings import clipping_text, instructions, settings_file
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.cli.terminal import confirm, finish_lines, record_signals, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams

WIGGLE_DEG = 5.0

QUICK_STEPS_S = 90.0 / 360.0 * 16_000.0
"""Speed of a range test without servo supply, in case it is on after all."""

PULSE_STEPS = 1500 * US_STEPS
LOW_HZ, HIGH_HZ = 22e6, 28e6
"""Range of the known boards; also the bounds of oscillator_hz."""

_MEASURED = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(hz|us)\s*", re.IGNORECASE)

Explain = Callable[[ServoConfig, ChannelPosition], str]
"""Returns why a board's pulse is not as commanded, and the remedy."""


class SetupTask(NamedTuple):
    """Setup of the servos of one bus, as requested on the command line.

    rig_name: name of the rig on the command line; setups: setups of the chosen servos
    settings: file for the settings of a Maestro
    """

    rig: Rig
    rig_name: str
    bus: str
    setups: list[ServoConfig]
    port: str | None
    mock: bool
    yes: bool
    settings: Path | None

    @property
    def title(self) -> str:
        """Return the rig's name, with its bus if it has several."""
        if len(bus_names(self.rig)) == 1:
            return self.rig_name
        return f"{self.rig_name}, {bench.bus_label(self.rig, self.bus)}"

    @property
    def config(self) -> BusConfig:
        """Return the configuration of the bus."""
        return self.rig.bus_named(self.bus)


def press_enter(question: str) -> str:
    """Wait for Enter; return the text typed before it."""
    finish_lines()
    answer = typer.prompt(question, default="", show_default=False, prompt_suffix="", err=True)
    return str(answer)


def _try_channels(board: Board, task: SetupTask, explain: Explain) -> list[str]:
    """Move one channel after the other; return the joints that were skipped.

    Raises:
        ServoMissing: the board does not answer, and no user can answer (``yes``).
        ServoFault: pulses could not be stopped.
        BusLost: the port has disappeared.
    """
    say(
        "Now each channel moves its servo a little. Keep fingers away: as a servo's pulses begin "
        "it goes to its rest place at once, wherever it is."
    )
    left = []
    for n, setup in enumerate(task.setups, 1):
        say(f"{n} of {len(task.setups)}: {servo_label(setup)}")
        if not _try_channel(board, setup, task.rig.joints[setup.name], task.yes, explain):
            left.append(setup.name)
    return left


def _walk_channel(
    board: Board, setup: ServoConfig, places: Sequence[int], *speed_steps_s: float
) -> tuple[ChannelPosition, ...]:
    """Move a channel to positions; after a request to end, the pulses are off.

    Raises:
        KeyboardInterrupt: the user requested the end.
    """
    clock = RealClock()
    with record_signals() as stopped:
        stopped.only_record()

        def sleep_until(t_s: float) -> None:
            stopped.raise_if_requested()
            clock.sleep_until(t_s)

        return walk_channel(board, setup, places, sleep_until, *speed_steps_s)


def _rest_steps(setup: ServoConfig) -> int:
    """Return the pulse at which a joint rests, within its range."""
    middle = (setup.min_steps + setup.max_steps) // 2
    rest = middle if setup.rest_steps is None else setup.rest_steps
    return min(max(rest, setup.min_steps), setup.max_steps)


def _try_channel(
    board: Board, setup: ServoConfig, joint: JointParams, yes: bool, explain: Explain
) -> bool:
    """Move one channel's servo until the person recognises it, or skips it."""
    made, rest = joint.make_linkage(), _rest_steps(setup)
    angle, wiggle = made.angle_rad(rest), radians(WIGGLE_DEG)
    ends = (
        max(radians(joint.min_deg), angle - wiggle),
        min(radians(joint.max_deg), angle + wiggle),
    )
    low, high = (min(max(round(made.steps(end)), setup.min_steps), setup.max_steps) for end in ends)
    while True:
        at = f"it goes to {rest / US_STEPS:g} us at once, then {WIGGLE_DEG:g} deg to and fro"
        if not yes and not confirm(f"   move it? {at}", default=False, err=True):
            return False
        try:
            gone = _walk_channel(board, setup, (rest, low, high, rest))
        except ServoFault:
            raise
        except DriverError as error:
            if yes:
                raise
            say(f"   {error}")
            continue
        for one in gone:
            if abs(one.commanded - one.reported) > FINE_STEPS:
                say(f"   {explain(setup, one)}")
                break
        name = setup.name.replace("_", " ")
        if yes or confirm(f"   did the {name} move, and nothing else?", err=True):
            return True
        say(
            f"   then plug its servo into channel {setup.id}, or write the channel that it is on "
            f"as joints.{setup.name}.id; n at the next question skips it"
        )


# --- Maestro


def set_up_maestro(task: SetupTask) -> list[str]:
    """Print what to set on a board and test its channels; return the joints that were skipped.

    Raises:
        SetupError: the file of settings cannot be written.
        PortError: the port cannot be opened, or no board answers.
        ServoFault: pulses could not be stopped.
        BusLost: the port has disappeared.
    """
    params, setups = task.config.maestro, task.setups
    say(f"{task.title}: a Pololu Maestro; {len(setups)} of its channels to try.")
    with (
        bench.rig_ports(task.rig, task.mock, task.port) as wired,
        bench.unopened_port(wired.paths[task.bus]) as line,
    ):
        path, usb = line.port_name, bench.usb_id(line.port_name)
        # The board's own USB port, not that of an adaptor at its serial pins.
        on_usb = usb.startswith(POLOLU)
        if not usb:
            on_usb = not os.path.realpath(path).startswith(("/dev/ttyS", "/dev/ttyAMA"))
        if task.settings is not None:
            text = settings_file(params, bench.setups_on(task.rig, task.bus), on_usb)
            write_file(task.settings, text, force=True)
            say(
                f"   all settings are in {task.settings}: in Pololu's Maestro Control "
                "Center File, Open"
            )
            say(
                "   settings file, then Apply Settings; or without it: UscCmd --configure "
                f"{task.settings}"
            )
        for text in instructions(params, setups, on_usb):
            say(f"   {text}")
        if not task.yes:
            press_enter("   Enter: it is set, and Pololu's program is closed; Ctrl-C: end ")
        size = USB_CHANNELS.get(usb)
        beyond = [servo_label(setup) for setup in setups if size is not None and setup.id >= size]
        if beyond:
            raise ServoMissing(
                f"{path}: this board has channels 0..{(size or 0) - 1}, not those of "
                f"{', '.join(beyond)}: correct their ids in the YAML"
            )
        line.setBaudRate(params.baud)
        board, log = MaestroBoard(line, params), EventLog()
        board.find((), log)
        board.prepare(log)
        for event in log.drain():
            say(f"   {event}")
        _test_ranges(board, setups, task.yes)
        return _try_channels(board, task, _explain_maestro)


def _explain_maestro(setup: ServoConfig, place: ChannelPosition) -> str:
    return clipping_text(setup, place.commanded, place.reported)


def _test_ranges(board: MaestroBoard, setups: Sequence[ServoConfig], yes: bool) -> None:
    """Move every channel from end to end if the person confirms that no servo can move."""
    if yes:
        say("   the channels' ranges are not tried out: --yes cannot know that the supply is off")
        return
    question = (
        "   Switch the SERVO SUPPLY OFF (the board lives on USB) to try the channels' ranges "
        "out. Is it off?"
    )
    if not confirm(question, default=False, err=True):
        say("   the channels' ranges are not tried out")
        return
    cut: dict[str, None] = {}
    for setup in setups:
        rest = _rest_steps(setup)
        places = (rest, setup.min_steps, setup.max_steps, rest)
        for one in _walk_channel(board, setup, places, QUICK_STEPS_S):
            if abs(one.commanded - one.reported) > FINE_STEPS:
                cut[_explain_maestro(setup, one)] = None
    for text in cut:
        say(f"   {text}")
    if not cut:
        say(f"   all {len(setups)} channels reach both ends of their joints' ranges")
    press_enter("   Enter: the servo supply is on again; Ctrl-C: end ")


# --- PCA9685


def set_up_pca9685(task: SetupTask) -> list[str]:
    """Print how boards are wired and test their channels; return the joints that were skipped.

    Raises:
        PortError: the port cannot be opened.
        ServoMissing: a board does not answer.
        ServoFault: pulses could not be stopped.
        BusLost: the port has disappeared.
    """
    params, setups = task.config.pca9685, task.setups
    say(f"{task.title}: PCA9685; {len(setups)} of its channels to try.")
    with (
        bench.rig_ports(task.rig, task.mock, task.port) as wired,
        bench.unopened_port(wired.paths[task.bus]) as line,
    ):
        line.setBaudRate(params.baud)
        for address in params.addresses:
            closed = [f"A{bit}" for bit in range(6) if address >> bit & 1]
            say(f"   board {address:#x}: jumpers {', '.join(closed) or 'none'} closed")
        for one in setups:
            board, channel = divmod(one.id, CHANNELS)
            say(f"   {one.name}: channel {channel} of board {params.addresses[board]:#x}")
        if task.yes:
            say("   the boards' clocks are not measured: --yes has no meter")
        else:
            measured = _measure_clocks(line, params, task)
            if measured.clocks != params.clocks:
                _write_clocks(measured, task)
                params = measured
        return _try_channels(Pca9685Board(line, params), task, _explain_pca9685)


def _explain_pca9685(setup: ServoConfig, place: ChannelPosition) -> str:
    sent, got = f"{place.commanded / US_STEPS:g} us", f"{place.reported / US_STEPS:g} us"
    return (
        f"{servo_label(setup)} is sent to {sent} and gets {got}: is another program using the "
        "board? gazerig doctor looks at it"
    )


def _measure_clocks(line: BusPort, params: Pca9685Params, task: SetupTask) -> Pca9685Params:
    """Let the user measure every board's clock; return the params with the measured values."""
    say(
        "   A board's clock is up to 8 % off, and so are all its pulses: 4 deg of a servo at 3 %. "
        "With a meter that shows Hz, an oscilloscope or a logic analyser it is known for good."
    )
    used = {one.id for one in bench.setups_on(task.rig, task.bus)}
    found = [clock.oscillator_hz for clock in params.clocks.values()]
    for n, address in enumerate(params.addresses):
        free = [one for one in range(CHANNELS * n, CHANNELS * (n + 1)) if one not in used]
        if not free:
            say(f"   board {address:#x}: all channels have joints, none is free to be measured")
            continue
        pulse = ServoConfig(
            free[-1], "hobby", PULSE_STEPS, PULSE_STEPS, 1.0, "no joint", rest_steps=PULSE_STEPS
        )
        with start_pulses(Pca9685Board(line, params), pulse):
            found[n] = _ask_oscillator_hz(params, address, free[-1] % CHANNELS, found[n])
    return replace(params, oscillator_hz=found[0], further_oscillators_hz=tuple(found[1:]))


def _ask_oscillator_hz(params: Pca9685Params, address: int, channel: int, known_hz: float) -> float:
    """Ask for the meter's reading until it is plausible; Enter keeps the known value."""
    question = (
        f"   board {address:#x}: channel {channel}, where no joint is, gives 1500 us at "
        f"{params.frequency_hz:g} Hz. What is measured at its signal pin, in Hz or us? "
        "Enter: skip "
    )
    while typed := press_enter(question):
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
    return known_hz


def oscillator_hz(clock: PulseClock, typed: str) -> float:
    """Return the frequency of an oscillator, whole kilohertz.

    Args:
        clock: the assumed clock during the measurement of the 1500 us pulses.
        typed: "50.9 Hz" or "1473 us", from the meter.

    Raises:
        ValueError: the text has another form, or the clock is impossible for a PCA9685.
    """
    found = _MEASURED.fullmatch(typed)
    if found is None:
        raise ValueError(f"{typed!r}: type the frequency or the pulse, such as 50.9 Hz or 1473 us")
    value, unit = float(found[1]), found[2].lower()
    periods = clock.prescale + 1
    if unit == "hz":
        hz = value * COUNTS * periods
    else:
        counts = round(PULSE_STEPS / clock.resolution_steps)
        hz = counts * periods * 1e6 / value if value else 0.0
    if not LOW_HZ <= hz <= HIGH_HZ:
        usual = clock.oscillator_hz / COUNTS / periods
        raise ValueError(
            f"{typed.strip()} would be a clock of {hz / 1e6:.2f} MHz, and there is none below "
            f"{LOW_HZ / 1e6:g} or above {HIGH_HZ / 1e6:g}: about {usual:.1f} Hz or 1500 us is to "
            "be expected; measure again"
        )
    return round(hz, -3)


def _write_clocks(params: Pca9685Params, task: SetupTask) -> None:
    """Write the clocks into the rig's file after a yes; print them if that is impossible."""
    key = f"buses.{task.bus}.pca9685" if task.bus else "bus.pca9685"
    wanted: dict[str, float | tuple[float, ...]] = {f"{key}.oscillator_hz": params.oscillator_hz}
    if params.further_oscillators_hz:
        wanted[f"{key}.further_oscillators_hz"] = params.further_oscillators_hz
    named = ", ".join(f"{name}: {value}" for name, value in wanted.items())
    if not confirm(f"   write {named} into {task.rig_name}?", default=True, err=True):
        return
    try:
        saved = save_rig(task.rig_name, wanted, datetime.now())
    except ConfigError as error:
        say(f"   not written: {error}")
        say(f"   write it yourself: {named}")
        return
    say(f"   written into {saved.path}; as it was: {saved.backup}")

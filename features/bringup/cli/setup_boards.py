"""Setup of boards of hobby servos: settings, then channel by channel.

The serial line cannot set anything in a Maestro, and cannot read the range of a channel: ranges are
tested with the servo supply off, when nothing moves. A PCA9685 loses its settings without power, so
the program sets it up at every start. Each servo is moved a little, so that a person can confirm
its channel.
"""

import os
from collections.abc import Callable, Sequence
from math import radians
from typing import NamedTuple

import typer

from gazerig.config.rig import BusConfig, Rig
from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.params import US_STEPS
from gazerig.drivers.maestro.board import MaestroBoard
from gazerig.drivers.maestro.probe import USB_CHANNELS
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.registers import CHANNELS
from gazerig.drivers.serial.list_ports import POLOLU
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import (
    FINE_STEPS,
    ChannelPosition,
    walk_channel,
)
from gazerig.features.bringup.cli import ports as bench
from gazerig.features.bringup.maestro_settings import clipping_text, instructions
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.cli.terminal import confirm, finish_lines, record_signals, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams

WIGGLE_DEG = 5.0

QUICK_STEPS_S = 90.0 / 360.0 * 16_000.0
"""Speed of a range test without servo supply, in case it is on after all."""

Explain = Callable[[ServoConfig, ChannelPosition], str]
"""Returns why a board's pulse is not as commanded, and the remedy."""


class SetupTask(NamedTuple):
    """Setup of the servos of one bus, as requested on the command line.

    rig_name: name of the rig on the command line; setups: setups of the chosen servos
    """

    rig: Rig
    rig_name: str
    bus: str
    setups: list[ServoConfig]
    port: str | None
    mock: bool
    yes: bool

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
        return _try_channels(Pca9685Board(line, params), task, _explain_pca9685)


def _explain_pca9685(setup: ServoConfig, place: ChannelPosition) -> str:
    sent, got = f"{place.commanded / US_STEPS:g} us", f"{place.reported / US_STEPS:g} us"
    return (
        f"{servo_label(setup)} is sent to {sent} and gets {got}: is another program using the "
        "board? gazerig doctor looks at it"
    )

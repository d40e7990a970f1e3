"""Setting a Maestro up: what to set in Pololu's program, then its channels tried one by one.

Nothing of a Maestro can be set over its serial line, and no channel's range can be read:
ranges are tried out with the servo supply off, when nothing moves, and which servo hangs on
which channel is seen by moving it a little.
"""

import os
from collections.abc import Mapping, Sequence
from math import radians
from pathlib import Path

import typer

from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing, SetupError
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.maestro.line import Line
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.maestro.probe import USB_CHANNELS
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.serial.port_owner import POLOLU
from gazerig.drivers.servo_models import servo_label
from gazerig.drivers.types import ServoSetup
from gazerig.robot.bringup.channel_test import FINE_STEPS, Place, walk
from gazerig.robot.bringup.maestro_settings import clipped, instructions, settings_file
from gazerig.robot.cli import progress as bench
from gazerig.robot.cli.terminal import say, signals
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams

WIGGLE_DEG = 5.0
QUICK_STEPS_S = 90.0 / 360.0 * 16_000.0
"""Speed of a range that is tried out without servo supply, should that be on after all."""


def set_up_board(
    line: BusPort,
    params: MaestroParams,
    setups: Sequence[ServoSetup],
    joints: Mapping[str, JointParams],
    yes: bool,
) -> list[str]:
    """Go through a board's settings and channels; gives the joints that were skipped.

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
    board = _greeted(line, params)
    _ranges(board, setups, yes)
    say(
        "Now each channel moves its servo a little. Keep fingers away: as a servo's pulses begin "
        "it goes to its rest place at once, wherever it is."
    )
    left = []
    for n, setup in enumerate(setups, 1):
        say(f"{n} of {len(setups)}: {servo_label(setup)}")
        if not _channel(board, setup, joints[setup.name], yes):
            left.append(setup.name)
    return left


def write_settings(
    file: Path, params: MaestroParams, setups: Sequence[ServoSetup], port: str
) -> None:
    """Write what to set on a board as a file of Pololu's programs, and say how it is loaded.

    Raises:
        SetupError: the file cannot be written.
    """
    try:
        file.write_text(settings_file(params, setups, on_usb(port)), encoding="utf-8")
    except OSError as error:
        raise SetupError(f"--settings {file}: cannot be written ({error.strerror})") from error
    say(f"   all that is to be set is in {file}: in Pololu's Maestro Control Center File, Open")
    say(f"   settings file, then Apply Settings; or without it: UscCmd --configure {file}")


def _refuse_size(setups: Sequence[ServoSetup], usb: str, where: str) -> None:
    """See that a board whose size its USB product tells has all the channels."""
    size = USB_CHANNELS.get(usb)
    beyond = [servo_label(setup) for setup in setups if size is not None and setup.id >= size]
    if beyond:
        raise ServoMissing(
            f"{where}: this board has channels 0..{(size or 0) - 1}, not those of "
            f"{', '.join(beyond)}: correct their ids in the YAML"
        )


def _greeted(line: BusPort, params: MaestroParams) -> Line:
    """Open the port and find the board as the rig says it is; a script of its own is stopped."""
    line.setBaudRate(params.baud)
    board = Line(line, params)
    if board.greet() is None or not board.takes_crc():
        raise ServoMissing(
            f"{line.port_name}: no Maestro answers as the YAML says: gazerig doctor names the cure"
        )
    if board.ask(board.speech.script_status(), 1) == b"\0":
        board.send(board.speech.stop_script())
        say("   the board ran a script of its own: stopped; delete it in Pololu's program")
    return board


def on_usb(path: str) -> bool:
    """Return whether a port is a board's own on USB, and not one of adaptor and serial pins."""
    usb = bench.usb_id(path)
    if usb:
        return usb.startswith(POLOLU)
    return not os.path.realpath(path).startswith(("/dev/ttyS", "/dev/ttyAMA"))


# --- ranges


def _ranges(board: Line, setups: Sequence[ServoSetup], yes: bool) -> None:
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


def _range(board: Line, setup: ServoSetup) -> list[str]:
    """Lead a channel from end to end of its joint's range; gives what cuts it."""
    places = (_rest(setup), setup.min_steps, setup.max_steps, _rest(setup))
    gone = _walked(board, setup, places, QUICK_STEPS_S)
    wrong = [one for one in gone if abs(one.asked - one.got) > FINE_STEPS]
    return list(dict.fromkeys(clipped(setup, one.asked, one.got) for one in wrong))


def _walked(
    board: Line, setup: ServoSetup, places: Sequence[int], *speed_steps_s: float
) -> tuple[Place, ...]:
    """Lead a channel over places; whoever asks for the end meanwhile gets it with pulses off.

    Raises:
        KeyboardInterrupt: somebody asked for the end.
    """
    clock = RealClock()
    with signals() as stopped:
        stopped.never_raise()

        def sleep_until(t_s: float) -> None:
            stopped.refuse()
            clock.sleep_until(t_s)

        return walk(board, setup, places, sleep_until, *speed_steps_s)


def _rest(setup: ServoSetup) -> int:
    """Return the pulse at which a joint rests, within its range."""
    middle = (setup.min_steps + setup.max_steps) // 2
    rest = middle if setup.rest_steps is None else setup.rest_steps
    return min(max(rest, setup.min_steps), setup.max_steps)


# --- which servo is it


def _channel(board: Line, setup: ServoSetup, joint: JointParams, yes: bool) -> bool:
    """Move one channel's servo until the person knows it, or skips it."""
    rest, low, high = wiggle(setup, joint)
    while True:
        at = f"it goes to {rest / US_STEPS:g} us at once, then {WIGGLE_DEG:g} deg to and fro"
        if not yes and not typer.confirm(f"   move it? {at}", default=False, err=True):
            return False
        try:
            gone = _walked(board, setup, (rest, low, high, rest))
        except ServoFault:
            raise
        except DriverError as error:
            if yes:
                raise
            say(f"   {error}")
            continue
        for one in gone:
            if abs(one.asked - one.got) > FINE_STEPS:
                say(f"   {clipped(setup, one.asked, one.got)}")
                break
        name = setup.name.replace("_", " ")
        if yes or typer.confirm(f"   did the {name} move, and nothing else?", err=True):
            return True
        say(
            f"   then plug its servo into channel {setup.id}, or write the channel that it is on "
            f"as joints.{setup.name}.id; n at the next question skips it"
        )


def wiggle(setup: ServoSetup, joint: JointParams) -> tuple[int, int, int]:
    """Return the rest place and two places about it, in steps, all within the joint's range."""
    made, rest = joint.made(), _rest(setup)
    angle = made.angle_rad(rest)
    least, most = radians(joint.min_deg), radians(joint.max_deg)
    ends = (max(least, angle - radians(WIGGLE_DEG)), min(most, angle + radians(WIGGLE_DEG)))
    low, high = (min(max(round(made.steps(end)), setup.min_steps), setup.max_steps) for end in ends)
    return rest, low, high

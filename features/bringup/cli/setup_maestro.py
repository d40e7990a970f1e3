"""Setting a Maestro up: what to set in Pololu's program, then its channels tried one by one.

Nothing of a Maestro can be set over its serial line, and no channel's range can be read:
ranges are tried out with the servo supply off, when nothing moves, and which servo hangs on
which channel is seen by moving it a little.
"""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import typer

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.files.file_output import write_file
from gazerig.drivers.maestro.board import MaestroBoard
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.maestro.probe import USB_CHANNELS
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.serial.port_owner import POLOLU
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import FINE_STEPS, ChannelPosition
from gazerig.features.bringup.cli import progress as bench
from gazerig.features.bringup.cli.setup_channels import rest_steps, try_channels, walked
from gazerig.features.bringup.maestro_settings import clipped, instructions, settings_file
from gazerig.robot.cli.terminal import say
from gazerig.robot.model.joint import JointParams

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

"""Setup of boards of hobby servos: their settings and wiring, and a check that they answer.

The serial line cannot set anything in a Maestro. A PCA9685 loses its settings without power, so the
program sets it up at every start. Nothing moves.
"""

from typing import NamedTuple

import typer

from gazerig.config.rig import BusConfig, Rig
from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.maestro.board import USB_CHANNELS, MaestroBoard
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.cli import ports as bench
from gazerig.features.bringup.maestro_settings import instructions
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.cli.terminal import finish_lines, say

_LOOK = "   to see which servo is on which channel: gazerig jog moves one joint at a time"


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


# --- Maestro


def set_up_maestro(task: SetupTask) -> None:
    """Print what to set on a board, and check that it answers and has the channels.

    Raises:
        PortError: the port cannot be opened, or no board answers.
        ServoMissing: the board is too small.
        BusLost: the port has disappeared.
    """
    params, setups = task.config.maestro, task.setups
    say(f"{task.title}: a Pololu Maestro; {len(setups)} of its channels.")
    with (
        bench.rig_ports(task.rig, task.mock, task.port) as wired,
        bench.unopened_port(wired.paths[task.bus]) as line,
    ):
        path, usb = line.port_name, bench.usb_id(line.port_name)
        for text in instructions(params, setups):
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
        MaestroBoard(line, params).find(())
    say(_LOOK)


# --- PCA9685


def set_up_pca9685(task: SetupTask) -> None:
    """Print how the board is wired, and check that it answers.

    Raises:
        PortError: the port cannot be opened.
        ServoMissing: the board does not answer.
        BusLost: the port has disappeared.
    """
    params, setups = task.config.pca9685, task.setups
    say(f"{task.title}: PCA9685; {len(setups)} of its channels.")
    with (
        bench.rig_ports(task.rig, task.mock, task.port) as wired,
        bench.unopened_port(wired.paths[task.bus]) as line,
    ):
        line.setBaudRate(params.baud)
        closed = [f"A{bit}" for bit in range(6) if params.address >> bit & 1]
        say(f"   board {params.address:#x}: jumpers {', '.join(closed) or 'none'} closed")
        for one in setups:
            say(f"   {one.name}: channel {one.id}")
        Pca9685Board(line, params).find(setups)
    say(_LOOK)

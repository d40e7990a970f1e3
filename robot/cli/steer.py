"""Command steer: keys move a rig in another terminal."""

import contextlib
import sys
from collections.abc import Callable
from typing import Annotated, ClassVar

import typer

from gazerig.drivers.errors import SetupError
from gazerig.gaze.angles import Angles2
from gazerig.robot.cli.look_and_stop import PidOption
from gazerig.robot.cli.terminal import clear_errors, say, status
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.model.commands import Ask, LookAtDirection, Play
from gazerig.robot.remote.client import RequestRejected, RobotClient
from gazerig.robot.remote.steering import STOP, TRACKS, Steering

app = typer.Typer()
_EVERY_S = 0.05
_FAR_M = 1.5
END = "end"
HELP = "arrow keys: gaze; 1 nod, 2 shake, 3 wink, 4 surprised, 5 sleepy; space: STOP; q: quit"


@app.command()
def steer(
    behind: Annotated[
        bool, typer.Option("--behind", help="You are behind the head: its right is your right.")
    ] = False,
    pid: PidOption = None,
) -> None:
    """Steer the running head by arrow keys; when released, it looks freely again."""
    from gazerig.robot.cli.key_input import TerminalInput

    with clear_errors():
        if not sys.stdin.isatty():
            raise SetupError("keys are read from a terminal: run this in one")
        with (
            TerminalInput() as terminal,
            RobotClient.connect(pid, "gazerig ctl steer") as rig,
        ):
            say(HELP)
            controls = KeyControls(terminal.text)
            with contextlib.suppress(KeyboardInterrupt):
                run_steering(rig, controls, Steering(behind), RealClock(), status)
            if rig.in_control:
                rig.look_freely()
            say("it looks freely")


def run_steering(
    rig: RobotClient,
    controls: "KeyControls",
    steering: Steering,
    clock: Clock,
    show: Callable[[str], None],
) -> None:
    """Apply steering commands until the user ends it.

    Args:
        rig: The running rig.
        controls: The keys.
        steering: Converts its input to commands.
        clock: Clock of this program.
        show: Writes the status line.
    """
    looks: Angles2 | None = None
    while True:
        now_s = clock.now_s()
        pressed = controls.update(steering, now_s)
        if STOP in pressed:  # has priority
            rig.stop("gazerig ctl steer")
            say("torque is off; gazerig ctl resume continues")
        if END in pressed:
            return
        wanted = steering.direction_rad(now_s)
        try:
            for track in pressed:
                if track in TRACKS:
                    if track == "wink":
                        rig.send(Ask("lids", "wink left"))
                    else:
                        rig.send(Play(track))
            if wanted is not None and (wanted != looks or not rig.in_control):
                rig.send(LookAtDirection(wanted, distance_m=_FAR_M))
            elif wanted is None and looks is not None:
                rig.look_freely()
            show("you lead" if wanted is not None else "it looks freely")
        except RequestRejected as error:
            show(str(error))
        looks = wanted
        clock.sleep_until(now_s + _EVERY_S)


class KeyControls:
    """Keys of a terminal.

    text: returns the text typed since the last call, "" for none, None if the terminal has closed
    """

    _ARROWS: ClassVar = {"up": (0, 1), "down": (0, -1), "right": (1, 0), "left": (-1, 0)}

    def __init__(self, text: Callable[[], str | None]) -> None:
        self._text = text
        self._rest = ""

    def update(self, steering: Steering, now_s: float) -> tuple[str, ...]:
        """Apply pressed arrows, and return the other pressed keys: tracks, STOP, END."""
        from gazerig.robot.cli.key_input import split_keys

        typed = self._text()
        if typed is None:
            return (END,)
        keys, self._rest = split_keys(self._rest + typed)
        pressed: list[str] = []
        for key in keys:
            if key in self._ARROWS:
                steering.key(*self._ARROWS[key], now_s)
            elif key in "12345":
                pressed.append(TRACKS[int(key) - 1])
            elif key == " ":
                pressed.append(STOP)
            elif key in "qQ":
                pressed.append(END)
        return tuple(pressed)

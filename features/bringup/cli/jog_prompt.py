"""Input of a person at the terminal who moves a servo by small steps, and types numbers."""

import select
import sys
from collections.abc import Callable
from math import isfinite

from gazerig.features.bringup.calibration.linkage_calibration import HobbyMarker
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.features.bringup.cli.calibration_keys import TerminalKeys
from gazerig.features.bringup.cli.prompts import LOOK_S, TerminalPerson
from gazerig.robot.cli.terminal import say

STEPS_US = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
FIRST_STEP = 3

KEYS_HELP = (
    "arrow keys left and right (or a d) move it, up and down change the step, Enter: it is there, "
    "q ends"
)
LINES_HELP = "+20 or -20 moves it by so many us, 1480 to that width, Enter: it is there, q ends"


class TerminalJogger(TerminalPerson):
    """Asks on the terminal; implements Jogger.

    Keys of a terminal take effect when pressed; lines of a file or a pipe are read one by one.
    """

    def steer(self, question: str, servo: HobbyMarker) -> None:
        """Return when the servo has the desired position; see Jogger."""
        say(question)
        if self._lines.is_scripted or not sys.stdin.isatty():
            while line := self._line(question, servo.live):
                try:
                    us = float(line)
                except ValueError:
                    us = float("nan")
                if not isfinite(us):
                    say(f"{line!r}: {LINES_HELP}")
                elif line[0] in "+-":
                    servo.move_by_us(us)
                else:
                    servo.move_to_us(us)
            return
        step = FIRST_STEP
        say(KEYS_HELP)
        with TerminalKeys() as keys:
            while True:
                self._look(servo.live, f"; step {STEPS_US[step]:g} us: {KEYS_HELP}")
                key = keys.next(True)
                if key is None:
                    select.select([sys.stdin.fileno()], [], [], LOOK_S)
                elif key == "enter":
                    return
                elif key == "end":
                    raise CalibrationStopped("q")
                elif key in ("left", "right"):
                    servo.nudge(STEPS_US[step] if key == "right" else -STEPS_US[step])
                elif key in ("up", "larger"):
                    step = min(step + 1, len(STEPS_US) - 1)
                elif key in ("down", "smaller"):
                    step = max(step - 1, 0)

    def ask_number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        """Return the typed number; Enter selects the proposed one; see Jogger."""
        asked = f"{question} [{proposed:g}]"
        say(asked)
        while True:
            line = self._line(asked, live)
            try:
                number = float(line) if line else proposed
            except ValueError:
                number = float("nan")
            if isfinite(number):
                return number
            say(f"{line!r} is no number: a number, or Enter for {proposed:g}; q ends")

"""Questions on the terminal, answered by a person, a pipe or a file, while a joint is watched."""

import os
import select
import sys
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import cast

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.features.bringup.calibration.face_steering import Key
from gazerig.features.bringup.calibration.hobby_calibration import HobbyServoAccess
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.robot.cli.terminal import TerminalInput, say, split_keys, status

LOOK_S = 0.03
"""Period at which a joint is read during a question: more than 20 times a second."""

HAND_STEPS = 100
"""Steps by which an emulated hand turns a joint between two readings."""

YES, NO = ("y", "yes"), ("n", "no")

STEP_US = 5.0
"""Step of a key, near the dead band of a hobby servo; one in ``LOOK_S``: slower than it turns."""
KEYS_HELP = "arrow keys left and right (or a d) move it, Enter: it is there, q ends"
LINES_HELP = "+20 or -20 moves it by so many us, 1480 to that width, Enter: it is there, q ends"


_LARGEST = 1_000_000  # largest size of a file of answers, bytes


class Lines:
    """Lines of a file, or of standard input as they arrive; is_scripted: whether from a file."""

    def __init__(self, answers: Path | None) -> None:
        """Read all answers of a file; None: use standard input.

        Raises:
            OSError: the file cannot be read.
            SetupError: it is not text.
        """
        self.is_scripted, self._rest = answers is not None, b""
        self._ready: list[str] = []
        if answers is not None:
            try:
                self._ready = read_limited(answers, _LARGEST).decode().splitlines()
            except UnicodeDecodeError:
                raise SetupError(f"{answers}: is no UTF-8 text; write one answer a line") from None

    def next(self, wait_s: float) -> str | None:
        """Return the next line, None if none arrived in time.

        Raises:
            EOFError: no lines remain.
        """
        if self._ready:
            return self._ready.pop(0).strip()
        if self.is_scripted:
            raise EOFError
        if not select.select([sys.stdin.fileno()], [], [], wait_s)[0]:
            return None
        try:
            data = os.read(sys.stdin.fileno(), 4096)
        except OSError:  # the terminal has disappeared
            data = b""
        if not data:
            raise EOFError
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._ready = [line.decode(errors="replace").strip() for line in lines]
        return self._ready.pop(0) if self._ready else None


class TerminalPerson:
    """Asks on the terminal; implements Operator.

    Keys of a terminal take effect when pressed; lines of a file or a pipe are read one by one.

    Args:
        lines: source of the answers.
        stopped: returns why to end, None without a reason.
        yes: answer every yes-or-no question with yes.
    """

    def __init__(self, lines: Lines, stopped: Callable[[], str | None], yes: bool) -> None:
        self._lines = lines
        self._stopped = stopped
        self._yes = yes
        self.hand: Callable[[int], object] | None = None
        """Turns the present joint by some steps, if it is emulated."""

    def tell(self, line: str) -> None:
        """Print a line."""
        say(line)

    def wait(self, question: str, live: Callable[[], str]) -> None:
        """Return at Enter."""
        self._ask(question, live, ("",))

    def agrees(self, question: str, live: Callable[[], str] = str) -> bool:
        """Return yes or no."""
        if self._yes:
            say(f"{question} yes (--yes)")
            return True
        return self._ask(f"{question} [y/n]", live, (*YES, *NO)) in YES

    def steer(self, question: str, servo: HobbyServoAccess) -> None:
        """Return when the servo has the desired position."""
        if self._lines.is_scripted or not sys.stdin.isatty():
            say(question)
            while line := self._line(question, servo.live):
                us = _number(line)
                if us is None:
                    say(f"{line!r}: {LINES_HELP}")
                else:
                    servo.aim(servo.place_us + us if line[0] in "+-" else us)
            return
        say(f"{question}; {KEYS_HELP}")
        with TerminalKeys() as keys:
            while (key := keys.next()) != "enter":
                self._look(servo.live)
                match key:
                    case None:
                        select.select([sys.stdin.fileno()], [], [], LOOK_S)
                    case "end":
                        raise CalibrationStopped("q")
                    case "left" | "right":
                        servo.aim(servo.place_us + (STEP_US if key == "right" else -STEP_US))

    def ask_number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        """Return the typed number; Enter selects the proposed one."""
        asked = f"{question} [{proposed:g}]"
        say(asked)
        while (line := self._line(asked, live)) and _number(line) is None:
            say(f"{line!r} is no number: a number, or Enter for {proposed:g}; q ends")
        number = _number(line)
        return proposed if number is None else number

    def _ask(self, question: str, live: Callable[[], str], accepted: tuple[str, ...]) -> str:
        say(question)
        while (line := self._line(question, live)) not in accepted:
            word, _, number = line.partition(" ")
            if word == "turn" and self.hand is not None and number.lstrip("+-").isdecimal():
                left = int(number)
                while left:
                    step = max(-HAND_STEPS, min(HAND_STEPS, left))
                    self.hand(step)
                    left -= step
                    live()
                continue
            wanted = "Enter" if accepted == ("",) else "y or n"
            say(f"{line!r} is no answer: {wanted} goes on, q ends")
        return line

    def _look(self, live: Callable[[], str]) -> None:
        """Read the joint once, and show it."""
        why = self._stopped()
        if why is not None:
            raise CalibrationStopped(why)
        shown = live()
        if sys.stderr.isatty():
            status(shown)

    def _line(self, question: str, live: Callable[[], str]) -> str:
        """Wait for a line while the joint is watched."""
        while True:
            self._look(live)
            try:
                line = self._lines.next(LOOK_S)
            except EOFError:
                raise SetupError(
                    f"no answer left to: {question}: answer on the terminal, or give a file with "
                    "one line an answer (--answers; an empty line is Enter)"
                ) from None
            if line in ("q", "quit"):
                raise CalibrationStopped("q")
            if line is not None:
                return line


def _number(line: str) -> float | None:
    try:
        number = float(line)
    except ValueError:
        return None
    return number if isfinite(number) else None


# --- keys

HELP = (
    "arrow keys or w a s d move the gaze as you see it; Enter: it looks at it; "
    "n: next, leave this part; b: back; q: end"
)

_PLAIN: dict[str, Key] = {
    "w": "up", "a": "left", "s": "down", "d": "right",
    "\r": "enter", "\n": "enter", "n": "skip", "b": "back", "q": "end",
}  # fmt: skip
_WORDS: dict[str, Key] = {"": "enter", **_PLAIN} | {
    word: word for word in ("enter", "left", "right", "up", "down", "skip", "back", "end")
}


def split_words(text: str) -> tuple[list[Key], str]:
    """Return the keys in a terminal's input, and an incomplete sequence at its end."""
    typed, rest = split_keys(text)
    named = ((one if len(one) > 1 else _PLAIN.get(one.lower())) for one in typed)
    return [cast(Key, key) for key in named if key is not None], rest


def parse_keys(line: str) -> list[Key]:
    """Parse "left 3", "enter" or an empty line, which is Enter.

    Raises:
        SetupError: it is not a key; the message lists the keys.
    """
    word, _, number = line.strip().lower().partition(" ")
    number = number.strip() or "1"
    if word not in _WORDS or not number.isdecimal() or not 0 < int(number) <= 1000:
        raise SetupError(
            f"{line!r} is no key: left, right, up, down with a number of times (left 3), "
            "enter or an empty line, skip, back, end"
        )
    return [_WORDS[word]] * int(number)


class TerminalKeys(TerminalInput):
    """Keys of standard input one by one, within the block."""

    def __init__(self) -> None:
        self._ready: list[Key] = []
        self._rest = ""

    def next(self) -> Key | None:
        """Return the next key, None if none has been pressed."""
        if not self._ready:
            text = self.text()
            if text is None:
                return "end"
            self._ready, self._rest = split_words(self._rest + text)
        return self._ready.pop(0) if self._ready else None

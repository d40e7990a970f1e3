"""Fault commands of an emulated line, in groups from which devices choose."""

from collections.abc import Callable
from typing import Any

from gazerig.sim_mock.faults.grammar import BOTH, TIME, Verb
from gazerig.sim_mock.faults.line import LineFaults

Do = Callable[..., str]


def answer_command(kind: str, text: str) -> Do:
    """Return a command that disturbs the answers of one servo or all; ``text``: its reply."""

    def run_command(
        faults: LineFaults,
        servo_id: int | None = None,
        *numbers: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        done = text.format(*numbers, label=faults.label(servo_id))
        return faults.begin(kind, servo_id, done, count, seconds, numbers)

    return run_command


def counted_command(kind: str, text: str) -> Do:
    """Return a command for the line as a whole, for the next N or all."""
    begin = answer_command(kind, text)
    return lambda faults, count=None, seconds=None: begin(faults, count=count, seconds=seconds)


_static = answer_command("static", "noise hits {:g} % of all bytes, both directions")


def servo_verb(do: Callable[..., None], reply: str, words: str = "ID") -> Verb:
    """Return a command that acts on one servo or all; ``reply``: what follows its name."""

    def run(faults: Any, servo_id: int | None, *numbers: float) -> str:
        for servo in faults.servos(servo_id):
            do(servo, *numbers)
        return f"{faults.label(servo_id)} {reply.format(*numbers)}"

    return Verb(run, words)


# fmt: off
LINE_VERBS = {
    "lose": Verb(answer_command("lose", "{label} does not answer"), "ID", BOTH),
    "delay": Verb(answer_command("delay", "{label} answers {:g} ms late"), "ID MS", BOTH),
    "truncate": Verb(answer_command("truncate", "only {} bytes of answers of {label} arrive"), "ID BYTES", BOTH),
    "corrupt": Verb(answer_command("corrupt", "a bit flips in answers of {label}"), "ID [BIT]", BOTH),
    "static": Verb(lambda faults, percent, **ends: _static(faults, None, percent, **ends), "PERCENT", TIME),
}
"""The commands of any line."""

ADAPTER_VERBS = {
    "echo": Verb(counted_command("echo", "the line echoes the host"), "", TIME),
    "unplug": Verb(counted_command("unplug", "unplugged"), "", TIME),
    "plug": Verb(LineFaults.plug),
}
"""The commands of the line and adapter as a whole."""
# fmt: on

CLOSING_VERBS = {"status": Verb(LineFaults.status), "clear": Verb(LineFaults.clear)}
"""The commands of every device, which are last in its help."""


def loss_verb(kind: str, what: str) -> Verb:
    """Return the command that loses data to the device, which no answer shows."""
    return Verb(counted_command(kind, f"{what} are lost"), "[N]", TIME)

"""Fault commands of an emulated line, in groups from which devices choose."""

from collections.abc import Callable

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
    """Return a command that affects the next N, or all."""
    begin = answer_command(kind, text)
    return lambda faults, count=None, seconds=None: begin(faults, count=count, seconds=seconds)


def switch_command(kind: str, text: str) -> Do:
    """Return a command that switches a fault of the whole line on or off."""

    def run_command(faults: LineFaults, on: str = "on", seconds: float | None = None) -> str:
        faults.end(kind)
        if on == "off":
            return f"no longer: {text}"
        return faults.begin(kind, None, text, None, seconds)

    return run_command


_static = answer_command("static", "noise hits {:g} % of all bytes, both directions")
_unplug = switch_command("unplug", "unplugged")

# fmt: off
LINE_VERBS = {
    "lose": Verb(answer_command("lose", "{label} does not answer"), "ID",
                 "stay silent but obey", BOTH),
    "delay": Verb(answer_command("delay", "{label} answers {:g} ms late"), "ID MS",
                  "answer late; in a group the following servos wait, too", BOTH),
    "truncate": Verb(answer_command("truncate", "only {} bytes of answers of {label} arrive"),
                     "ID BYTES", "only the first BYTES of an answer arrive", BOTH),
    "corrupt": Verb(answer_command("corrupt", "a bit flips in answers of {label}"), "ID [BIT]",
                    "a bit flips, a random one by default", BOTH),
    "static": Verb(lambda faults, percent, **ends: _static(faults, None, percent, **ends), "PERCENT",
                   "noise hits this share of all bytes, both directions", TIME),
}
"""The commands of any line."""

ADAPTER_VERBS = {
    "echo": Verb(switch_command("echo", "the line echoes the host"), "[on|off]",
                 "the host receives its own bytes", TIME),
    "unplug": Verb(_unplug, "", "pull the adapter out", TIME),
    "plug": Verb(lambda faults: _unplug(faults, "off"), "", "reconnect the adapter under its name"),
}
"""The commands of the line and adapter as a whole."""

CLOSING_VERBS = {
    "status": Verb(LineFaults.status, "", "all servos and faults as JSON"),
    "clear": Verb(LineFaults.clear, "[ID]", "end faults of answers and line; effects on servos stay"),
}
"""The commands of every device, which are last in its help."""


def loss_verb(kind: str, what: str) -> Verb:
    """Return the command that loses data to the device, which no answer shows."""
    return Verb(counted_command(kind, f"{what} are lost"), "[N]", f"the next N {what} are lost", TIME)
# fmt: on

"""Fault commands of an emulated line, in groups from which devices choose."""

from collections.abc import Callable

from gazerig.sim_mock.faults.grammar import (
    BOTH,
    MS,
    SWITCH,
    TIME,
    Argument,
    Verb,
    count,
    id_or_all,
    integer_parser,
    number_parser,
)
from gazerig.sim_mock.faults.line import LineFaults

_BYTES = Argument("BYTES", integer_parser(0, 1024, "a number of bytes"))
_TIMES = Argument("N", count, True)

Do = Callable[..., str]


def answer_command(kind: str, text: str) -> Do:
    """Return a command that disturbs the answers of one servo or all; ``text``: its reply."""

    def run_command(
        faults: LineFaults,
        servo_id: int | None,
        *numbers: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        done = text.format(*numbers, label=faults.label(servo_id))
        return faults.begin(kind, servo_id, done, count, seconds, numbers)

    return run_command


def counted_command(kind: str, text: str) -> Do:
    """Return a command that affects the next N, or all."""

    def run_command(
        faults: LineFaults, count: int | None = None, seconds: float | None = None
    ) -> str:
        return faults.begin(kind, None, text, count, seconds)

    return run_command


def switch_command(kind: str, text: str) -> Do:
    """Return a command that switches a fault of the whole line on or off."""

    def run_command(faults: LineFaults, on: bool = True, seconds: float | None = None) -> str:
        faults.wire.remove(kind)
        return faults.begin(kind, None, text, None, seconds) if on else f"no longer: {text}"

    return run_command


_static = answer_command("static", "noise hits {:g} % of all bytes, both directions")


# fmt: off
def line_verbs(one: Argument) -> dict[str, Verb]:
    """Return the commands of any line; ``one`` parses an id."""
    target = Argument(one.label, id_or_all(one.read))
    return {
        "lose": Verb(answer_command("lose", "{label} does not answer"), (target,),
                     "stay silent but obey", BOTH),
        "delay": Verb(answer_command("delay", "{label} answers {:g} ms late"), (target, MS),
                      "answer late; in a group the following servos wait, too", BOTH),
        "truncate": Verb(answer_command("truncate", "only {} bytes of answers of {label} arrive"),
                         (target, _BYTES), "only the first BYTES of an answer arrive", BOTH),
        "corrupt": Verb(answer_command("corrupt", "a bit flips in answers of {label}"),
                        (target, Argument("BIT", integer_parser(0, 8191, "a bit"), True)),
                        "a bit flips, a random one by default", BOTH),
        "static": Verb(lambda faults, percent, **ends: _static(faults, None, percent, **ends),
                       (Argument("PERCENT", number_parser(0.0, 100.0, "a percentage")),),
                       "noise hits this share of all bytes, both directions", TIME),
    }


def loss_verb(kind: str, what: str) -> Verb:
    """Return the command that loses data to the device, which no answer shows."""
    return Verb(counted_command(kind, f"{what} are lost"), (_TIMES,), f"the next N {what} are lost", TIME)


def adapter_verbs() -> dict[str, Verb]:
    """Return the commands of the line and adapter as a whole."""
    return {
        "echo": Verb(switch_command("echo", "the line echoes the host"), (SWITCH,),
                     "the host receives its own bytes", TIME),
        "unplug": Verb(switch_command("unplug", "unplugged"), (), "pull the adapter out", TIME),
        "plug": Verb(lambda faults: switch_command("unplug", "unplugged")(faults, False), (),
                     "reconnect the adapter under its name"),
    }


def closing_verbs(one: Argument) -> dict[str, Verb]:
    """Return the commands of every device, which are last in its help."""
    return {
        "status": Verb(LineFaults.status, (), "all servos and faults as JSON"),
        "clear": Verb(LineFaults.clear, (one._replace(optional=True),),
                      "end faults of answers and line; effects on servos stay"),
    }
# fmt: on

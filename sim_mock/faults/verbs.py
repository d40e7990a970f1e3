"""What can be asked of an emulated line as text, in the parts that devices choose from."""

from collections.abc import Callable

from gazerig.sim_mock.faults.grammar import (
    BOTH,
    MS,
    SWITCH,
    TIME,
    Argument,
    Verb,
    anything,
    count,
    hex_bytes,
    number,
    one_of,
    or_all,
    whole,
)
from gazerig.sim_mock.faults.line import LineFaults

_BYTE_COUNT = whole(0, 1024, "a number of bytes")
_BYTES = Argument("BYTES", _BYTE_COUNT)
_N = Argument("N", _BYTE_COUNT)
_TIMES = Argument("N", count, True)

Do = Callable[..., str]


def answers(kind: str, says: str) -> Do:
    """Return what lets the answers of a servo, or all, suffer; ``says`` shows who and numbers."""

    def do(
        faults: LineFaults,
        servo_id: int | None = None,
        *numbers: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        told = says.format(*numbers, who=faults.who(servo_id))
        return faults.begin(kind, servo_id, told, count, seconds, numbers)

    return do


def everything(kind: str, says: str) -> Do:
    """Return what lets a fault of the whole line begin; ``says`` shows its numbers."""

    def do(
        faults: LineFaults,
        *numbers: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        return faults.begin(kind, None, says.format(*numbers), count, seconds, numbers)

    return do


def times(kind: str, says: str) -> Do:
    """Return what lets the next so many, or all, suffer."""

    def do(faults: LineFaults, count: int | None = None, seconds: float | None = None) -> str:
        return faults.begin(kind, None, says, count, seconds)

    return do


def switched(kind: str, says: str) -> Do:
    """Return what switches a fault of the whole line on or off."""

    def do(faults: LineFaults, on: bool = True, seconds: float | None = None) -> str:
        return faults.switch(kind, on, says, seconds)

    return do


def _noise(
    faults: LineFaults,
    where: str,
    data: bytes | None = None,
    count: int | None = None,
    seconds: float | None = None,
) -> str:
    what = "random bytes" if data is None else data.hex(" ")
    says = f"noise ({what}) {where} answers"
    return faults.begin(f"noise_{where}", None, says, count, seconds, (), data)


def _plug(faults: LineFaults) -> str:
    return faults.switch("unplug", False, "unplugged")


# fmt: off
def line_verbs(one: Argument) -> dict[str, Verb]:
    """Return what can be asked of any line; ``one`` reads an id."""
    who = Argument(one.shown, or_all(one.read))
    return {
        "lose": Verb(answers("lose", "{who} does not answer"), (who,),
                     "stay silent though it obeys", BOTH),
        "delay": Verb(answers("delay", "{who} answers {:g} ms late"), (who, MS),
                      "answer late; in a group those behind wait as well", BOTH),
        "truncate": Verb(answers("truncate", "only {} bytes arrive of what {who} answers"),
                         (who, _BYTES), "only the first BYTES of an answer arrive", BOTH),
        "duplicate": Verb(answers("duplicate", "what {who} answers arrives twice"), (who,),
                          "answers arrive twice", BOTH),
        "corrupt": Verb(answers("corrupt", "a bit flips in what {who} answers"),
                        (who, Argument("BIT", whole(0, 8191, "a bit"), True)),
                        "a bit flips, at random where none is named", BOTH),
        "drop": Verb(answers("drop", "byte {} is lost of what {who} answers"),
                     (who, Argument("BYTE", whole(-1024, 1023, "a byte"))),
                     "byte BYTE of an answer is lost; -1 the last", BOTH),
        "stall": Verb(answers("stall", "{who} stops for {:g} ms half-way through its answer"),
                      (who, MS), "stop half-way through an answer", BOTH),
        "noise": Verb(_noise, (Argument("before|after", one_of("before", "after")),
                               Argument("HEX|random", hex_bytes, True)),
                      "bytes around whatever is answered", BOTH),
        "static": Verb(everything("static", "noise hits {:g} % of all bytes, to and fro"),
                       (Argument("PERCENT", number(0.0, 100.0, "a percentage")),),
                       "so much of all bytes is hit by noise, to and fro", TIME),
        "repeat": Verb(everything("repeat", "the answers of before arrive again before the next"),
                       (), "the last answers come again first", BOTH),
    }


def packet_verbs(one: Argument) -> dict[str, Verb]:
    """Return what can be asked where many servos answer with packets; ``one`` reads an id."""
    who = Argument(one.shown, or_all(one.read))
    return {
        "fragment": Verb(answers("fragment", "a loose header before what {who} answers"),
                         (who._replace(optional=True),),
                         "a loose header before the real one", BOTH),
        "reorder": Verb(everything("reorder", "groups answer in reverse order"), (),
                        "groups answer in reverse order", BOTH),
        "wrong-id": Verb(answers("wrong_id", "{who} answers as {}"),
                         (who, Argument("AS", whole(0, 255, "an id"))), "answer under another id", BOTH),
        "short": Verb(answers("short", "{who} answers {} bytes too few"), (who, _N),
                      "N bytes of data too few, checksum right", BOTH),
        "long": Verb(answers("long", "{who} answers {} bytes too many"), (who, _N),
                     "N bytes of data too many, checksum right", BOTH),
        "refuse": Verb(answers("refuse", "{who} answers with error {} and no data"),
                       (who, Argument("NUMBER", whole(0, 255, "an error number"))),
                       "answer with an error number and no data", BOTH),
        "lose-writes": lost("lose_writes", "group writes"),
    }


def lost(kind: str, what: str) -> Verb:
    """Return what loses things on their way to the device, of which no answer tells."""
    return Verb(times(kind, f"{what} are lost"), (_TIMES,), f"the next N {what} are lost", TIME)


def adapter_verbs() -> dict[str, Verb]:
    """Return what can be asked of the line and adapter as a whole."""
    return {
        "echo": Verb(switched("echo", "the line echoes the host"), (SWITCH,),
                     "the host hears its own bytes", TIME),
        "babble": Verb(switched("babble", "a broken node babbles"), (SWITCH,),
                       "a broken node sends headers and noise all the time", TIME),
        "unplug": Verb(switched("unplug", "unplugged"), (), "pull the adapter out", TIME),
        "plug": Verb(_plug, (), "put the adapter back under its name"),
        "deny": Verb(switched("deny", "opening is forbidden"), (SWITCH,),
                     "opening the port is forbidden", TIME),
        "block": Verb(switched("block", "the adapter takes no bytes"), (SWITCH,),
                      "the adapter takes no bytes", TIME),
    }


def closing_verbs(one: Argument) -> dict[str, Verb]:
    """Return what can be asked of every device; these stand last in its help."""
    return {
        "set": Verb(LineFaults.choose, (Argument("CASE", anything), Argument("VALUE", anything)),
                    "choose where documents and devices differ: see below"),
        "status": Verb(LineFaults.status, (), "all servos and faults as JSON"),
        "clear": Verb(LineFaults.clear, (one._replace(optional=True),),
                      "end faults of answers and line; what servos suffered stays"),
    }
# fmt: on

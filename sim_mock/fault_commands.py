"""Fault commands as lines of text: ``lose 3 count 2``, ``unplug for 0.5``, ``help``.

A table of verbs; each takes words of named kinds and calls the method of ``Faults`` that
does it.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from sim_mock.line_faults import Faults
from sim_mock.servo_habits import cases

EVERYBODY = ("all", "*")


class Word(NamedTuple):
    """One word of a command: how it is shown, and how it is understood."""

    shown: str
    read: Callable[[str], Any]
    optional: bool = False


class Verb(NamedTuple):
    """One command. lasting: it may end with ``count N`` and ``for S``."""

    do: Callable[..., str]
    words: tuple[Word, ...]
    says: str
    lasting: tuple[str, ...] = ()


def _number(low: float, high: float, what: str) -> Callable[[str], float]:
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise ValueError(f"{text!r} is not {what} from {low:g} to {high:g}")
        return value

    return read


def _whole(low: int, high: int, what: str) -> Callable[[str], int]:
    def read(text: str) -> int:
        try:
            value = int(text, 0)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise ValueError(f"{text!r} is not {what} from {low} to {high}")
        return value

    return read


def _servo(text: str) -> int:
    return _whole(0, 252, "a servo id")(text)


def _servo_or_all(text: str) -> int | None:
    return None if text in EVERYBODY else _servo(text)


def _on_off(text: str) -> bool:
    if text not in ("on", "off"):
        raise ValueError(f"{text!r} is neither on nor off")
    return text == "on"


def _where(text: str) -> str:
    if text not in ("before", "after"):
        raise ValueError(f"{text!r} is neither before nor after")
    return text


def _bytes(text: str) -> bytes | None:
    if text == "random":
        return None
    try:
        return bytes.fromhex(text)
    except ValueError:
        raise ValueError(f"{text!r} is neither random nor bytes in hex such as FFFF00") from None


def _any(text: str) -> str:
    return text


_ID = Word("ID", _servo)
_WHO = Word("ID", _servo_or_all)
_MS = Word("MS", _number(0.0, 60_000.0, "milliseconds"))
_SWITCH = Word("on|off", _on_off, True)
_BOTH = ("count", "for")
_TIME = ("for",)
_COUNT = _whole(1, 1_000_000, "a number of answers")
_BYTES = _whole(0, 1024, "a number of bytes")

# fmt: off
VERBS: dict[str, Verb] = {
    "lose": Verb(Faults.lose, (_WHO,), "stay silent though it obeys", _BOTH),
    "delay": Verb(Faults.delay, (_WHO, _MS), "answer late", _BOTH),
    "truncate": Verb(Faults.truncate, (_WHO, Word("BYTES", _BYTES)),
                     "only the first BYTES of an answer arrive", _BOTH),
    "duplicate": Verb(Faults.duplicate, (_WHO,), "answers arrive twice", _BOTH),
    "corrupt": Verb(Faults.corrupt, (_WHO, Word("BIT", _whole(0, 8191, "a bit"), True)),
                    "a bit flips, by dice where none is named", _BOTH),
    "drop": Verb(Faults.drop, (_WHO, Word("BYTE", _whole(-1024, 1023, "a byte"))),
                 "byte BYTE of an answer is lost; -1 the last", _BOTH),
    "stall": Verb(Faults.stall, (_WHO, _MS), "stop half-way through an answer", _BOTH),
    "noise": Verb(Faults.noise, (Word("before|after", _where), Word("HEX|random", _bytes, True)),
                  "bytes around whatever is answered", _BOTH),
    "fragment": Verb(Faults.fragment, (_WHO._replace(optional=True),),
                     "a loose FF FF FD 00 before the real header", _BOTH),
    "reorder": Verb(Faults.reorder, (), "groups answer in reverse order", _BOTH),
    "wrong-id": Verb(Faults.wrong_id, (_WHO, Word("AS", _whole(0, 255, "an id"))),
                     "answer under another id", _BOTH),
    "short": Verb(Faults.short, (_WHO, Word("N", _BYTES)),
                  "N bytes of data too few, CRC right", _BOTH),
    "long": Verb(Faults.long, (_WHO, Word("N", _BYTES)),
                 "N bytes of data too many, CRC right", _BOTH),
    "refuse": Verb(Faults.refuse, (_WHO, Word("NUMBER", _whole(0, 255, "an error number"))),
                   "answer with an error number and no data", _BOTH),
    "lose-writes": Verb(Faults.lose_writes, (Word("N", _COUNT, True),),
                        "the next N group writes are lost on their way", _TIME),
    "echo": Verb(Faults.echo, (_SWITCH,), "the host hears its own bytes", _TIME),
    "babble": Verb(Faults.babble, (_SWITCH,), "a broken node sends all the time", _TIME),
    "unplug": Verb(Faults.unplug, (), "pull the adapter out", _TIME),
    "plug": Verb(Faults.plug, (), "put the adapter back under its name"),
    "deny": Verb(Faults.deny, (_SWITCH,), "opening the port is forbidden", _TIME),
    "block": Verb(Faults.block, (_SWITCH,), "the adapter takes no bytes", _TIME),
    "collide": Verb(Faults.collide, (_ID,), "a second servo with this id joins the bus"),
    "overload": Verb(Faults.overload, (_ID,), "latch the overload error"),
    "overheat": Verb(Faults.overheat, (_ID,), "latch the overheating error"),
    "encoder": Verb(Faults.encoder, (_ID,), "latch the encoder error"),
    "shock": Verb(Faults.shock, (_ID,), "latch the electrical shock error"),
    "brown-out": Verb(Faults.brown_out, (_ID,), "restart as a dip of the supply makes it"),
    "reset": Verb(Faults.reset, (_ID,), "as from the factory: id 1, 57600 baud; needs torque off"),
    "voltage": Verb(Faults.voltage, (_WHO, Word("V", _number(0.0, 30.0, "volts"))),
                    "supply with another voltage"),
    "temperature": Verb(Faults.temperature, (_WHO, Word("C", _number(-40.0, 200.0, "degC"))),
                        "give the motor a temperature; it drifts on by itself"),
    "stick": Verb(Faults.stick, (_WHO,), "jam the joint where it is"),
    "free": Verb(Faults.free, (_WHO,), "let a jammed joint go"),
    "load": Verb(Faults.load, (_WHO, Word("NM", _number(-100.0, 100.0, "Nm"))),
                 "hang a constant torque on the joint"),
    "turn": Verb(Faults.turn, (_WHO, Word("STEPS", _number(-1e6, 1e6, "steps"))),
                 "turn the joint by hand"),
    "set": Verb(Faults.choose, (Word("CASE", _any), Word("VALUE", _any)),
                "choose where documents and devices differ: see below"),
    "status": Verb(Faults.status, (), "all servos and faults as JSON"),
    "clear": Verb(Faults.clear, (_ID._replace(optional=True),),
                  "end faults of answers and line; what servos suffered stays"),
}
# fmt: on


def obey(faults: Faults, text: str) -> str:
    """Carry out one line; gives what was done.

    Raises:
        ValueError: names the word that is wrong and what would be right.
    """
    words = text.split()
    if not words or words[0] == "help":
        return help_text(words[1] if len(words) > 1 else None)
    name, rest = words[0].replace("_", "-"), words[1:]
    verb = VERBS.get(name)
    if verb is None:
        raise ValueError(f"{words[0]!r} is no command; there is {', '.join(VERBS)}, help")
    try:
        rest, lasting = _lasting(verb, rest)
        given = _arguments(verb, rest)
        return verb.do(faults, *given, **lasting)
    except (KeyError, ValueError) as error:
        raise ValueError(f"{name}: {error.args[0]}; usage: {usage(name)}") from None


def _lasting(verb: Verb, words: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """Take ``count N`` and ``for S`` off the end."""
    left, found = list(words), dict[str, Any]()
    while len(left) >= 2 and left[-2] in _BOTH:
        value, word = left.pop(), left.pop()
        if word not in verb.lasting:
            raise ValueError(f"{word!r} has no meaning here")
        if word == "count":
            found["count"] = _COUNT(value)
        else:
            found["seconds"] = _number(0.0, 1e6, "seconds")(value)
    return left, found


def _arguments(verb: Verb, words: Sequence[str]) -> list[Any]:
    needed = [word for word in verb.words if not word.optional]
    if len(words) < len(needed):
        raise ValueError(f"{needed[len(words)].shown} is missing")
    if len(words) > len(verb.words):
        raise ValueError(f"{words[len(verb.words)]!r} is too much")
    return [word.read(text) for word, text in zip(verb.words, words, strict=False)]


def usage(name: str) -> str:
    """Show how a command is typed."""
    verb = VERBS[name]
    shown = [f"[{w.shown}]" if w.optional else w.shown for w in verb.words]
    ends = {"count": "[count N]", "for": "[for SECONDS]"}
    return " ".join([name, *shown, *(ends[word] for word in verb.lasting)])


def help_text(name: str | None = None) -> str:
    """Explain one command or all of them, one a line."""
    if name is not None and name in VERBS:
        return f"{usage(name)}: {VERBS[name].says}"
    lines = [f"{usage(verb):46} {VERBS[verb].says}" for verb in VERBS]
    lines.append("ID is a servo's id or all; a fault lasts until clear, or as [..] says; set takes")
    lines += [f"  {case} {values}" for case, values in cases().items()]
    return "\n".join(lines)

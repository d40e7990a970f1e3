"""What can be asked of an emulated line as text, in the parts that devices choose from."""

from gazerig.sim_mock.faults.grammar import (
    BOTH,
    MS,
    SWITCH,
    TIME,
    Verb,
    Word,
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
_BYTES = Word("BYTES", _BYTE_COUNT)
_N = Word("N", _BYTE_COUNT)


# fmt: off
def line_verbs(one: Word) -> dict[str, Verb]:
    """Return what can be asked of any line; ``one`` reads an id."""
    who = Word(one.shown, or_all(one.read))
    return {
        "lose": Verb(LineFaults.lose, (who,), "stay silent though it obeys", BOTH),
        "delay": Verb(LineFaults.delay, (who, MS), "answer late", BOTH),
        "truncate": Verb(LineFaults.truncate, (who, _BYTES),
                         "only the first BYTES of an answer arrive", BOTH),
        "duplicate": Verb(LineFaults.duplicate, (who,), "answers arrive twice", BOTH),
        "corrupt": Verb(LineFaults.corrupt, (who, Word("BIT", whole(0, 8191, "a bit"), True)),
                        "a bit flips, at random where none is named", BOTH),
        "drop": Verb(LineFaults.drop, (who, Word("BYTE", whole(-1024, 1023, "a byte"))),
                     "byte BYTE of an answer is lost; -1 the last", BOTH),
        "stall": Verb(LineFaults.stall, (who, MS), "stop half-way through an answer", BOTH),
        "noise": Verb(LineFaults.noise, (Word("before|after", one_of("before", "after")),
                                         Word("HEX|random", hex_bytes, True)),
                      "bytes around whatever is answered", BOTH),
        "static": Verb(LineFaults.static, (Word("PERCENT", number(0.0, 100.0, "a percentage")),),
                       "so much of all bytes is hit by noise, to and fro", TIME),
        "repeat": Verb(LineFaults.repeat, (), "the last answers come again first", BOTH),
    }


def packet_verbs(one: Word) -> dict[str, Verb]:
    """Return what can be asked where many servos answer with packets; ``one`` reads an id."""
    who = Word(one.shown, or_all(one.read))
    return {
        "fragment": Verb(LineFaults.fragment, (who._replace(optional=True),),
                         "a loose header before the real one", BOTH),
        "reorder": Verb(LineFaults.reorder, (), "groups answer in reverse order", BOTH),
        "wrong-id": Verb(LineFaults.wrong_id, (who, Word("AS", whole(0, 255, "an id"))),
                         "answer under another id", BOTH),
        "short": Verb(LineFaults.short, (who, _N), "N bytes of data too few, checksum right", BOTH),
        "long": Verb(LineFaults.long, (who, _N), "N bytes of data too many, checksum right", BOTH),
        "refuse": Verb(LineFaults.refuse, (who, Word("NUMBER", whole(0, 255, "an error number"))),
                       "answer with an error number and no data", BOTH),
        "lose-writes": Verb(LineFaults.lose_writes, (Word("N", count, True),),
                            "the next N group writes are lost on their way", TIME),
    }


def adapter_verbs() -> dict[str, Verb]:
    """Return what can be asked of the line and adapter as a whole."""
    return {
        "echo": Verb(LineFaults.echo, (SWITCH,), "the host hears its own bytes", TIME),
        "babble": Verb(LineFaults.babble, (SWITCH,), "a broken node sends all the time", TIME),
        "unplug": Verb(LineFaults.unplug, (), "pull the adapter out", TIME),
        "plug": Verb(LineFaults.plug, (), "put the adapter back under its name"),
        "deny": Verb(LineFaults.deny, (SWITCH,), "opening the port is forbidden", TIME),
        "block": Verb(LineFaults.block, (SWITCH,), "the adapter takes no bytes", TIME),
    }


def closing_verbs(one: Word) -> dict[str, Verb]:
    """Return what can be asked of every device; these stand last in its help."""
    return {
        "set": Verb(LineFaults.choose, (Word("CASE", anything), Word("VALUE", anything)),
                    "choose where documents and devices differ: see below"),
        "status": Verb(LineFaults.status, (), "all servos and faults as JSON"),
        "clear": Verb(LineFaults.clear, (one._replace(optional=True),),
                      "end faults of answers and line; what servos suffered stays"),
    }
# fmt: on

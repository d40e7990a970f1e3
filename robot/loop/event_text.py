"""Short texts of bus events: events of several servos are grouped into one line."""

import re
from collections.abc import Iterable, Sequence

_SERVO = re.compile(r"servo (\d+)")
_REGISTER = re.compile(r": .+ (-?\d+ -> -?\d+|set)$")


def group_events(events: Iterable[str]) -> list[str]:
    """Group events that differ only in their servo, e.g. "servos 1-9: Return Delay Time 250 -> 0".

    An event is "neck_yaw (servo 7): what" or "servo 7: what"; other texts stay unchanged.
    """
    whose: dict[str, list[str]] = {}
    for event in events:
        who, colon, what = event.partition(": ")
        whose.setdefault(what if colon else event, []).append(who if colon else "")
    lines = []
    for what, names in whose.items():
        ids = [int(found[1]) for name in names if (found := _SERVO.search(name))]
        several = len(names) > 1 and len(ids) == len(names)
        who = f"servos {format_ranges(ids)}" if several else ", ".join(filter(None, names))
        lines.append(f"{who}: {what}" if who else what)
    return lines


def is_register_change(event: str) -> bool:
    """Return whether an event only reports that a register of a servo was set."""
    return _REGISTER.search(event) is not None


def format_ranges(numbers: Sequence[int]) -> str:
    """Format numbers with runs joined: 1-3, 7."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{r[0]}-{r[-1]}" if len(r) > 1 else f"{r[0]}" for r in runs)

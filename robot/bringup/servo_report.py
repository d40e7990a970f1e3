"""What scan and doctor have found, in words and in plain values; printed by the command line."""

import re
from collections.abc import Iterator, Sequence

from drivers.dynamixel_scan import Found, Round
from robot.bringup.findings import LEVELS, Finding, Level

_JOINT = re.compile(r"(\w+) \(servo (\d+)\)")


def servo_plain(servo: Found) -> dict[str, object]:
    """Give a servo as JSON can hold it."""
    return {**servo._asdict(), "model": servo.model}


def remarks(rounds: Sequence[Round], found: Sequence[Found], where: str) -> Iterator[str]:
    """Say what a table of servos does not."""
    count = f"{len(found)} servo{'s' if len(found) != 1 else ''}"
    asked = ", ".join(str(one.baud) for one in rounds if one.possible)
    yield f"{count} on {where}; asked at {asked} bit/s"
    for one in rounds:
        twice = {servo.id for servo in one.found if one.found.count(servo) > 1}
        for servo_id in sorted({*one.shared, *twice}):
            yield (
                f"two or more servos have id {servo_id} at {one.baud} bit/s: connect them one at a "
                "time and run gazerig setup"
            )
        if one.protocol_1:
            ids = ", ".join(map(str, one.protocol_1))
            yield (
                f"at {one.baud} bit/s something answers in Protocol 1 as id {ids}: another maker's "
                "servo, or one whose Protocol Type must be set to 2 with Dynamixel Wizard 2.0"
            )
        elif one.junk and not one.found:
            yield (
                f"at {one.baud} bit/s only pieces came: a wrong rate, a loose plug, or two servos "
                "with one id"
            )
    if not found:
        yield (
            "nobody answers: is the servo supply on? does each servo's LED flash once when it "
            "comes on? is the first cable in the adaptor's 3-pin TTL plug? is another program "
            "using the port?"
        )


def grouped(findings: Sequence[Finding]) -> list[tuple[Level, str, str, str]]:
    """Give level, places, what and cure, the worst first; the same at several places once."""
    groups: dict[tuple[Level, str, str], list[str]] = {}
    for finding in findings:
        groups.setdefault((finding.level, finding.what, finding.cure), []).append(finding.where)
    told = [(level, together(at), what, cure) for (level, what, cure), at in groups.items()]
    return sorted(told, key=lambda row: -LEVELS.index(row[0]))


def together(places: Sequence[str]) -> str:
    """Name several places; joints first, then their servos: "a, b, c (servos 1-3)"."""
    found = [_JOINT.fullmatch(place) for place in places]
    if len(places) == 1 or None in found:
        return ", ".join(places)
    names = ", ".join(match[1] for match in found if match)
    return f"{names} (servos {runs([int(match[2]) for match in found if match])})"


def runs(numbers: Sequence[int]) -> str:
    """Write numbers with neighbours drawn together: 1-3, 7."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{r[0]}-{r[-1]}" if len(r) > 1 else f"{r[0]}" for r in runs)


def as_plain(finding: Finding) -> dict[str, object]:
    return {
        "level": finding.level,
        "where": finding.where,
        "what": finding.what,
        "cure": finding.cure,
        "fixes": [fix._asdict() for fix in finding.fixes],
    }


def summed_up(findings: Sequence[Finding], rig: str, fixed: bool) -> str:
    counts = [(level, sum(f.level == level for f in findings)) for level in reversed(LEVELS)]
    words = ", ".join(f"{count} {level}" for level, count in counts if count)
    fixable = sum(bool(finding.fixes) for finding in findings)
    offer = f"; gazerig doctor {rig} --fix mends {fixable} of them" if fixable and not fixed else ""
    return f"{rig}: {words}{offer}"

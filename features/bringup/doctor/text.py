"""What a doctor has found, in words and in plain values; printed by the command line."""

import re
from collections.abc import Sequence

from gazerig.features.bringup.doctor.diagnostics import LEVELS, Diagnostic, Level
from gazerig.robot.control.event_text import runs

_JOINT = re.compile(r"(\w+) \((servo|channel) (\d+)\)")


def grouped(findings: Sequence[Diagnostic]) -> list[tuple[Level, str, str, str]]:
    """Return level, places, what and remedy, the worst first; the same at several places once."""
    groups: dict[tuple[Level, str, str], list[str]] = {}
    for finding in findings:
        groups.setdefault((finding.level, finding.what, finding.remedy), []).append(finding.where)
    rows = [(level, together(at), what, cure) for (level, what, cure), at in groups.items()]
    return sorted(rows, key=lambda row: -LEVELS.index(row[0]))


def together(places: Sequence[str]) -> str:
    """Name several places; joints first, then their servos: "a, b, c (servos 1-3)"."""
    found = [match for place in places if (match := _JOINT.fullmatch(place))]
    nouns = {match[2] for match in found}
    if len(places) == 1 or len(found) < len(places) or len(nouns) > 1:
        return ", ".join(places)
    names = ", ".join(match[1] for match in found)
    return f"{names} ({nouns.pop()}s {runs([int(match[3]) for match in found])})"


def as_plain(finding: Diagnostic, bus: str) -> dict[str, object]:
    """Return a finding as JSON can hold it; bus: the name of its bus, "" for the main one."""
    return {
        "bus": bus,
        "level": finding.level,
        "where": finding.where,
        "what": finding.what,
        "cure": finding.remedy,
        "fixes": [fix._asdict() for fix in finding.fixes],
    }


def summed_up(findings: Sequence[Diagnostic], rig: str, fixed: bool) -> str:
    """Count findings by level, and offer what --fix may do."""
    counts = [(level, sum(f.level == level for f in findings)) for level in reversed(LEVELS)]
    text = ", ".join(f"{count} {level}" for level, count in counts if count)
    fixable = sum(bool(finding.fixes) for finding in findings)
    offer = f"; gazerig doctor --fix mends {fixable} of them" if fixable and not fixed else ""
    return f"{rig}: {text}{offer}"

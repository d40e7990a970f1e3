"""Findings of an examination as values (level, fact, place, remedy), and their texts."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from gazerig.robot.control.event_text import format_ranges

Level = Literal["ok", "note", "warn", "error"]
LEVELS: tuple[Level, ...] = ("ok", "note", "warn", "error")

_JOINT = re.compile(r"(\w+) \((servo|channel) (\d+)\)")


class Fix(NamedTuple):
    """Write to one register that repairs a fault and moves nothing.

    was: the previous value, None if it could not be read
    """

    servo_id: int
    register: str
    value: int
    was: int | None = None

    def __str__(self) -> str:
        """Write ``return delay time 250 -> 0``."""
        was = "?" if self.was is None else self.was
        return f"{self.register.replace('_', ' ')} {was} -> {self.value}"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding.

    level: ok, note (useful to know), warn (works, but not well), error (does not work)
    what: the fact; where: port, joint or file; remedy: remedy, "" if none is needed
    fixes: writes that ``--fix`` may apply
    """

    level: Level
    what: str
    where: str
    remedy: str = ""
    fixes: tuple[Fix, ...] = ()

    def __str__(self) -> str:
        """Write it on one line."""
        return f"{self.level}: {self.where}: {self.what}{f': {self.remedy}' if self.remedy else ''}"


class Advice(NamedTuple):
    """Row of a table of findings; the texts have fields for ``str.format``."""

    level: Level
    what: str
    remedy: str = ""

    def at(self, where: str, *fixes: Fix, **facts: object) -> Diagnostic:
        """Return the finding for a place.

        facts: values of the fields of the texts
        """
        what, remedy = self.what.format(**facts), self.remedy.format(**facts)
        return Diagnostic(self.level, what, where, remedy, fixes)


def worst_level(findings: Iterable[Diagnostic]) -> Level:
    """Return the worst level, "ok" without findings."""
    return max((finding.level for finding in findings), key=LEVELS.index, default="ok")


def group_findings(findings: Sequence[Diagnostic]) -> list[tuple[Level, str, str, str]]:
    """Return level, places, what and remedy, the worst first; equal findings are one row."""
    groups: dict[tuple[Level, str, str], list[str]] = {}
    for finding in findings:
        groups.setdefault((finding.level, finding.what, finding.remedy), []).append(finding.where)
    rows = [(level, join_places(at), what, cure) for (level, what, cure), at in groups.items()]
    return sorted(rows, key=lambda row: -LEVELS.index(row[0]))


def join_places(places: Sequence[str]) -> str:
    """Join the names of several places; joints first, then servos: "a, b, c (servos 1-3)"."""
    found = [match for place in places if (match := _JOINT.fullmatch(place))]
    nouns = {match[2] for match in found}
    if len(places) == 1 or len(found) < len(places) or len(nouns) > 1:
        return ", ".join(places)
    names = ", ".join(match[1] for match in found)
    return f"{names} ({nouns.pop()}s {format_ranges([int(match[3]) for match in found])})"


def finding_json(finding: Diagnostic, bus: str) -> dict[str, object]:
    """Return a finding as JSON values; bus: the name of its bus, "" for the main one."""
    return {
        "bus": bus,
        "level": finding.level,
        "where": finding.where,
        "what": finding.what,
        "cure": finding.remedy,
        "fixes": [fix._asdict() for fix in finding.fixes],
    }


def summarize(findings: Sequence[Diagnostic], rig: str, fixed: bool) -> str:
    """Count findings by level, and list the fixes that --fix may apply."""
    counts = [(level, sum(f.level == level for f in findings)) for level in reversed(LEVELS)]
    text = ", ".join(f"{count} {level}" for level, count in counts if count)
    fixable = sum(bool(finding.fixes) for finding in findings)
    offer = f"; gazerig doctor --fix mends {fixable} of them" if fixable and not fixed else ""
    return f"{rig}: {text}{offer}"

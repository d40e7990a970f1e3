"""Findings of an examination as values (level, fact, place, remedy), and the table of their texts.

``advice.yaml`` has the texts, and the settings that a servo of each family should have.
"""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

import msgspec

Level = Literal["ok", "note", "warn", "error"]
LEVELS: tuple[Level, ...] = ("ok", "note", "warn", "error")

FIX = "gazerig doctor RIG --fix"

_JOINT = re.compile(r"(\w+) \((servo|channel) (\d+)\)")


class Fix(msgspec.Struct, frozen=True):
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


class Diagnostic(msgspec.Struct, frozen=True):
    """One finding.

    level: ok, note (useful to know), warn (works, but not well), error (does not work)
    what: the fact; where: port, joint or file; remedy: remedy, "" if none is needed
    fixes: writes that ``--fix`` may apply; bus: name of its bus, "" for the main one
    """

    level: Level
    what: str
    where: str
    remedy: str = ""
    fixes: tuple[Fix, ...] = ()
    bus: str = ""


class Advice(msgspec.Struct, frozen=True, kw_only=True):
    """Row of the table of findings; the texts have fields for ``str.format``."""

    level: Level
    what: str
    remedy: str = ""

    def at(self, where: str, *fixes: Fix, **facts: object) -> Diagnostic:
        """Return the finding for a place.

        facts: values of the fields of the texts
        """
        what, remedy = self.what.format(**facts), self.remedy.format(**facts)
        return Diagnostic(self.level, what, where, remedy, fixes)


class Setting(Advice, frozen=True, kw_only=True):
    """Setting that a servo should have.

    value: correct value of the register, within ``mask``
    least, most: values between them are also correct
    fix: whether ``--fix`` may write it
    blocks: whether a joint is not calibrated with another value
    unit: factor for {scaled} in the texts
    """

    register: str
    value: int
    mask: int = ~0
    least: int | None = None
    most: int | None = None
    fix: bool = False
    blocks: bool = False
    unit: float = 1.0

    def accepts(self, found: int) -> bool:
        """Return whether the value of the register is correct."""
        if self.least is None and self.most is None:
            return found & self.mask == self.value
        above = self.least is None or found >= self.least
        return above and (self.most is None or found <= self.most)


class FamilyAdvice(msgspec.Struct, frozen=True):
    """Properties of a family of servos for the doctor; see ``advice.yaml``."""

    program: str
    manual: str
    out_of_voltage: str
    registers: tuple[str, ...]
    errors: dict[str, str]
    settings: tuple[Setting, ...]
    no_reply: str
    note: str = ""


class _Tables(msgspec.Struct, frozen=True):
    servos: dict[str, Advice]
    bus: dict[str, Advice]
    registers: tuple[str, ...]
    families: dict[str, FamilyAdvice]
    maestro: dict[str, str]
    boards: dict[str, Advice]


ADVICE = msgspec.yaml.decode((Path(__file__).parent / "advice.yaml").read_bytes(), type=_Tables)


def worst_level(findings: Iterable[Diagnostic]) -> Level:
    """Return the worst level, "ok" without findings."""
    return max((finding.level for finding in findings), key=LEVELS.index, default="ok")


def has_fault(findings: Iterable[Diagnostic]) -> bool:
    """Return whether any finding is more than a note."""
    return worst_level(findings) in ("warn", "error")


def group_findings(findings: Sequence[Diagnostic]) -> list[tuple[Level, str, str, str]]:
    """Return level, places, what and remedy, the worst first; equal findings are one row."""
    groups: dict[tuple[Level, str, str], list[str]] = {}
    for finding in findings:
        groups.setdefault((finding.level, finding.what, finding.remedy), []).append(finding.where)
    rows = [(level, join_places(at), what, cure) for (level, what, cure), at in groups.items()]
    return sorted(rows, key=lambda row: -LEVELS.index(row[0]))


def join_places(places: Sequence[str]) -> str:
    """Join the names of several places; joints first, then servos: "a, b (servos 1, 2)"."""
    found = [match for place in places if (match := _JOINT.fullmatch(place))]
    nouns = {match[2] for match in found}
    if len(places) == 1 or len(found) < len(places) or len(nouns) > 1:
        return ", ".join(places)
    names = ", ".join(match[1] for match in found)
    return f"{names} ({nouns.pop()}s {', '.join(match[3] for match in found)})"


def summarize(findings: Sequence[Diagnostic], rig: str, fixed: bool) -> str:
    """Count findings by level, and list the fixes that --fix may apply."""
    counts = [(level, sum(f.level == level for f in findings)) for level in reversed(LEVELS)]
    text = ", ".join(f"{count} {level}" for level, count in counts if count)
    fixable = sum(bool(finding.fixes) for finding in findings)
    offer = f"; gazerig doctor RIG --fix mends {fixable} of them" if fixable and not fixed else ""
    return f"{rig}: {text}{offer}"

"""The list of lines to break on purpose fits the sources and the checks as they are now."""

import re
from functools import cache
from pathlib import Path

from features_there import EVERY_FEATURE
from mutants import ALL

ROOT = Path(__file__).parents[1]


@cache
def text_of(file: str) -> str:
    """Return the text of a file."""
    return (ROOT / file).read_text(encoding="utf-8")


def test_a_mutant_breaks_one_place_that_named_tests_judge() -> None:
    files = {path.stem: str(path.relative_to(ROOT)) for path in ROOT.glob("tests/**/test_*.py")}
    wrong = []
    for mutant in ALL:
        names = [name.partition("::") for name in mutant.tests]
        there = (ROOT / mutant.file).exists() and all(f"test_{one[0]}" in files for one in names)
        if not there and not EVERY_FEATURE:
            continue
        fits = there and text_of(mutant.file).count(mutant.old) == 1 and mutant.new != mutant.old
        defined = fits and all(
            not function or re.search(rf"^ *def {function}\(", text_of(files[f"test_{stem}"]), re.M)
            for stem, _, function in names
        )
        if not (names and defined):
            wrong.append(mutant)
    assert wrong == []


def test_no_two_mutants_are_one() -> None:
    assert len({(mutant.file, mutant.old, mutant.new) for mutant in ALL}) == len(ALL)


def claims() -> dict[str, set[str]]:
    """Return the rows of both papers, and the tests that each names: test files, or functions."""
    found: dict[str, set[str]] = {}
    for line in (ROOT / "docs/checks.md").read_text("utf-8").splitlines():
        if number := re.match(r"\| ([ESRBA]\d+) \|", line):
            assert number[1] not in found, f"{number[1]} twice"
            found[number[1]] = set(re.findall(r"\btest_(\w+)", line.rsplit("|", 2)[1]))
    table = (ROOT / "docs/gaze.md").read_text("utf-8").split("| paper | item |")[1]
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) == 6 and not cells[1].startswith("-") and cells[4].startswith("test_"):
            found[f"{cells[1]}: {cells[2]}"] = set(cells[4].split(", "))
    sections = re.findall(r"^## (.+)$", (ROOT / "docs/gaze.md").read_text("utf-8"), re.M)
    found |= {title: set() for title in sections[: sections.index("Profiles and characters")]}
    return found


def test_every_claim_has_a_mutant_that_its_tests_notice() -> None:
    named = claims()
    assert len(named) > 180
    assert {row for mutant in ALL for row in mutant.rows} == set(named)
    for mutant in ALL:
        for row in mutant.rows:
            parts = {part for test in mutant.tests for part in test.split("::")}
            assert not named[row] or parts & named[row], (
                f"{row} names none of {', '.join(mutant.tests)}"
            )

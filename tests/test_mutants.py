"""The list of lines to break on purpose fits the sources as they are now."""

from pathlib import Path

import pytest
from mutants import ALL, Mutant

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("mutant", ALL, ids=lambda mutant: mutant.effect)
def test_a_mutant_breaks_one_place_that_named_tests_judge(mutant: Mutant) -> None:
    source = (ROOT / mutant.file).read_text(encoding="utf-8")
    assert source.count(mutant.old) == 1 and mutant.new != mutant.old
    assert mutant.tests
    missing = [name for name in mutant.tests if not (ROOT / f"tests/test_{name}.py").is_file()]
    assert not missing


def test_no_two_mutants_are_one() -> None:
    assert len({(mutant.file, mutant.old, mutant.new) for mutant in ALL}) == len(ALL)

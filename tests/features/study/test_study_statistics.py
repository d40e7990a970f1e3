"""Tests of statistics: values of pingouin 0.7.0, enumeration, and known results."""

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

GOLDEN = Path(__file__).parents[2] / "golden"


@pytest.fixture
def s() -> Any:
    from gazerig.features.study import analyse

    return analyse


def test_p_values_equal_those_of_pingouin(s):
    for one in json.loads((GOLDEN / "study_p_values.json").read_text())["sets"]:
        rows, figures = np.array(one["ratings"]), one["pingouin"]
        than, better = rows[:, 0].astype(float), rows[:, 1].astype(float)
        signed, summed = s.signed_rank_test(better, than), s.rank_sum_test(better, than)
        counted = s.chi_square_test(better, than)
        assert [signed.p, signed.effect, summed.p, summed.effect] == pytest.approx(
            [figures[key] for key in ("signed_rank wilcox two-sided", "matched correlation",
                                      "rank_sum two-sided", "dominance")], abs=1e-9
        )  # fmt: skip
        assert [counted.p, counted.effect] == pytest.approx(
            [figures["chi_square"], figures["cramers_v"]], abs=1e-9
        )


def test_exact_p_values_are_those_of_all_signs(s):
    rng = np.random.default_rng(5)
    for _ in range(20):
        scores = rng.integers(-6, 7, 8) / 2.0
        sums = [np.dot(signs, scores) for signs in itertools.product((-1, 1), repeat=8)]
        above = np.mean(np.array(sums) >= scores.sum())
        below = np.mean(np.array(sums) <= scores.sum())
        assert s.exact_sign_p(scores) == pytest.approx(min(1.0, 2.0 * min(above, below)))


def test_holms_correction(s):
    assert s.correct_p_values([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert s.correct_p_values([0.9, 0.8]) == [1.0, 1.0]

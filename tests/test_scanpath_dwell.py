"""The dwell laws against the mean and standard deviation they are given."""

import numpy as np
import pytest

from gazerig.gaze.scanpath.dwell import dwell_distribution
from gazerig.gaze.scanpath.scanpath import Walk
from gazerig.gaze.types import PARTS


@pytest.fixture(params=PARTS)
def mean_and_sd_s(request: pytest.FixtureRequest, printed_walk: Walk) -> tuple[float, float]:
    """A row of Table 1."""
    row = printed_walk.order.index(request.param)
    return printed_walk.dwell_mean_s[row], printed_walk.dwell_sd_s[row]


def drawn(law: str, mean_s: float, sd_s: float, count: int = 50_000) -> np.ndarray:
    draw, rng = dwell_distribution(law, mean_s, sd_s), np.random.default_rng(1)
    return np.array([draw(rng) for _ in range(count)])


@pytest.mark.parametrize("law", ["lognormal", "gamma"])
def test_e40_lognormal_and_gamma_keep_mean_and_sd(
    law: str, mean_and_sd_s: tuple[float, float]
) -> None:
    mean_s, sd_s = mean_and_sd_s
    times = drawn(law, mean_s, sd_s, 100_000)
    assert times.min() > 0.0
    assert times.mean() == pytest.approx(mean_s, rel=0.04)
    assert times.std() == pytest.approx(sd_s, rel=0.10)


@pytest.mark.parametrize("sd_s", [0.002, 0.04, 0.1, 0.15, 0.18, 0.195])
def test_truncated_normal_keeps_mean_and_sd_while_sd_is_below_mean(sd_s: float) -> None:
    times = drawn("truncated_normal", 0.2, sd_s)
    assert times.min() > 0.0
    assert times.mean() == pytest.approx(0.2, rel=0.02)
    assert times.std() == pytest.approx(sd_s, rel=0.02)


def test_truncated_normal_of_half_a_bell_is_one() -> None:
    # Cut at its own mean: mean sqrt(2/pi), SD sqrt(1 - 2/pi) of the uncut SD; median .6745.
    times = drawn("truncated_normal", 0.797885, 0.602810)
    assert np.median(times) == pytest.approx(0.6745, abs=0.01)
    assert np.quantile(times, 0.9) == pytest.approx(1.6449, abs=0.02)


def test_truncated_normal_of_table_1_is_exponential(mean_and_sd_s: tuple[float, float]) -> None:
    mean_s, sd_s = mean_and_sd_s
    times = drawn("truncated_normal", mean_s, sd_s)
    assert times.min() > 0.0
    assert times.mean() == pytest.approx(mean_s, rel=0.02)
    assert times.std() == pytest.approx(mean_s, rel=0.03)
    assert np.median(times) == pytest.approx(mean_s * np.log(2.0), rel=0.03)


def test_uniform_spans_mean_and_sd_and_stays_positive(mean_and_sd_s: tuple[float, float]) -> None:
    mean_s, sd_s = mean_and_sd_s
    times = drawn("uniform", mean_s, sd_s, 20_000)
    assert 0.0 < times.min() < 0.01
    assert times.max() == pytest.approx(mean_s + sd_s, rel=0.01)
    assert times.mean() == pytest.approx(0.5 * (mean_s + sd_s), rel=0.03)


def test_uniform_with_a_small_sd_is_the_plain_interval() -> None:
    times = drawn("uniform", 0.3, 0.1, 20_000)
    assert times.min() == pytest.approx(0.2, abs=1e-3)
    assert times.max() == pytest.approx(0.4, abs=1e-3)


@pytest.mark.parametrize("law", ["lognormal", "gamma", "truncated_normal", "uniform"])
def test_without_spread_every_law_gives_the_mean(law: str) -> None:
    assert set(drawn(law, 0.25, 0.0, 10)) == {0.25}


def test_an_unknown_law_is_named() -> None:
    with pytest.raises(ValueError, match="no dwell law 'normal'; there are lognormal, gamma"):
        dwell_distribution("normal", 0.2, 0.1)

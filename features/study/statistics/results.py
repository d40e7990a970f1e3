"""Results of a test: statistic, probabilities, effect with its interval, and notes."""

from dataclasses import dataclass
from math import isfinite, nan
from typing import NamedTuple

from gazerig.features.study.design import Test


class EffectSize(NamedTuple):
    """An effect with its 95 % interval, nan without one.

    name: in words; symbol: as printed; method: of the interval
    bounded: it cannot exceed 1, so no zero is printed before the decimal point
    """

    name: str
    symbol: str
    value: float
    low95: float
    high95: float
    method: str
    bounded: bool = True


@dataclass(frozen=True)
class StatisticalTest:
    """The results of one test.

    symbol, statistic, df: as printed; df is nan for a statistic without degrees of freedom
    p: by the statistic's distribution in large samples
    exact_p: of the permutations of the data, nan if it was not computed
    least_p: the smallest exact probability that is possible with this number of data
    n: participants, or answers if each counts separately
    notes: warnings for the reader, e.g. counts too small for the large-sample probability
    """

    key: Test
    symbol: str
    statistic: float
    df: float
    p: float
    exact_p: float
    least_p: float
    n: int
    effect: EffectSize
    notes: tuple[str, ...] = ()

    @property
    def deciding_p(self) -> float:
        """Return the exact probability if it is known, else that of large samples."""
        return self.exact_p if isfinite(self.exact_p) else self.p


def no_effect(name: str, symbol: str) -> EffectSize:
    """Return an undefined effect."""
    return EffectSize(name, symbol, nan, nan, nan, "none")

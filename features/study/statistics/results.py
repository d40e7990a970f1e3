"""What a test gives: statistic, chances, effect with its interval, and what to know of it."""

from dataclasses import dataclass
from math import isfinite, nan
from typing import NamedTuple

from gazerig.features.study.design import Test


class EffectSize(NamedTuple):
    """An effect with its 95 % interval, nan where there is none.

    name: in words; symbol: as it is printed; method: of the interval
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
    """One test that was carried out.

    symbol, statistic, df: as printed, df is nan where the statistic has none
    p: by the statistic's distribution in large samples
    exact_p: of the permutations that the data allow, nan where it was not computed
    least_p: the smallest exact chance that so few data can have, whatever they are
    n: participants, or answers where each counts by itself
    notes: what a reader must know, e.g. counts too small for the large-sample chance
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
        """Return the exact chance where there is one, else that of large samples."""
        return self.exact_p if isfinite(self.exact_p) else self.p


def no_effect(name: str, symbol: str) -> EffectSize:
    """Return the effect of data that have none."""
    return EffectSize(name, symbol, nan, nan, nan, "none")

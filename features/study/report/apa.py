"""Sentences and numbers in the style of the American Psychological Association (7th edition).

Symbols in italics, exact probabilities, no zero before the point of values that cannot exceed one.
"""

from math import isfinite

from markupsafe import Markup

from gazerig.features.study.analysis import StudyAnalysis
from gazerig.features.study.decisions import Decision
from gazerig.features.study.design import Test
from gazerig.features.study.scores import Measure
from gazerig.features.study.statistics.effects import EffectSize, StatisticalTest

TEST_NAMES: dict[Test, str] = {
    "signed_rank": "Wilcoxon signed-rank test",
    "rank_sum": "Wilcoxon rank-sum test",
    "sign": "exact sign test of participants",
    "chi_square": "chi-square test of the counts",
    "friedman": "Friedman test",
}
_CORRECTIONS = {"holm": "Holm-corrected ", "bonferroni": "Bonferroni-corrected ", "none": ""}
_MINUS = "\N{MINUS SIGN}"


def p_text(p: float) -> Markup:
    """Return a probability with its symbol: three decimals, or that it is below a thousandth."""
    if not isfinite(p):
        return Markup("<i>p</i> not known")
    if p < 0.001:
        return Markup("<i>p</i> &lt; .001")
    return Markup("<i>p</i> = ") + bounded_text(min(p, 1.0), 3)


def bounded_text(value: float, decimals: int = 2) -> str:
    """Return a number that cannot exceed one, without the zero before the point."""
    text = f"{abs(value):.{decimals}f}"
    text = text[1:] if text.startswith("0.") else text
    return f"{_MINUS}{text}" if value < 0.0 and float(f"{value:.{decimals}f}") else text


def unbounded_text(value: float, decimals: int = 2) -> str:
    """Return a number in the usual notation."""
    text = f"{abs(value):.{decimals}f}"
    return f"{_MINUS}{text}" if value < 0.0 and float(text) else text


def effect_text(size: EffectSize) -> Markup:
    """Return an effect with its interval, "" without one."""
    if not isfinite(size.value):
        return Markup("")
    written = bounded_text if size.bounded else unbounded_text
    name, _, below = size.symbol.partition("_")
    symbol = Markup("<i>{}</i>").format(name) + Markup("<sub>{}</sub>" if below else "").format(
        below
    )
    found = Markup("{} = {}").format(symbol, written(size.value))
    if not (isfinite(size.low95) and isfinite(size.high95)):
        return found
    return found + Markup(", 95% CI [{}, {}]").format(written(size.low95), written(size.high95))


def statistic_text(test: StatisticalTest) -> Markup:
    """Return the statistic of a test with its degrees of freedom."""
    if not isfinite(test.statistic):
        return Markup("")
    symbol = Markup("<i>{}</i>").format(test.symbol)
    if test.symbol == "χ²":
        symbol = Markup("<i>χ</i>²")
        if isfinite(test.df):
            many = Markup(", <i>N</i> = {}").format(test.n) if test.key == "chi_square" else ""
            symbol += Markup("({:.0f}{})").format(test.df, many)
    decimals = {"χ²": 2, "K": 0}.get(test.symbol, 1)
    return Markup("{} = {}").format(symbol, unbounded_text(test.statistic, decimals))


def result_sentence(one: Decision, study: StudyAnalysis) -> Markup:
    """Return the result for one hypothesis as a paper reports it."""
    better, than = study.label(one.hypothesis.better), study.label(one.hypothesis.than)
    what = measure_name(one.measure)
    if one.verdict == "too few" or one.test is None:
        return Markup(
            "Too few: with <i>n</i> = {} nothing can be said of whether {} exceeds {} in {} ({})."
        ).format(one.n, better, than, what, one.too_few or "the test has no result")
    figures = [statistic_text(one.test), _p_texts(one, study.design.plan.correction)]
    figures += [effect_text(one.test.effect)]
    if one.standardised is not None:
        figures.append(effect_text(one.standardised))
    figures.append(Markup("<i>n</i> = {}").format(one.n))
    listed = Markup(", ").join(part for part in figures if part)
    found = _finding(one, better, than, what)
    return Markup("{} ({}), {}.").format(found, TEST_NAMES[one.test.key], listed)


def _p_texts(one: Decision, correction: str) -> Markup:
    assert one.test is not None
    p = p_text(one.test.deciding_p)
    if isfinite(one.test.exact_p):
        p += Markup(" (exact)")
    if correction == "none" or one.corrected_p == one.test.deciding_p:
        return p
    return p + Markup(", {}{}").format(_CORRECTIONS[correction], p_text(one.corrected_p))


def _finding(one: Decision, better: str, than: str, what: str) -> Markup:
    """Return the first half of the sentence: which is higher, and both values."""
    better = better[:1].upper() + better[1:]
    if one.measure.kind == "choice":
        share = Markup("{:.0f}% of direct choices").format(100.0 * one.means[0])
        verb = {
            "supported": "was chosen over", "against": "was chosen less often than",
        }.get(one.verdict, "was not chosen significantly more or less often than")  # fmt: skip
        return Markup("{} {} {} in {} ({})").format(better, verb, than, what, share)
    symbol = "Mdn" if one.measure.kind == "item" else "M"
    first, second = one.medians if symbol == "Mdn" else one.means
    places = (
        Markup("(<i>{}</i> = {})").format(symbol, plain_number(value)) for value in (first, second)
    )
    verb = {"supported": "was above", "against": "was below"}.get(
        one.verdict, "did not differ significantly from"
    )
    found = Markup("{} {} {} {} {} in {}").format(
        better, next(places), verb, than, next(places), what
    )
    assert one.test is not None
    if one.test.effect.value * (one.means[0] - one.means[1]) < 0.0:
        found += Markup("; the means, <i>M</i> = {} and {}, have the other sign").format(
            *map(plain_number, one.means)
        )
    return found


def plain_number(value: float) -> str:
    """Return a mean or median with at most two decimals."""
    return unbounded_text(value).rstrip("0").rstrip(".") if isfinite(value) else "unknown"


def measure_name(measure: Measure) -> str:
    """Return a measure's name in words."""
    return measure.name.partition(".")[2].replace("_", " ") or measure.name.replace("_", " ")

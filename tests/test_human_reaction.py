"""Row 10 of the running product in a short form: hands that appear are looked at as by people."""

from functools import partial

from human.measured_run import half_rate_run, ideal_run
from human.row_10_reaction import WANTED, measure

SHORT_S = 24.0
SEEDS = (3, 4)


def test_e70_a_hand_that_appears_is_looked_at_after_a_reaction_time_of_people() -> None:
    figures = measure(ideal_run, SHORT_S, SEEDS)
    assert figures["hands"] >= 5
    for name in (
        "appears: answered, %", "appears: median, ms", "comes nearer fast: answered, %",
    ):  # fmt: skip
        low, high = WANTED[name]
        assert low <= figures[name] <= high, (name, figures)
    # The row judges 120 hands; here are about 12, so one of them is more than 5 %.
    assert figures["express (below 120 ms), %"] <= 10.0
    assert figures["comes nearer fast: median, ms"] < figures["appears: median, ms"] + 10.0


def test_without_a_reaction_time_most_are_express() -> None:
    at_once = partial(half_rate_run, overrides={"gaze.attention.reaction.median_ms": 0.0})
    assert measure(at_once, SHORT_S, SEEDS)["appears: median, ms"] < 145.0

"""Head, blinks and idle gaze of the running product: the rows of the bench in a short form."""

from human import (
    row_05_homeward_head,
    row_14_blinks,
    row_15_head_share,
    row_16_idle,
    row_31_head_sway,
    row_32_head_pursuit,
)
from human.measured_run import half_rate_run


def outside(wanted: dict[str, tuple[float, float]], figures: dict[str, float]) -> dict[str, float]:
    """Return the figures that are not in their bands."""
    return {
        name: figures[name]
        for name, (low, high) in wanted.items()
        if not low <= figures[name] <= high
    }


def test_e65_the_measured_head_stops_short_of_a_nearer_target() -> None:
    figures = row_05_homeward_head.measure(half_rate_run, 12.5, (0,))
    assert outside(row_05_homeward_head.WANTED, figures) == {}
    turned = [figures[f"turned at interest {i} deg"] for i in ("0.2,", "0.5,", "1,")]
    assert turned[0] < turned[1] < turned[2]


def test_e74_measured_blinks_are_not_in_the_ticks_of_saccades_and_half_incomplete() -> None:
    figures = row_14_blinks.measure(half_rate_run, 30.0, (0,))
    # Too short for the rates of the two modes, but not for their order.
    assert 6.0 <= figures["at rest, 1/min"] <= 25.0
    assert 14.0 <= figures["in conversation, 1/min"] <= 37.0
    assert figures["in the tick of a saccade, %"] <= 15.0  # one of 7 or more, by chance
    assert 20.0 <= figures["incomplete, %"] <= 80.0


def test_e75_the_measured_head_follows_stahls_law_and_rolls() -> None:
    figures = row_15_head_share.measure(half_rate_run, 30.0, (0,))
    assert outside(row_15_head_share.WANTED, figures) == {}


def test_e76_the_measured_gaze_explores_a_room() -> None:
    figures = row_16_idle.measure(half_rate_run, 20.0, (0,))
    wanted = {k: v for k, v in row_16_idle.WANTED.items() if k.endswith("saccades/s")}
    assert outside(wanted, figures) == {}
    assert figures["empty room, gaze within 35 x 20 deg of the middle, %"] >= 98.0
    assert 15.0 <= figures["room with things, gaze on them, %"] <= 80.0


def test_the_measured_head_sways_and_the_gaze_keeps_its_place() -> None:
    figures = row_31_head_sway.measure(half_rate_run, 40.0, (0,))
    names = [
        "yaw or roll without a step for 2 s or longer, % of time",
        "largest step of a goal in a tick, encoder steps",
        "gaze off the plan, 95th percentile, deg",
    ]
    wanted = {name: row_31_head_sway.WANTED[name] for name in names}
    assert outside(wanted, figures) == {}
    assert figures["roll: standard deviation, deg"] > 0.1


def test_the_measured_head_pursues_a_walker() -> None:
    figures = row_32_head_pursuit.measure(half_rate_run, 40.0, (0,))
    assert outside(row_32_head_pursuit.WANTED, figures) == {}

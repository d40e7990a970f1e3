"""Figures of the loop's time, from the times of its ticks."""

import pytest

from gazerig.robot.loop.timing import LoopTiming, busy_text
from gazerig.robot.model.types import LoopFigures


def timed(times_s: list[float], rate_hz: float = 200.0) -> LoopFigures:
    timing = LoopTiming(rate_hz)
    for t_s in times_s:
        timing.update(t_s)
    figures = timing.figures()
    assert figures is not None
    return figures


def test_a_loop_that_keeps_its_slots_has_no_late_tick():
    figures = timed([0.005 * k for k in range(400)])
    assert figures.rate_hz == pytest.approx(200.0)
    assert figures.latest_ms == pytest.approx(0.0, abs=1e-6)
    assert figures.overruns == 0


def test_a_late_tick_shows_and_is_no_overrun():
    times = [0.005 * k for k in range(400)]
    times[200] += 0.0015
    figures = timed(times)
    assert figures.latest_ms == pytest.approx(1.5, abs=1e-6)
    assert figures.overruns == 0


def test_skipped_slots_are_overruns():
    times = [0.005 * k for k in range(200) if k not in (50, 51, 120)]
    figures = timed(times)
    assert figures.overruns == 3
    assert figures.latest_ms == pytest.approx(10.0)


def test_a_computer_that_misses_slots_is_called_busy_with_its_figures():
    assert busy_text(None) == "" and busy_text(timed([0.005 * k for k in range(400)])) == ""
    times = [0.005 * k for k in range(800) if not 100 <= k % 200 < 116]  # 80 ms, four times
    figures = timed(times)
    assert figures.late_share == pytest.approx(64 / 799)
    assert busy_text(figures) == ("the computer is too busy: 8% of ticks came late (worst 80 ms)")
    assert busy_text(timed(times[:500])) == ""  # below three seconds a lower rate may help

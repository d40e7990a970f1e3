"""Figures of the loop's time, from the times of its ticks; the interpreter's switch interval."""

import sys
from collections.abc import Sequence

import pytest

from gazerig.robot.loop.timing import LoopTiming, SwitchInterval, busy_text
from gazerig.robot.model.types import LoopFigures


def timed(times_s: Sequence[float], rate_hz: float = 200.0) -> LoopFigures | None:
    timing = LoopTiming(rate_hz)
    for t_s in times_s:
        timing.update(t_s)
    return timing.figures()


SLOTS = [0.005 * k for k in range(2000)]
LATE = [t_s + 0.0015 * (k == 200) for k, t_s in enumerate(SLOTS[:400])]
STALLS = [SLOTS[k] for k in range(800) if not 100 <= k % 200 < 116]  # 80 ms, four times


@pytest.mark.parametrize(
    ("times_s", "figures"),
    [
        (SLOTS[:1], None),
        (SLOTS[:2], (200.0, 0, 0.0, 0.0, 0.0)),
        (SLOTS, (200.0, 0, 4.995, 0.0, 0.0)),  # 1000 of them are in the last five seconds
        ([*SLOTS[:400], 1.0, 1.006, 1.011], (200.0, 0, 0.005, 0.0, 1.0)),  # another clock
        (LATE, (200.0, 0, 1.99, 0.0, 1.5)),
        (STALLS, (734 / 3.99, 64, 3.99, 64 / 799, 80.0)),
    ],
)
def test_ticks_are_counted_late_or_skipped(times_s, figures):
    found = timed(times_s)
    if figures is None or found is None:
        assert found is figures
        return
    assert (found.rate_hz, found.overruns, found.over_s) == pytest.approx(figures[:3])
    assert (found.late_share, found.latest_ms) == pytest.approx(figures[3:], abs=1e-6)


def test_a_computer_that_misses_slots_is_called_busy_with_its_figures():
    assert busy_text(None) == busy_text(timed(SLOTS)) == busy_text(timed(STALLS[:500])) == ""
    said = "the computer is too busy: {}% of ticks came late (worst 60 ms)".format
    for over_s, share, text in ((3.0, 0.05, said(5)), (2.99, 0.05, ""), (3.0, 0.049, "")):
        assert busy_text(LoopFigures(200.0, 1, over_s, share, 60.0)) == text


def test_the_interpreter_switches_threads_sooner_while_a_loop_runs():
    before, loops, found = sys.getswitchinterval(), SwitchInterval(), []
    with loops:
        with loops:
            found.append(sys.getswitchinterval())
        found.append(sys.getswitchinterval())
    assert found == pytest.approx([0.0003] * 2) and sys.getswitchinterval() == before

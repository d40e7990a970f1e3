"""When the gaze jumps: the rule by itself, with errors and slips given. Degrees."""

from math import radians

import pytest

from gazerig.gaze.pursuit import Slip
from gazerig.gaze.saccade_trigger import SaccadeTrigger, SaccadeTriggerParams


def slip(error_deg: float, slip_deg_s: float = 0.0) -> Slip:
    return Slip((0.0, radians(error_deg), 0.0), (0.0, radians(slip_deg_s), 0.0))


def settled(params: SaccadeTriggerParams | None = None, scatters: bool = False) -> SaccadeTrigger:
    """Return a rule that has answered its first event and landed at 0."""
    rule = SaccadeTrigger(params or SaccadeTriggerParams(), scatters)
    rule.record_shift(1, 0.0, -1.0, -1.0)
    assert not rule.due(slip(0.0), 0.0)
    assert not rule.waits
    rule.record_landing(0.0)
    return rule


def first_s(rule: SaccadeTrigger, seen: Slip, until_s: float = 1.0) -> float | None:
    times = (k / 1000 for k in range(1, round(until_s * 1000)))
    return next((t for t in times if rule.due(seen, t)), None)


def test_error_beyond_two_degrees_jumps_after_the_refractory_time() -> None:
    assert first_s(settled(), slip(2.1)) == pytest.approx(0.150, abs=0.001)
    assert first_s(settled(), slip(1.9)) is None


@pytest.mark.parametrize(
    ("crossing_ms", "jumps"), [(30.0, True), (50.0, False), (170.0, False), (200.0, True)]
)
def test_an_eye_about_to_cross_the_target_needs_no_saccade(crossing_ms: float, jumps: bool) -> None:
    seen = slip(3.0, -3.0 / (crossing_ms / 1e3))
    assert (first_s(settled(), seen) is not None) == jumps


def test_a_target_that_slips_away_is_caught_up_with() -> None:
    assert first_s(settled(), slip(3.0, 30.0)) is not None


def test_new_target_jumps_at_once_unless_it_is_nearly_there() -> None:
    rule = settled()
    rule.record_shift(2, 0.0, 0.05, 0.05)
    assert rule.due(slip(1.0), 0.05)
    rule.record_shift(3, 0.0, 0.06, 0.06)
    assert not rule.due(slip(0.2), 0.06)
    assert not rule.waits


def test_latency_counts_from_the_first_unanswered_event() -> None:
    rule = settled(SaccadeTriggerParams(latency_ms=200.0))
    rule.record_shift(2, 0.0, 0.1, 0.1)
    rule.record_shift(3, 0.0, 0.25, 0.25)
    assert rule.waits
    assert rule.onset_s == pytest.approx(0.3)
    assert not rule.due(slip(5.0), 0.299)
    assert rule.due(slip(5.0), 0.300)
    assert rule.onset_s == pytest.approx(0.3)


def test_an_event_in_flight_is_due_at_the_landing() -> None:
    rule = settled()
    rule.record_shift(2, 0.0, 0.14, 0.1)
    assert rule.onset_s == pytest.approx(0.14)
    rule.record_landing(0.14)
    assert rule.due(slip(5.0), 0.14)


def test_scattered_landings_are_corrected_after_200_ms_and_exact_ones_are_not() -> None:
    scattered = settled(scatters=True)
    assert not scattered.due(slip(1.5), 0.01)
    assert scattered.corrects
    assert first_s(scattered, slip(1.5)) == pytest.approx(0.2, abs=0.001)
    assert first_s(settled(), slip(1.5)) is None
    small = settled(scatters=True)
    assert not small.due(slip(0.9), 0.01)
    assert not small.corrects

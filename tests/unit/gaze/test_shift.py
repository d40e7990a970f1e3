"""Times of saccades: the rule alone, with given errors and slips. Degrees."""

from math import radians

import pytest

from gazerig.gaze.oculomotor.pursuit import Slip
from gazerig.gaze.oculomotor.saccade_trigger import SaccadeTrigger


def slip(error_deg, slip_deg_s=0.0):
    return Slip((0.0, radians(error_deg), 0.0), (0.0, radians(slip_deg_s), 0.0))


REFRACTORY_S = 0.15


def settled():
    """Return a rule that has answered its first event and landed exactly at 0."""
    rule = SaccadeTrigger(True)
    rule.record_shift(1, 0.0, None, -1.0)
    assert not rule.is_due(slip(0.0), 0.0, REFRACTORY_S)
    assert not rule.is_saccade_due
    rule.record_landing(0.0, 0.155)
    assert not rule.is_due(slip(0.0), 0.0, REFRACTORY_S)
    return rule


def first_s(rule, seen):
    times = (k / 1000 for k in range(1, 1000))
    return next((t for t in times if rule.is_due(seen, t, REFRACTORY_S)), None)


def test_error_beyond_two_degrees_jumps_after_the_refractory_time():
    assert first_s(settled(), slip(2.1)) == pytest.approx(0.155, abs=0.001), "as a correction"
    assert first_s(settled(), slip(5.0)) == pytest.approx(0.150, abs=0.001)
    assert settled().is_due(slip(5.0), 0.001, 0.0)
    assert first_s(settled(), slip(1.9)) is None


@pytest.mark.parametrize(
    ("crossing_ms", "jumps"), [(30.0, True), (50.0, False), (170.0, False), (200.0, True)]
)
def test_an_eye_about_to_cross_the_target_needs_no_saccade(crossing_ms, jumps):
    seen = slip(3.0, -3.0 / (crossing_ms / 1e3))
    assert (first_s(settled(), seen) is not None) == jumps


def test_a_target_that_slips_away_is_caught_up_with():
    assert first_s(settled(), slip(3.0, 30.0)) is not None


def test_new_target_jumps_at_once_unless_it_is_nearly_there():
    rule = settled()
    rule.record_shift(2, 0.0, None, 0.15)
    assert rule.is_due(slip(1.0), 0.15, REFRACTORY_S)
    rule.record_shift(3, 0.0, None, 0.16)
    assert not rule.is_due(slip(0.2), 0.16, REFRACTORY_S)
    assert not rule.is_saccade_due


def test_nothing_jumps_sooner_than_100_ms_after_a_landing():
    rule = settled()
    rule.record_shift(2, 0.0, None, 0.03)
    assert rule.onset_s == pytest.approx(0.1)
    assert first_s(rule, slip(5.0)) == pytest.approx(0.1, abs=0.001)


def test_an_event_early_in_flight_redirects_and_a_late_one_waits_after_the_landing():
    early = settled()
    early.record_shift(2, 0.0, 0.29, 0.2)
    assert early.onset_s == pytest.approx(0.2)
    assert early.may_redirect(0.2)
    assert not early.may_redirect(0.205) and not early.is_saccade_due
    late = settled()
    late.record_shift(2, 0.0, 0.26, 0.2)
    assert late.onset_s == pytest.approx(0.36)
    assert not any(late.may_redirect(t) for t in (0.2, 0.23, 0.255))
    late.record_landing(0.26, 0.155)
    assert not late.is_due(slip(5.0), 0.355, REFRACTORY_S)
    assert late.is_due(slip(5.0), 0.36, REFRACTORY_S)


def test_landings_that_err_are_corrected_and_exact_ones_are_not():
    scattered = settled()
    scattered.record_landing(0.0, 0.17)
    assert not scattered.is_due(slip(1.5), 0.01, REFRACTORY_S)
    assert scattered.is_correction_due
    assert first_s(scattered, slip(1.5)) == pytest.approx(0.17, abs=0.001)
    assert first_s(settled(), slip(1.5)) is None
    scattered.record_landing(1.0, 0.17)
    assert not scattered.is_due(slip(1.1), 1.01, REFRACTORY_S)
    assert not scattered.is_correction_due


def test_exact_saccades_are_neither_corrected_nor_bent_and_follow_each_other_at_once():
    rule = SaccadeTrigger(False)
    rule.record_landing(0.0, 0.0)
    assert first_s(rule, slip(1.5)) is None
    assert first_s(rule, slip(3.0, -60.0)) == pytest.approx(0.150, abs=0.001)
    rule.record_landing(1.0, 0.155)
    rule.record_shift(2, 0.0, None, 1.0)
    assert rule.onset_s == 1.0
    rule.reset(2.0)
    rule.record_shift(3, 0.0, 2.9, 2.0)
    assert rule.onset_s == pytest.approx(2.9)

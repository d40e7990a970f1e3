"""Saccades of the running product, short; the long form is tests/human."""

import numpy as np
import pytest
from human.commanded_looks import commanded, point
from human.eye_steps import Step, steps
from human.measured_run import measured_run
from human.row_06_profile import inside
from human.row_11_in_flight import EARLY_S, LATE_S, changed
from human.row_12_landing import landings
from human.row_13_small_motion import WANTED as SMALL
from human.row_13_small_motion import measure as small_motion

from gazerig.config.schema import load_rig


@pytest.mark.parametrize(("rig", "slowest"), [("desk", 1.3), ("feetech", 1.3), ("maker", None)])
def test_e64_eyes_do_not_overshoot_and_are_about_as_fast_as_commanded(
    rig: str, slowest: float | None
) -> None:
    for one in steps(rig, (5.0, 20.0)):
        assert one.done_deg.max() <= 1.05 * one.size_deg
        assert one.done_deg[-1] == pytest.approx(one.size_deg, abs=0.4)
        if slowest is not None:  # hobby servos have a lag of their own, and a pulse every 20 ms
            assert one.rise_ms(one.done_deg) <= slowest * one.rise_ms(one.asked_deg)
            assert one.speed_deg_s.max() <= 1.02 * one.most_deg_s


def test_e66_single_saccades_have_the_duration_peak_and_skew_of_people() -> None:
    sizes = (1.5, 3.0, 6.0, 12.0, 25.0)
    rows = np.array([(float(one.done_deg[-1]), *one.timing()) for one in steps("desk", sizes)])
    fast, long = inside(rows)
    assert np.mean(fast & long) >= 0.75
    assert rows[-1, 3] < 0.47 < rows[2, 3] < 0.6  # the peak comes earlier in large ones


def test_e66_a_law_that_is_too_fast_is_seen() -> None:
    (one, _) = steps("desk", (6.0,))
    twice = Step(one.size_deg, one.law_s, 500.0, one.asked_deg[::2], one.done_deg[::2])
    fast, long = inside(np.array([(6.0, *twice.timing())]))
    assert not (fast & long).any()


def test_e71_an_early_jump_bends_a_saccade_without_a_step_of_speed_and_a_late_one_waits() -> None:
    counts, hardest, errors, _ = changed(EARLY_S, 0)
    assert counts and set(counts) == {1}
    # 38 000 deg/s2 by the law; a step by 100 deg/s in a tick would be 20 000 more.
    assert max(hardest) < 42_000.0
    assert np.median(errors) < 1.0
    waits = changed(LATE_S, 0)[3]
    assert waits and min(waits) >= 95.0 and max(waits) < 1e5


def test_e72_large_saccades_fall_short_scatter_and_a_third_is_corrected() -> None:
    rng = np.random.default_rng(0)
    sides = np.where(np.arange(45) % 2, 1.0, -1.0)
    places = [point(float(y), 1.0) for y in sides * rng.uniform(5.5, 7.0, 45)]
    looks = commanded(list(0.8 * np.arange(45)), places, "desk", 1)
    short, across, after_ms, rest, _ = landings(looks).T
    assert 0.05 <= short.mean() <= 0.1
    assert 0.025 <= short.std() <= 0.06 and 0.01 <= across.std() <= 0.045
    corrected = np.isfinite(after_ms)
    assert 0.15 <= corrected.mean() <= 0.5
    assert after_ms[corrected].min() >= 95.0 and after_ms[corrected].max() <= 215.0
    assert np.median(rest) < 0.5


def test_e73_small_saccades_keep_the_eyes_alive_where_servos_can_show_them() -> None:
    found = small_motion(measured_run, 20.0, [0])
    for name, (low, high) in SMALL.items():
        assert low <= found[name] <= 1.1 * high, name  # some 20 of them


def test_e73_each_rig_makes_no_smaller_ones_than_its_eyes_show() -> None:
    for name, joint in (("desk", "left_eye_pan"), ("feetech", "left_eye_pan"), ("expressive", "eyes_pan")):  # fmt: skip
        rig = load_rig(name)
        step_deg = 360.0 / rig.joints[joint].model_facts.steps_per_turn / rig.joints[joint].ratio
        assert rig.gaze.oculomotor.refixation_least_deg >= 5.0 * step_deg
    assert load_rig("maker").gaze.oculomotor.refixation_deg == 0.0

"""Binocular controller against its acceptance numbers. Checks are listed in docs/checks.md.

Degrees and seconds; an angle commanded at tick k holds from the end of that period on.
"""

from collections.abc import Callable
from math import cos, degrees, pi, radians, sin
from typing import Any, NamedTuple

import numpy as np
import pytest
from reference.binocular_model import AT_REST, BinocularController, BinocularParams, HeadMotion
from reference.vestibular import gate

DT = 0.005
Where = Callable[[float], float | None]


class Trace(NamedTuple):
    """Time at which each angle holds, left and right eye, version, vergence."""

    t: np.ndarray
    left: np.ndarray
    right: np.ndarray
    version: np.ndarray
    vergence: np.ndarray


def run(
    left: Where,
    right: Where,
    seconds: float,
    params: BinocularParams | None = None,
    head: Callable[[float], HeadMotion] = lambda t: AT_REST,
    dt: float = DT,
    start: tuple[float, float] = (0.0, 0.0),
) -> Trace:
    controller = BinocularController(params or BinocularParams())
    controller.reset(0.0, radians(start[0]), radians(start[1]))
    rows = []
    for k in range(round(seconds / dt)):
        seen = [None if a is None else radians(a) for a in (left(k * dt), right(k * dt))]
        eyes = controller.step(seen[0], seen[1], head(k * dt), dt)
        pair = (controller.version_rad, controller.vergence_rad)
        rows.append([(k + 1) * dt, *np.degrees([*eyes, *pair])])
    return Trace(*np.array(rows).T)


def both(where: Where, seconds: float, dt: float = DT) -> Trace:
    return run(where, where, seconds, dt=dt)


def dark(t: float) -> None:
    return None


def ramp_numbers(speed: float, dt: float) -> tuple[float, float, float, float]:
    """Return onset, time to 90 %, steady gain, lag in seconds."""
    trace = both(lambda t: speed * t, 1.6, dt)
    speeds = np.diff(trace.version, prepend=0.0) / dt
    starts = trace.t - dt
    onset = starts[np.argmax(speeds > 0.05 * speed)]
    t90 = starts[np.argmax(speeds > 0.9 * speed)]
    lag = trace.t[-1] - trace.version[-1] / speed
    return float(onset), float(t90), float(speeds[-1] / speed), float(lag)


def response(out: np.ndarray, t: np.ndarray, hz: float) -> complex:
    """Return the phasor of a signal over its last whole cycles, sin being 1."""
    keep = t > t[-1] - round(t[-1] * hz / 2) / hz + 1e-9
    return complex(2j * np.mean(out[keep] * np.exp(-2j * pi * hz * t[keep])))


def sine_numbers(hz: float, dt: float) -> tuple[float, float]:
    trace = both(lambda t: 5.0 * sin(2 * pi * hz * t), 6.0 / hz, dt)
    z = response(trace.version, trace.t, hz) / 5.0
    return abs(z), degrees(np.angle(z))


@pytest.mark.parametrize("speed", [10.0, 20.0, 30.0])
def test_e20_ramp(speed: float) -> None:
    onset, t90, gain, lag = ramp_numbers(speed, DT)
    assert onset == pytest.approx(0.105, abs=0.01)
    assert t90 == pytest.approx(0.195, abs=0.02)
    assert gain == pytest.approx(1.0, abs=0.02)
    assert lag == pytest.approx(0.1415, rel=0.08)


@pytest.mark.parametrize("hz", [0.1, 0.2, 0.3, 0.4, 0.5])
def test_e21_sine(hz: float) -> None:
    gain, phase = sine_numbers(hz, DT)
    assert 0.98 <= gain <= 1.01
    assert phase == pytest.approx(-360.0 * hz * 0.140, abs=3.0)


def test_e24_independence_of_the_control_rate() -> None:
    ramp, sines = np.array(ramp_numbers(20.0, DT)), {hz: sine_numbers(hz, DT) for hz in (0.1, 0.5)}
    for dt in (0.010, 0.002):
        change = np.abs(np.array(ramp_numbers(20.0, dt)) - ramp)
        assert change[[0, 1, 3]].max() <= 0.010
        assert change[2] <= 0.05
        for hz, (gain, phase) in sines.items():
            other_gain, other_phase = sine_numbers(hz, dt)
            assert other_gain == pytest.approx(gain, rel=0.05)
            assert abs(other_phase - phase) / 360.0 / hz <= 0.010


@pytest.mark.parametrize(("start", "step", "t63", "gain"), [(2, 4, 0.405, 4), (8, -4, 0.490, 3)])
def test_e25_vergence_step(start: float, step: float, t63: float, gain: float) -> None:
    half = (start + step) / 2
    trace = run(lambda t: -half, lambda t: half, 2.0, start=(0.0, start))
    done = (trace.vergence - start) / step
    assert trace.t[np.argmax(done >= 0.63)] == pytest.approx(t63, abs=0.03)
    # A first-order control peaks at its gain times the step: 16 and 12 deg/s.
    assert np.abs(np.diff(trace.vergence)).max() / DT == pytest.approx(gain * 4.0, rel=0.02)
    assert np.abs(trace.version).max() < 0.01


def test_e26_version_and_vergence_do_not_disturb_each_other() -> None:
    def ends(version: float, vergence: float) -> Trace:
        return run(lambda t: version - vergence / 2, lambda t: version + vergence / 2, 1.5)

    together, one, other = ends(1.5, 4.0), ends(1.5, 0.0), ends(0.0, 4.0)
    assert np.abs(together.left - one.left - other.left).max() < 0.01
    assert np.abs(together.right - one.right - other.right).max() < 0.01
    assert np.abs(one.vergence).max() < 0.01


def test_conjugate_step_without_overshoot() -> None:
    trace = both(lambda t: 1.5, 1.5)
    for share, time in ((0.05, 0.110), (0.63, 0.220), (0.90, 0.380)):
        assert trace.t[np.argmax(trace.version >= share * 1.5)] == pytest.approx(time, abs=0.02)
    assert trace.version.max() <= 1.5 + 1e-9


def test_too_fast_a_target_is_left_behind() -> None:
    fast, wide = (lambda t: 99.0 * t - 20.0), BinocularParams(eye_limit_deg=90.0)
    trace = run(fast, fast, 1.0, wide)
    # 60 deg/s less 5 %, and 8 times the 5 deg that count.
    assert np.diff(trace.version).max() / DT == pytest.approx(0.95 * 60.0 + 40.0, abs=0.5)


@pytest.mark.parametrize(("covered", "share"), [("copy", 1.0), ("cross", 2.0 / 6.0)])
def test_e28_covered_eye(covered: Any, share: float) -> None:
    controller = BinocularController(BinocularParams(covered=covered))
    controller.reset(0.0, 0.0, radians(4.0))
    for _ in range(400):
        controller.step(radians(-2.0), radians(2.0), AT_REST, DT)
    for _ in range(400):
        left, right = controller.step(radians(-0.5), None, AT_REST, DT)
    assert degrees(left) == pytest.approx(-0.5, abs=0.01)
    assert degrees(right) == pytest.approx(2.0 + 1.5 * share, abs=0.01)
    if covered == "copy":
        assert abs(degrees(right) - 3.5) < 0.1
        for _ in range(100):
            _, right = controller.step(radians(-0.5), radians(3.5), AT_REST, DT)
        assert abs(degrees(right) - 3.5) < 0.1


def turning(hz: float, size: float = 10.0) -> Callable[[float], HeadMotion]:
    w = 2 * pi * hz
    return lambda t: HeadMotion(radians(size * sin(w * t)), radians(size * w * cos(w * t)))


@pytest.mark.parametrize(("hz", "phase", "residual"), [(0.5, -1.9, 0.033), (2.0, -7.6, 0.132)])
def test_e29_reflex_in_the_dark(hz: float, phase: float, residual: float) -> None:
    trace = run(dark, dark, 8.0 / hz, BinocularParams(storage_s=0.0), turning(hz), dt=0.001)
    z = -response(trace.version, trace.t, hz) / 10.0
    assert abs(z) == pytest.approx(1.0, abs=0.02)
    assert degrees(np.angle(z)) == pytest.approx(phase, abs=2.0)
    assert abs(1.0 - z) == pytest.approx(residual, abs=0.02)


def test_reflex_loses_what_never_changes() -> None:
    spin = HeadMotion(0.0, radians(1.0))
    trace = run(dark, dark, 20.0, head=lambda t: spin)
    speeds = -np.diff(trace.version) / DT
    assert speeds[10] == pytest.approx(1.0, rel=0.02)
    assert speeds[round(16.0 / DT)] == pytest.approx(1.0 / np.e, rel=0.02)


def test_gated_reflex_gives_the_head_to_the_shift() -> None:
    spin = HeadMotion(0.0, radians(10.0), gate=gate(radians(40.0)))
    trace = run(dark, dark, 1.0, BinocularParams(storage_s=0.0), lambda t: spin)
    assert -np.diff(trace.version)[-1] / DT == pytest.approx(10.0 * (1 - 0.68), rel=1e-6)


def test_translation_turns_the_eyes_by_the_distance_they_converge_on() -> None:
    vergence = degrees(0.0619 / 0.5)
    step = HeadMotion(left_m_s=0.1)
    trace = run(dark, dark, 0.05, head=lambda t: step, start=(0.0, vergence))
    assert -np.diff(trace.version)[-1] / DT == pytest.approx(11.5, abs=0.1)


@pytest.mark.parametrize(
    ("gain", "overshoot_least", "overshoot_most", "grows"),
    [
        (3.0, 0.0, 0.0, False),
        (8.0, 0.3, 0.5, False),
        (15.0, 0.8, 1.2, False),
        (15.6, 1.2, 99, True),
    ],
)
def test_e34_stability_of_delayed_feedback_alone(
    gain: float, overshoot_least: float, overshoot_most: float, grows: bool
) -> None:
    # (2 / dt) sin(pi / (4 N + 2)) with N = 20 is 15.32: 15 rings on and on but does not
    # grow, 15.6 does.
    assert 2.0 / DT * sin(pi / 82.0) == pytest.approx(15.3, abs=0.05)
    params = BinocularParams(efference=False, gain_1_s=gain, max_error_deg=90.0)
    trace = run(lambda t: 1.0, lambda t: 1.0, 10.0, params)
    early, late = trace.version[:400].max() - 1.0, trace.version[-400:].max() - 1.0
    assert overshoot_least <= max(0.0, early) <= overshoot_most
    assert (late > 1.5 * early and late > 1.0) == grows


def test_e58_lost_target_fades() -> None:
    trace = both(lambda t: 20.0 * t if t < 2.0 else None, 4.0)
    speeds = np.diff(trace.version) / DT

    def after(s: float) -> float:
        return float(speeds[round((2.0 + s) / DT)])

    assert after(0.3) == pytest.approx(9.6, abs=2.0)
    assert after(0.6) == pytest.approx(3.5, abs=1.0)
    assert after(1.5) < 0.5


def test_eyes_drift_home_in_the_dark_when_the_integrator_leaks() -> None:
    trace = run(dark, dark, 1.0, BinocularParams(hold_s=25.0), start=(20.0, 0.0))
    assert -np.diff(trace.version)[0] / DT == pytest.approx(20.0 / 25.0, rel=0.01)
    kept = run(dark, dark, 1.0, start=(20.0, 0.0))
    assert kept.version[-1] == pytest.approx(20.0)


def test_a_saccade_prescribes_the_angles_and_pursuit_goes_on_after_it() -> None:
    controller = BinocularController(BinocularParams())
    speeds, before = [], 0.0
    for k in range(400):
        t = k * DT
        jump = (radians(20.0 * t), 0.0) if 1.0 <= t < 1.05 else None
        left, _ = controller.step(*(radians(20.0 * t),) * 2, AT_REST, DT, jump)
        speeds.append((degrees(left) - before) / DT)
        before = degrees(left)
    landed = round(1.05 / DT)
    assert speeds[landed - 5] == pytest.approx(20.0)
    # Right on the target, some 2.8 deg ahead of where pursuit alone would have been.
    assert all(-5.0 < v < 25.0 for v in speeds[landed : landed + 100])
    assert speeds[-1] == pytest.approx(20.0, abs=0.1)


def test_eyes_stop_at_their_limit() -> None:
    params = BinocularParams(eye_limit_deg=20.0, max_error_deg=90.0)
    trace = run(lambda t: 40.0, lambda t: 40.0, 3.0, params)
    assert trace.left.max() == pytest.approx(20.0)
    assert trace.right.max() == pytest.approx(20.0)


def test_servo_lead_advances_by_the_lag() -> None:
    led = run(lambda t: 20 * t, lambda t: 20 * t, 2.0, BinocularParams(servo_lead_ms=20.0))
    assert led.left[-1] - led.version[-1] == pytest.approx(20.0 * 0.020, abs=0.01)

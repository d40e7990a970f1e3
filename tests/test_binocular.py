"""The eyes of the profile mitake against the numbers of their controller.

Checks are listed in docs/checks.md; tests/test_reference_binocular.py holds the reference model to
the same. A head that does at once what it is told; degrees and seconds; an angle of tick k
holds from the end of that period on.
"""

from collections.abc import Callable
from dataclasses import replace
from math import cos, degrees, pi, radians, sin, tan
from typing import NamedTuple

import numpy as np
import pytest
from gaze_targets import DT, joints_at, target
from gaze_trace_rig import CENTRED, DESK, Rig
from msgspec import structs

from gazerig.config.rig import GazeConfig
from gazerig.config.schema import load_rig
from gazerig.gaze.angles import add, angle_between, direction, scale
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.oculomotor.binocular import BinocularController, EyeGeometry, Eyes
from gazerig.gaze.oculomotor.gaze_point import OculomotorParams
from gazerig.gaze.types import Target, Vec3
from gazerig.robot.model.kinematics import GeometryParams

HALF_M = CENTRED.interocular_mm / 2e3
FAR_M = 10.0


def mitake() -> GazeConfig:
    return load_rig("desk", profile="mitake").gaze


def at_once() -> OculomotorParams:
    return replace(mitake().oculomotor, eye_lag_ms=0.0)


class NoSaccades:
    is_saccade_due = is_correction_due = False


class Alone:
    """Eyes that the controller moves without any saccade, on a head that is held."""

    def __init__(self, geometry: GeometryParams = CENTRED) -> None:
        self.kinematics = Rig(geometry=geometry).kinematics
        self._controller, self._gaze = BinocularController(), (1.0, 0.0, 0.0)

    def tick(self, target: Target, head_rad: tuple[float, ...], t: float, dt: float) -> Eyes:
        state = self.kinematics.forward(joints_at(*(0.0,) * 6, *head_rad))
        on = self.kinematics.eye_angles_to
        view = EyeGeometry(state.R_world_head, state.p_world_head_m, on, lambda eyes: eyes)
        if not self._controller.started:
            self._gaze = target.p_world_m
        eyes, self._gaze = self._controller.fixate(
            target, self._gaze, None, NoSaccades(), view, t, dt
        )
        return eyes


class Followed(NamedTuple):
    """Time at which each angle holds, version and vergence; degrees."""

    t: np.ndarray
    version: np.ndarray
    vergence: np.ndarray


def aim(
    yaw_deg: float, speed_deg_s: float = 0.0, distance: float = FAR_M, t: float = 0.0
) -> Target:
    """Return a target in a present frame that moves around the head."""
    p = scale(direction((radians(yaw_deg), 0.0)), distance)
    v = scale((-p[1], p[0], 0.0), radians(speed_deg_s))
    return target(p, v, t, "thing", salience=0.2)


def eyes(
    where: Callable[[float], Target],
    seconds: float,
    dt: float = DT,
    begin: Target | None = None,
    turning: Callable[[float], float] | None = None,
    geometry: GeometryParams = CENTRED,
) -> Followed:
    """Let the eyes follow; they begin at rest on ``begin`` or the first target.

    turning: yaw of the head in radians, which is held by hand
    """
    alone, rows = Alone(geometry), []
    first = begin if begin is not None else structs.replace(where(0.0), v_world_m_s=(0.0, 0.0, 0.0))
    settle = round(4.0 / dt)
    for k in range(-settle, round(seconds / dt)):
        t = k * dt
        target = where(t) if k >= 0 else structs.replace(first, at_s=t)
        yaw = turning(max(0.0, t)) if turning is not None else 0.0
        left, right = (eye[0] for eye in alone.tick(target, (yaw, 0.0, 0.0), t, dt))
        if k >= 0:
            rows.append((t + dt, degrees(0.5 * (left + right)), degrees(right - left)))
    return Followed(*np.array(rows).T)


def ramp_numbers(speed: float, dt: float) -> tuple[float, float, float, float]:
    """Return onset, time to 90 %, steady gain, lag in seconds."""
    start = -0.6 * speed
    trace = eyes(lambda t: aim(start + speed * t, speed, t=t), 1.2, dt)
    trace = trace._replace(version=trace.version - start)
    speeds = np.diff(trace.version, prepend=0.0) / dt
    starts = trace.t - dt
    onset = starts[np.argmax(speeds > 0.05 * speed)]
    t90 = starts[np.argmax(speeds > 0.9 * speed)]
    lag = trace.t[-1] - trace.version[-1] / speed
    return float(onset), float(t90), float(speeds[-1] / speed), float(lag)


def sine_numbers(hz: float, dt: float) -> tuple[float, float]:
    """Return gain and phase in degrees of +-5 deg, over the last whole cycles."""
    w = 2.0 * pi * hz
    cycles = 2 if hz < 0.3 else 4
    trace = eyes(lambda t: aim(5.0 * sin(w * t), 5.0 * w * cos(w * t), t=t), cycles / hz, dt)
    keep = trace.t > trace.t[-1] - cycles / 2 / hz + 1e-9
    z = 2j * np.mean(trace.version[keep] * np.exp(-1j * w * trace.t[keep])) / 5.0
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
    ramp, sine = np.array(ramp_numbers(20.0, DT)), sine_numbers(0.5, DT)
    for dt in (0.010, 0.002):
        change = np.abs(np.array(ramp_numbers(20.0, dt)) - ramp)
        assert change[[0, 1, 3]].max() <= 0.010
        assert change[2] <= 0.05
        gain, phase = sine_numbers(0.5, dt)
        assert gain == pytest.approx(sine[0], rel=0.05)
        assert abs(phase - sine[1]) / 360.0 / 0.5 <= 0.010


def test_a_step_of_the_target_is_no_velocity() -> None:
    begin = aim(0.0, t=-4.0)
    trace = eyes(lambda t: aim(1.5, 1e-6, t=t), 1.5, begin=begin)
    for share, time in ((0.05, 0.110), (0.63, 0.220), (0.90, 0.380)):
        assert trace.t[np.argmax(trace.version >= share * 1.5)] == pytest.approx(time, abs=0.02)
    assert trace.version.max() <= 1.5 + 1e-3


def converging(vergence_deg: float) -> float:
    """Return the distance on which eyes converge by an angle."""
    return HALF_M / tan(radians(vergence_deg) / 2.0)


@pytest.mark.parametrize(("start", "step", "t63", "gain"), [(2, 4, 0.405, 4), (8, -4, 0.490, 3)])
def test_e25_vergence_step(start: float, step: float, t63: float, gain: float) -> None:
    near = converging(start + step)
    trace = eyes(
        lambda t: aim(0.0, 0.0, near, t), 2.0, begin=aim(0.0, 0.0, converging(start), -4.0)
    )
    done = (trace.vergence - start) / step
    assert trace.t[np.argmax(done >= 0.63)] == pytest.approx(t63, abs=0.03)
    # A first-order control peaks at its gain times the step: 16 and 12 deg/s.
    assert np.abs(np.diff(trace.vergence)).max() / DT == pytest.approx(gain * 4.0, rel=0.05)
    assert np.abs(trace.version).max() < 0.01


def test_e26_version_and_vergence_do_not_disturb_each_other() -> None:
    begin = aim(0.0, 0.0, converging(4.0), -4.0)

    def ends(version: float, vergence: float) -> Followed:
        # Where eyes at this version converge by that angle: on the circle through both.
        place = meeting(version, vergence)
        return eyes(lambda t: structs.replace(aim(0.0), p_world_m=place, at_s=t), 1.5, begin=begin)

    together, turned, nearer = ends(1.5, 6.0), ends(1.5, 4.0), ends(0.0, 6.0)
    assert np.abs(together.version - turned.version).max() < 0.01
    assert np.abs(together.vergence - nearer.vergence).max() < 0.01
    assert np.abs(turned.vergence - 4.0).max() < 0.01


def meeting(version_deg: float, vergence_deg: float) -> Vec3:
    """Return the point that the left and the right eye fixate at these angles."""
    left = tan(radians(version_deg - 0.5 * vergence_deg))
    right = tan(radians(version_deg + 0.5 * vergence_deg))
    x = 2.0 * HALF_M / (right - left)
    return x, HALF_M + x * left, 0.0


def test_e28_an_eye_that_cannot_follow_is_on_the_target_as_soon_as_it_can() -> None:
    # One camera sees for both eyes: a stopped eye continues with the other.
    rig = Rig(params=at_once(), pursuit=mitake().pursuit)
    span = (-1.0, 1.0)
    limits = ((span, span), ((-1.0, radians(-1.0)), span))
    rig.oculomotor.retune(at_once(), limits)
    path = lambda t: -3.0 + 1.5 * min(max(t - 1.0, 0.0), 1.0)  # noqa: E731
    last = None
    for k in range(800):
        t = k * DT
        speed = 1.5 if 1.0 <= t < 2.0 else 0.0
        last = rig.tick(aim(path(t), speed, t=t), t, DT)
    assert last is not None
    wanted = path(4.0)
    assert degrees(last.eye_left_rad[0]) == pytest.approx(wanted, abs=0.25)
    assert degrees(last.eye_right_rad[0]) == pytest.approx(wanted, abs=0.25)
    rig.oculomotor.retune(at_once(), ((span, span), ((-1.0, radians(-2.0)), span)))
    covered = rig.tick(aim(wanted, t=4.0), 4.0, DT)
    assert degrees(covered.eye_right_rad[0]) == pytest.approx(-2.0)
    assert degrees(covered.eye_left_rad[0]) == pytest.approx(
        degrees(last.eye_left_rad[0]), abs=0.01
    )
    rig.oculomotor.retune(at_once(), ((span, span), (span, span)))
    free = rig.tick(aim(wanted, t=4.005), 4.005, DT)
    assert abs(degrees(free.eye_right_rad[0] - last.eye_right_rad[0])) < 0.1


def reflex(hz: float, dt: float, held_ticks: float) -> complex:
    """Return gain and phase of the eyes in a head that swings by 10 deg in the dark.

    held_ticks: share of a tick by which an angle counts before the tick's end
    """
    w = 2.0 * pi * hz
    begin = aim(0.0, 0.0, 100.0, -4.0)
    lost = structs.replace(begin, v_world_m_s=(0.0, 1e-9, 0.0), at_s=0.0)
    trace = eyes(lambda t: lost, 4.0 / hz, dt, begin, lambda t: radians(10.0) * sin(w * t))
    keep = trace.t > 2.0 / hz
    at_s = trace.t[keep] - held_ticks * dt
    return complex(2j * np.mean(-trace.version[keep] * np.exp(-1j * w * at_s)) / 10.0)


@pytest.mark.parametrize(("hz", "phase", "residual"), [(0.5, -1.9, 0.033), (2.0, -7.6, 0.132)])
def test_e29_reflex_without_a_target(hz: float, phase: float, residual: float) -> None:
    # The command of tick k follows from the head at tick k and holds at its end.
    z = reflex(hz, 0.001, 0.0)
    assert abs(z) == pytest.approx(1.0, abs=0.02)
    assert degrees(np.angle(z)) == pytest.approx(phase, abs=2.0)
    assert abs(1.0 - z) == pytest.approx(residual, abs=0.02)


@pytest.mark.parametrize("dt", [0.001, 0.005, 0.010])
def test_e29_the_reflex_is_late_by_its_delay_and_no_part_of_a_tick(dt: float) -> None:
    # An angle is held for a tick: its middle counts.
    assert -np.angle(reflex(0.5, dt, 0.5)) / pi == pytest.approx(0.010, abs=0.0005)


def test_e31_eyes_hold_the_gaze_through_any_turn_of_the_head() -> None:
    alone = Alone(DESK)
    seen = target((1.5, 0.2, 0.2), kind="thing", salience=0.2)
    lost = structs.replace(seen, v_world_m_s=(0.0, 1e-9, 0.0))  # the reflex alone holds the gaze
    lines = []
    for k in range(620):
        share = min(max((k - 400) / 199, 0.0), 1.0)
        head = (radians(40.0) * share, radians(20.0) * share, radians(10.0) * share)
        left, right = alone.tick(seen if k < 390 else lost, head, k * DT, DT)
        state = alone.kinematics.forward(joints_at(*left, *right, 0.0, 0.0, *head))
        lines.append(add(line_of_sight(state, True), line_of_sight(state, False)))
    # It is late by its delay of 10 ms, and turns of three axes do not commute.
    assert max(degrees(angle_between(one, lines[389])) for one in lines[400:]) < 0.9


def test_e58_a_lost_target_fades() -> None:
    def where(t: float) -> Target:
        seen_s = min(t, 2.0)
        return aim(20.0 * seen_s - 25.0, 20.0, t=seen_s)

    trace = eyes(where, 4.0)
    speeds = np.diff(trace.version) / DT

    def after(s: float) -> float:
        return float(speeds[round((2.0 + s) / DT)])

    # The last observation arrives after a delay, and one missed frame is not yet a loss.
    assert after(0.1) == pytest.approx(20.0, abs=0.5)
    assert after(0.3) == pytest.approx(9.6, abs=2.0)
    assert after(0.6) / after(0.3) == pytest.approx(np.exp(-1.0), rel=0.05)
    assert after(1.5) < 0.5


def test_a_saccade_prescribes_the_angles_and_pursuit_goes_on_after_it() -> None:
    rig = Rig(params=at_once(), pursuit=mitake().pursuit)
    yaws, phases = [], []
    for k in range(400):
        t = k * DT
        jump, seen_s = 8.0 if t >= 1.0 else 0.0, t - 0.07
        aimed = aim(20.0 * seen_s + jump - 20.0, 20.0, t=seen_s)
        command = rig.tick(structs.replace(aimed, shift=1 if t < 1.0 else 2), t, DT)
        yaws.append(degrees(0.5 * (command.eye_left_rad[0] + command.eye_right_rad[0])))
        phases.append(command.phase)
    speeds = np.diff(yaws) / DT
    landed = max(k for k in range(200, 240) if phases[k] == "saccade") + 2
    assert speeds[195] == pytest.approx(20.0, abs=1.0)
    assert speeds[landed : landed + 100].min() > -5.0
    assert speeds[landed : landed + 100].max() < 35.0
    assert speeds[-1] == pytest.approx(20.0, abs=1.0)

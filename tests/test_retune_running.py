"""What a running head does with a changed range, zero, rate or detector."""

import json

import numpy as np
import pytest
from desk import GAZE_JOINTS
from retuned_run import DT_S, RIG, Judge, Running, fresh, inside, put, started

from gazerig.config.parameters import changed, value_of
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.model.command_json import as_json, from_json
from gazerig.robot.model.commands import Jog, Resume, Stop, Tune, Value


def test_a_tune_of_nothing_different_touches_nothing() -> None:
    quiet, tuned = started(), started()
    quiet.go(200)
    tuned.go(100)
    same = {key: value_of(RIG, key) for key in ("gaze.lids.blinks_per_min", "guard.soft_start_ms")}
    tuned.made.robot.command(Tune(tuple(same.items())))
    tuned.go(100)
    assert tuned.goals == quiet.goals
    assert tuned.ticks[100].events == tuple(f"tuned: {key} = {same[key]}" for key in same)


def test_a_tune_is_in_force_at_the_very_next_tick_and_in_its_record() -> None:
    running = started()
    running.go(10)
    running.tune({"loop.park_s": 1.5, "bus.port": "/dev/ttyACM0"})
    tick = running.go(1)
    assert tick.commands == (Tune((("bus.port", "/dev/ttyACM0"), ("loop.park_s", 1.5))),)
    assert running.made.loop.park_s == 1.5
    assert tick.events[1] == "tuned: loop.park_s = 1.5"
    assert "next start: the servo bus is opened with it" in tick.events[0]


def test_an_order_that_crossed_processes_is_checked_in_its_tick() -> None:
    running = started()
    running.go(10)
    order = from_json(json.loads(json.dumps(as_json(Tune((("gaze.lids.close_ms", 90.0),))))))
    running.made.robot.command(order)
    running.go(1)
    assert running.rig.gaze.lids.close_ms == 90.0
    running.made.robot.command(Tune((("gaze.lids.close_ms", 9000.0), ("gaze.lid.x", 1))))
    tick = running.go(1)
    assert running.rig.gaze.lids.close_ms == 90.0
    assert "not tuned: gaze.lids.close_ms: 9000.0 is above 500 (unit ms)" in tick.events
    assert any("gaze.lid: unknown key" in line for line in tick.events)


def test_orders_of_a_run_do_it_again_bit_for_bit() -> None:
    def play() -> list[list[int]]:
        running = started("boxing")
        running.go(50)
        running.made.robot.command(
            Tune((("joints.neck_yaw.max_deg", 5.0), ("gaze.head.align", 1.0)))
        )
        running.go(100)
        running.made.robot.command(Tune((("gaze.scanpath.model", "random"),)))
        running.go(100)
        return running.goals

    assert play() == play()


def test_a_joint_outside_its_new_range_is_led_inside_slowly() -> None:
    running = started()
    jog(running, "neck_yaw", 40.0, 300)
    assert running.ticks[-1].guard_result.command_rad[6] == pytest.approx(
        np.radians(40.0), abs=1e-3
    )
    running.tune({"joints.neck_yaw.max_deg": 20.0, "joints.neck_yaw.min_deg": -20.0})
    judge = Judge(running)
    first = running.ticks[-1].guard_result.command_rad[6]
    judge.go(1)
    verdict = running.ticks[-1].guard_result
    assert abs(verdict.command_rad[6] - first) < np.radians(60.0) * DT_S
    assert "neck_yaw: outside its new range" in verdict.reasons
    judge.go(300)
    assert running.ticks[-1].guard_result.command_rad[6] == pytest.approx(
        np.radians(20.0), abs=1e-3
    )
    speeds = np.diff([t.guard_result.command_rad[6] for t in running.ticks[-300:]]) / DT_S
    assert np.abs(speeds).max() <= np.radians(60.0) + 1e-6


def jog(running: Running, joint: str, deg: float, ticks: int) -> None:
    """Send one joint somewhere by hand, beyond its range as well."""
    running.made.robot.replay_command(Jog(((joint, float(np.radians(deg))),), stay=True))
    running.go(ticks)


def test_a_wider_range_waits_until_the_servos_are_set_up_anew() -> None:
    running = started()
    running.tune({"joints.neck_yaw.max_deg": 73.0, "joints.neck_yaw.max_speed_deg_s": 250.0})
    running.go(1)
    assert "neck_yaw: all of the range and speed come with a stop and a resume" in (
        running.ticks[-1].events
    )
    jog(running, "neck_yaw", 80.0, 500)
    held = np.degrees(running.ticks[-1].guard_result.command_rad[6])
    assert held == pytest.approx(70.0, abs=0.1)
    running.made.robot.command(Stop("test"))
    running.go(401)
    running.made.robot.command(Resume())
    running.go(200)
    jog(running, "neck_yaw", 80.0, 800)
    assert np.degrees(running.ticks[-1].guard_result.command_rad[6]) == pytest.approx(73.0, abs=0.1)
    measured = np.degrees(running.ticks[-1].joints.position_rad[6])
    assert measured == pytest.approx(73.0, abs=1.0)
    assert max(goals[6] for goals in running.goals) > 2844  # the old end in steps


@pytest.mark.parametrize(
    "changes",
    [
        {"joints.neck_pitch.zero_step": 2200},
        {"joints.neck_pitch.sign": -1},
        {"joints.neck_pitch.ratio": 1.5},
        {"joints.left_eye_pan.zero_step": 1900, "joints.left_eye_pan.sign": -1},
    ],
)
def test_a_changed_zero_moves_the_joint_without_a_jump(changes: dict[str, Value]) -> None:
    running = started()
    running.go(300)
    judge = Judge(running)
    before = list(running.goals[-1])
    running.tune(changes)
    judge.go(1)
    # A lid in a blink goes 27 steps in a tick.
    assert np.abs(np.subtract(running.goals[-1], before)).max() <= 30
    judge.go(500)
    tick = running.ticks[-1]
    assert tick.guard_result.level in ("ok", "limited")
    off = np.subtract(tick.guard_result.command_rad, tick.joints.position_rad)
    off_deg = dict(zip(GAZE_JOINTS, np.degrees(np.abs(off)), strict=True))
    assert max(deg for name, deg in off_deg.items() if "lid" not in name) < 4.0  # those may blink


def test_another_rate_goes_on_from_the_last_slot() -> None:
    made = fresh(RIG)
    made.robot.start(made.clock)
    times: list[float] = []

    def watch(tick: Tick) -> None:
        times.append(tick.t_s)
        if len(times) == 100:
            made.robot.command(Tune((("loop.rate_hz", 50.0),)))

    run(made.robot, made.clock, lambda: made.loop, lambda s: "over" if s > 1.5 else None, watch)
    gaps = np.diff(times)
    assert gaps[:99] == pytest.approx(0.005)
    # The tick that reads the order is at its old slot, all after it at new ones.
    assert gaps[100:] == pytest.approx(0.02)


def test_what_looks_at_pictures_is_retuned_too() -> None:
    made = assemble(RIG, RunOptions(True, True, 0, "visitor", pixels=True))
    camera = made.live.parts.camera
    other = changed(RIG, {"detector.min_face_px": 60, "motion.max_blobs": 3})
    put(made, other)
    held = inside(vars(camera), "", {})
    assert 60 in [v for k, v in held.items() if k.endswith("_params.min_face_px")]
    assert 3 in [v for k, v in held.items() if k.endswith("_params.max_blobs")]
    said = put(made, changed(other, {"detector.kind": "yunet"}))
    assert "the detector is unchanged" in said[-1]

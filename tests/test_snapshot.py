"""Snapshots of a running rig for people: nothing is lost between two of them."""

from functools import cache

import numpy as np
import pytest
from desk import GAZE_JOINTS
from fakes.runs import play, simulated
from msgspec.structs import replace
from page_feed import STATE

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.control.loop import Tick
from gazerig.robot.dashboard.feed.snapshot import SnapshotBuilder
from gazerig.robot.model.types import Snapshot
from gazerig.robot.safety.health import HOT_C

pytestmark = pytest.mark.usefixtures("ideal_servos")

TICKS_BETWEEN = 8


@cache
def visit() -> tuple[Assembly, tuple[Tick, ...]]:
    """Some seconds of a rig that talks with a person."""
    made = simulated("desk", "face-to-face")
    ticks: list[Tick] = []
    play(made, 8.0, ticks.append)
    return made, tuple(ticks)


@cache
def taken() -> tuple[Snapshot, ...]:
    snapshots = SnapshotBuilder(visit()[0].shown_rig())
    out = []
    for number, tick in enumerate(visit()[1]):
        snapshots.update(tick)
        if number % TICKS_BETWEEN == TICKS_BETWEEN - 1:
            shot = snapshots.build(STATE)
            assert shot is not None
            out.append(shot)
    return tuple(out)


def test_nothing_is_shown_before_the_first_tick() -> None:
    assert SnapshotBuilder().build(STATE) is None


def test_joints_are_shown_a_hundred_times_a_second_as_wished_permitted_and_measured() -> None:
    by_time = {tick.t_s: tick for tick in visit()[1]}
    rows = [row for shot in taken() for row in shot.trail]
    assert np.allclose(np.diff([row.t_s for row in rows]), 0.01)
    for row in rows:
        tick = by_time[row.t_s]
        assert row[1:] == (
            tick.desired_rad,
            tick.guard_result.command_rad,
            tick.joints.position_rad,
        )


def test_the_camera_sits_on_the_head_and_sees_the_face() -> None:
    shot = taken()[-1]
    assert shot.camera is not None
    p, R = np.array(shot.camera.p_world_camera_m), np.array(shot.camera.R_world_camera)
    x, y, z = R.T @ (np.array(shot.faces[0].p_world_m) - p)
    assert z > 0.0
    assert abs(x / z) < np.tan(shot.camera.horizontal_rad / 2)
    assert abs(y / z) < np.tan(shot.camera.horizontal_rad / 2) / shot.camera.aspect
    assert np.linalg.norm(p - shot.p_world_head_m) < 0.1


def test_servos_come_with_their_limits_and_their_silences() -> None:
    made, ticks = visit()
    snapshots = SnapshotBuilder(made.shown_rig())
    silent = replace(ticks[3].joints, missing=("neck_yaw",))
    for tick in (*ticks[:3], replace(ticks[3], joints=silent)):
        snapshots.update(tick)
    shot = snapshots.build(STATE)
    assert shot is not None and shot.servos.limits is not None
    assert shot.servos.unanswered == tuple(int(name == "neck_yaw") for name in GAZE_JOINTS)
    hottest = load_rig("desk").joints["neck_yaw"].limit().hottest_c
    assert shot.servos.limits.hot_c[6] == hottest - HOT_C
    assert shot.servos.limits.warm_c[6] < shot.servos.limits.hot_c[6]


def test_the_gravest_verdict_between_two_snapshots_is_kept() -> None:
    ticks = visit()[1]
    snapshots = SnapshotBuilder()
    calm = [tick for tick in ticks if tick.guard_result.level == "ok"][:4]
    short = replace(calm[1], guard_result=replace(calm[1].guard_result, level="hold"))
    for tick in (calm[0], short, calm[2]):
        snapshots.update(tick)
    shot = snapshots.build(STATE)
    assert shot is not None and (shot.level, shot.worst) == ("ok", "hold")
    snapshots.update(calm[3])
    after = snapshots.build(STATE)
    assert after is not None and after.worst == "ok"

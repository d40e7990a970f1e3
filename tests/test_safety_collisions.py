"""Forbidden pairs of joint ranges: never entered, never crossed, left gently."""

from collections.abc import Callable
from math import degrees, radians

import numpy as np
import pytest
from desk import GAZE_JOINTS
from guarded_desk import DT, ZERO, guarding, joints_at

from gazerig.config.validation import validate
from gazerig.robot.model.guard_params import CollisionParams, GuardParams
from gazerig.robot.model.types import GuardResult

LEFT, RIGHT, PITCH = (
    GAZE_JOINTS.index(n) for n in ("left_upper_lid", "right_upper_lid", "neck_pitch")
)
LID = CollisionParams(("neck_pitch", -30.0, -18.0), ("left_upper_lid", 10.0, 25.0))


class World:
    """Joints one tick behind their commands."""

    def __init__(self, *pairs: CollisionParams, **start_deg: float) -> None:
        start = tuple(radians(start_deg.get(name, 0.0)) for name in GAZE_JOINTS)
        self.guard = guarding(start, gentle=True, collisions=pairs)
        self.pairs = pairs
        self.t_s = 0.0
        self.path = [start]
        self.measured: Callable[[tuple[float, ...]], tuple[float, ...]] = lambda angles: angles

    def awake(self) -> "World":
        self.guard._gentle = [False] * 9
        return self

    def tick(self, dt_s: float = DT, **desired_deg: float) -> GuardResult:
        self.t_s += dt_s
        joints = joints_at(self.measured(self.path[-1]), self.t_s)
        desired = tuple(radians(desired_deg.get(name, 0.0)) for name in GAZE_JOINTS)
        verdict = self.guard.check(desired, joints, 0.0, self.t_s)
        self.path.append(verdict.command_rad)
        return verdict

    def angle(self, joint: int) -> float:
        return degrees(self.path[-1][joint])

    def crossed(self) -> bool:
        """Whether the straight path between any two successive commands touches a box."""
        path = np.degrees(np.array(self.path))
        for pair in self.pairs:
            (first, *one), (second, *other) = pair.first, pair.second
            places = path[:, [GAZE_JOINTS.index(first), GAZE_JOINTS.index(second)]]
            low, high = np.array([one, other]).T
            if touches(places[:-1], places[1:], low, high).any():
                return True
        return False


def touches(begin: np.ndarray, end: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Whether the straight line of each step (n, 2) meets the box, by slabs."""
    way = end - begin
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - begin) / way, (high - begin) / way
    still = way == 0.0
    inside = (begin >= low) & (begin <= high)
    enter = np.where(still, np.where(inside, -np.inf, np.inf), np.minimum(a, b)).max(axis=1)
    leave = np.where(still, np.where(inside, np.inf, -np.inf), np.maximum(a, b)).min(axis=1)
    return (enter <= leave) & (enter <= 1.0) & (leave >= 0.0)


def test_one_joint_waits_at_its_wall_and_the_other_is_free() -> None:
    world = World(LID).awake()
    for _ in range(400):
        verdict = world.tick(neck_pitch=-25.0, left_upper_lid=20.0)
    assert world.angle(PITCH) == pytest.approx(-17.0) and world.angle(LEFT) == pytest.approx(20.0)
    assert verdict.reasons == ("neck_pitch: self-collision",) and verdict.level == "limited"
    for _ in range(400):  # the lid makes room
        verdict = world.tick(neck_pitch=-25.0, left_upper_lid=0.0)
    assert world.angle(PITCH) == pytest.approx(-25.0) and verdict.level == "ok"
    for _ in range(400):
        verdict = world.tick(neck_pitch=-25.0, left_upper_lid=20.0)
    assert world.angle(LEFT) == pytest.approx(9.0) and world.angle(PITCH) == pytest.approx(-25.0)
    assert verdict.reasons == ("left_upper_lid: self-collision",)
    for _ in range(400):
        verdict = world.tick(neck_pitch=-40.0, left_upper_lid=20.0)
    assert world.angle(LEFT) == pytest.approx(20.0) and world.angle(PITCH) == pytest.approx(-40.0)
    for _ in range(400):
        world.tick(neck_pitch=0.0, left_upper_lid=20.0)
    assert world.angle(PITCH) == pytest.approx(-31.0)
    for _ in range(400):
        world.tick(neck_pitch=0.0, left_upper_lid=-20.0)
    assert world.angle(PITCH) == pytest.approx(0.0, abs=1e-6)
    assert not world.crossed()


@pytest.mark.parametrize("off", np.linspace(-0.3, 0.3, 25).tolist())
def test_the_four_walls_are_swept_densely(off: float) -> None:
    for pitch, lid in ((-17.0 + off, 20.0), (-31.0 + off, 20.0), (-24.0, 9.0 + off)):
        world = World(LID, neck_pitch=-45.0 if pitch < -30.0 else 0.0).awake()
        for _ in range(200):
            world.tick(neck_pitch=pitch, left_upper_lid=0.0 if lid > 10.0 else lid)
            if lid > 10.0:
                world.tick(neck_pitch=-45.0 if pitch < -30.0 else 0.0, left_upper_lid=lid)
        for _ in range(400):
            world.tick(neck_pitch=pitch, left_upper_lid=lid)
        apart = (
            world.angle(PITCH) >= -17.0 - 1e-6
            or world.angle(PITCH) <= -31.0 + 1e-6
            or world.angle(LEFT) <= 9.0 + 1e-6
        )
        assert apart and not world.crossed()


def test_the_other_joint_waits_until_the_first_is_measured_out() -> None:
    world = World(LID, neck_pitch=-24.0, left_upper_lid=0.0).awake()
    at_first = world.path[-1]
    world.measured = lambda angles: (*angles[:PITCH], at_first[PITCH], *angles[PITCH + 1 :])
    for _ in range(24):  # the neck lags: its command leaves, its head does not yet
        world.tick(neck_pitch=0.0, left_upper_lid=20.0)
    assert world.angle(PITCH) > -16.0 and world.angle(LEFT) <= 9.0 + 1e-9
    world.measured = lambda angles: angles
    for _ in range(100):
        world.tick(neck_pitch=0.0, left_upper_lid=20.0)
    assert world.angle(LEFT) == pytest.approx(20.0)


def test_a_keeper_pushed_in_by_hand_keeps_the_other_out() -> None:
    world = World(LID).awake()
    world.measured = lambda angles: (*angles[:PITCH], radians(-20.0), *angles[PITCH + 1 :])
    for _ in range(25):
        world.tick(left_upper_lid=20.0)
    assert world.angle(LEFT) <= 9.0 + 1e-9


@pytest.mark.parametrize("pitch", [-29.9, -24.0, -18.1])
@pytest.mark.parametrize("lid", [10.1, 17.0, 24.9])
def test_who_begins_in_a_box_is_led_out_gently(pitch: float, lid: float) -> None:
    world = World(LID, neck_pitch=pitch, left_upper_lid=lid)
    verdict = world.tick(neck_pitch=pitch, left_upper_lid=lid)
    assert verdict.level == "hold"
    collide = {"neck_pitch: self-collision", "left_upper_lid: self-collision"}
    assert {one for one in verdict.reasons if "slowly" not in one} == collide
    out = [
        p for p in range(400) if world.tick(neck_pitch=pitch, left_upper_lid=lid).level == "hold"
    ]
    assert 0 < len(out) < 399
    path = np.degrees(np.array(world.path))[:, [PITCH, LEFT]]
    speeds = np.diff(path[: len(out)], axis=0) / DT
    assert np.abs(speeds).max() <= 60.0 + 1e-6
    assert np.abs(np.diff(speeds, axis=0, prepend=0.0)).max() <= 301.0 * DT
    assert (np.ptp(path[: len(out)], axis=0) == 0.0).sum() == 1  # the other one waits
    assert not touches(
        path[-2:-1], path[-1:], np.array([-30.0, 10.0]), np.array([-18.0, 25.0])
    ).any()


def test_a_rearmed_joint_inside_a_box_is_led_out() -> None:
    world = World(LID).awake()
    for _ in range(100):
        world.tick(left_upper_lid=20.0)
    world.t_s += DT
    at = (*world.path[-1][:PITCH], radians(-24.0), *world.path[-1][PITCH + 1 :])
    again = tuple(k == PITCH for k in range(9))
    joints = joints_at(at, world.t_s, rearmed=again)
    verdict = world.guard.check(ZERO, joints, 0.0, world.t_s)
    assert verdict.applied("neck_pitch").reason == "self-collision"
    world.path.append(verdict.command_rad)
    for _ in range(400):
        verdict = world.tick(left_upper_lid=20.0)
    assert verdict.level == "ok"


def test_pairs_come_from_the_rig_file_and_wrong_ones_are_refused() -> None:
    pair = {"first": ("neck_pitch", -30, -18), "second": ("left_upper_lid", 10, 25)}
    params, errors = validate(GuardParams, {"collisions": (pair,)})
    assert errors == [] and params is not None and params.collisions == (LID,)
    wrong: list[tuple[dict[str, object], str]] = [
        ({"second": ("neck_pitch", 10, 25)}, "first and second are both neck_pitch"),
        ({"first": ("neck_pitch", -30, -30)}, "neck_pitch: -30 must be below -30"),
    ]
    for change, says in wrong:
        params, errors = validate(GuardParams, {"collisions": ({**pair, **change},)})
        assert params is None and len(errors) == 1
        assert says in errors[0].rule


def test_a_pair_that_leaves_no_pose_is_refused() -> None:
    whole = CollisionParams(("neck_pitch", -60.0, 50.0), ("left_upper_lid", -34.5, 34.5))
    with pytest.raises(ValueError, match="neck_pitch -60..50 deg of -60..50 with left_upper_lid"):
        guarding(collisions=(whole,))

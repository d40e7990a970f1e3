"""Facial expressions and levels: tables, blending, commands, and what is refused."""

from collections.abc import Iterator
from dataclasses import replace
from math import degrees, radians
from random import Random

import pytest
from expressive_rig import expressive_rig, faults, started
from fakes.runs import ticks
from ticked_rig import TickedRig, connected, gazerig

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.gaze.minimum_jerk import PEAK_SPEED, MinimumJerkBlend
from gazerig.gaze.track.animation import HOLD_S, LevelParams
from gazerig.gaze.track.track import HEAD, LIDS
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import Express, SetLevel
from gazerig.robot.run.rig_limits import offsets
from gazerig.robot.run.run import Run

DT = 0.005


@pytest.fixture
def made() -> Iterator[Run]:
    made = started()
    yield made
    made.close()


def desired_deg(made: Run, tick: Tick) -> dict[str, float]:
    return dict(zip(made.robot.body.names, map(degrees, tick.desired_rad), strict=True))


def test_an_interrupted_blend_never_jumps_and_never_leaves_the_goals():
    """At 1,000 random moments the goal changes; steps stay below those of one full move."""
    random = Random(4)
    goals = [(0.0,), (14.0,), (-12.0,), (6.0,)]
    blend, t, last, largest = MinimumJerkBlend(goals[0], 0.5), 0.0, 0.0, 0.0
    for _ in range(1000):
        blend.move_to(random.choice(goals))
        for _ in range(random.randrange(1, 120)):
            t += DT
            (value,) = blend.step(t)
            largest, last = max(largest, abs(value - last)), value
            assert -12.0 - 1e-9 <= value <= 14.0 + 1e-9
    assert 0.2 < largest <= PEAK_SPEED * 26.0 / 0.5 * DT


def test_a_blend_ends_exactly_at_its_goal_and_then_costs_nothing():
    blend = MinimumJerkBlend((0.1,), 0.5)
    for k in range(200):
        if k < 60:
            blend.move_to((0.1 * k,))
        value = blend.step(k * DT)
    assert value == (0.1 * 59,)
    assert blend.step(2.0) is blend.step(3.0)


def test_an_expression_moves_joints_brows_and_head_and_the_eyes_stay_on_target(made):
    ticks(made, 200)
    made.robot.command(Express("happy"))
    last = ticks(made, 200)[-1]
    angles = desired_deg(made, last)
    assert (angles["jaw"], angles["left_brow"]) == pytest.approx((6.0, 8.0))
    plain = started(replace(expressive_rig(), expressions={}))
    quiet = desired_deg(plain, ticks(plain, 400)[-1])
    assert angles["neck_roll"] - quiet["neck_roll"] == pytest.approx(4.0, abs=0.2)
    assert angles["left_eye_tilt"] != pytest.approx(quiet["left_eye_tilt"], abs=0.01)
    plain.close()


def test_a_lid_keeps_shutting_in_a_sad_face():
    sad = offsets(expressive_rig(), {"left_upper_lid": -15.0})
    assert sad[LIDS] == pytest.approx([-15.0 / 45.0, 0.0, 0.0, 0.0])


def test_a_level_moves_the_jaw_and_falls_to_0_within_a_second(made):
    for _ in range(100):
        made.robot.command(SetLevel("mouth", 0.7))
        last = ticks(made, 1)[-1]
    assert desired_deg(made, last)["jaw"] == pytest.approx(7.0)
    after = ticks(made, 200)
    assert desired_deg(made, after[int(HOLD_S / DT) - 5])["jaw"] == pytest.approx(7.0)
    assert desired_deg(made, after[-1])["jaw"] == 0.0
    said = [event for tick in after for event in tick.events if "level" in event]
    assert said == ["level mouth: not set any more, so it returns to 0"]


def test_a_level_adds_to_an_expression(made):
    made.robot.command(Express("happy"))
    ticks(made, 200)
    for _ in range(40):
        made.robot.command(SetLevel("mouth", 1.0))
        last = ticks(made, 1)[-1]
    assert desired_deg(made, last)["jaw"] == pytest.approx(16.0)


@pytest.mark.parametrize(
    ("face", "blend_s", "said"),
    [
        ({"left_eye_pan": 5.0}, 0.5, "only gaze turns the eyes"),
        ({"javv": 5.0}, 0.5, "no joint 'javv'; available: "),
        ({"jaw": 26.0}, 0.5, "26.0 is outside the joint's range -2.0..25.0"),
        ({"neck_roll": 20.0}, 0.1, "cannot move 20 deg within 0.1 s"),
        ({"neck_roll": 5.0}, 0.1, "must be at least 0.12 s"),
    ],
)  # fmt: skip
def test_an_expression_that_no_joint_can_do_is_refused(face, blend_s, said):
    rig = replace(expressive_rig(), expressions={"odd": face}, expression_blend_s=blend_s)
    (fault,) = faults(rig)
    assert fault.startswith(f"expressions.odd.{next(iter(face))}: ") and said in fault


@pytest.mark.parametrize(
    ("level", "said"),
    [
        (LevelParams("left_eye_tilt", 0.0, 5.0), "mouth: only gaze turns the eyes"),
        (LevelParams("jaw", 0.0, 40.0), "mouth: 40.0 is outside"),
        (LevelParams("jaw", 0.0, 20.0, 20.0), "mouth: jaw cannot move 20 deg within 0.02 s"),
    ],
)
def test_a_level_that_no_joint_can_follow_is_refused(level, said):
    found = faults(replace(expressive_rig(), levels={"mouth": level}))
    assert any(said in fault for fault in found)


def test_the_range_of_a_neck_at_full_strength_counts():
    rig = replace(expressive_rig(), expressions={"shy": {"neck_pitch": -36.0}})
    assert any("outside the joint's range -35.0..35.0" in fault for fault in faults(rig))
    assert offsets(rig, {"neck_pitch": -20.0})[HEAD].tolist() == [0.0, radians(-20.0), 0.0]


# ---- Joints of any name: a jaw, brows, ears.


def with_joint(name: str) -> Rig:
    """Return the desk rig with one more joint, on a servo of its own."""
    rig = load_rig("desk")
    jaw = replace(rig.joints["left_upper_lid"], id=42, min_deg=-2.0, max_deg=25.0)
    return replace(rig, joints={name: jaw, **rig.joints})


def test_a_jaw_is_a_joint_and_a_misspelt_neck_is_not():
    assert faults(with_joint("jaw")) == []
    rig = with_joint("nek_yaw")
    without = replace(rig, joints={k: v for k, v in rig.joints.items() if k != "neck_yaw"})
    assert any("joints.nek_yaw: did you mean neck_yaw" in fault for fault in faults(without))
    assert any(
        "joints.Jaw!: not a valid joint name" in fault for fault in faults(with_joint("Jaw!"))
    )


# ---- Expressions and levels from the command line, from Python and on the page.


@pytest.fixture
def rig(monkeypatch) -> Iterator[TickedRig]:
    yield from connected(monkeypatch)


def test_expressions_and_levels_from_the_command_line(rig):
    assert "expression happy is active" in gazerig("ctl", "ask", "expression", "happy")
    assert rig.tick(200)["jaw"] == pytest.approx(6.0)
    assert "expression: happy (in force), neutral, sad" in gazerig("ctl", "ask", "expression")
    assert "done" in gazerig("ctl", "do", '{"do": "set_level", "level": "mouth", "value": 0.7}')
    assert rig.commands[-1] == SetLevel("mouth", 0.7)
    assert "no level 'ear'; available: mouth" in gazerig(
        "ctl", "do", '{"do": "set_level", "level": "ear", "value": 1}'
    )
    assert "Invalid value 'dance'" in gazerig("ctl", "do", '{"do": "dance"}')

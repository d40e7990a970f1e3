"""What people ask of a running robot: checked, obeyed at the next tick, and safe."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import degrees, inf, nan, pi, radians
from typing import Any

import pytest
from desk import JOINTS
from hypothesis import given
from hypothesis import strategies as st

from config.schema import load_rig
from robot.assemble import Assembly, assemble
from robot.choice import Choice
from robot.loop import Tick, run
from robot.orders import Ask, Jog, LookAt, Order, Resume, Stop, Tune, as_json, check, from_json
from robot.session import leave

YAW = JOINTS.index("neck_yaw")


@dataclass
class Running:
    """A simulated rig that ticks on when asked."""

    made: Assembly
    ticks: list[Tick] = field(default_factory=list)

    def go(self, seconds: float) -> list[Tick]:
        """Run on; give the new ticks."""
        began = len(self.ticks)
        self.count = run(
            self.made.robot,
            self.made.clock,
            self.made.loop,
            lambda s: "seconds" if s >= seconds else None,
            self.ticks.append,
        )
        return self.ticks[began:]

    def order(self, order: Order) -> None:
        """Ask."""
        self.made.robot.order(order)


@pytest.fixture
def running() -> Iterator[Running]:
    made = assemble(load_rig("desk"), Choice(mock=True, fast=True, seed=3, scene="face-to-face"))
    made.robot.start(made.clock)
    try:
        running = Running(made)
        running.go(2.0)
        yield running
    finally:
        made.robot.stop()
        made.close()


ORDERS: list[Order] = [
    Ask("lids", "sleepy"),
    LookAt((1.0, 0.2, 0.3)),
    LookAt(None),
    Jog((("neck_yaw", 0.2), ("left_eye_pan", -0.1))),
    Jog(()),
    Stop("a hand"),
    Resume(),
    Tune((("loop.rate_hz", 100.0), ("gaze.saccade.profile", "min_jerk"), ("x", (1, 2)))),
]


@pytest.mark.parametrize("order", ORDERS, ids=str)
def test_orders_cross_processes_as_json(order: Order) -> None:
    import json

    assert from_json(json.loads(json.dumps(as_json(order)))) == order


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (None, "there is ask, look_at"),
        ({"order": "dance"}, "there is ask, look_at"),
        ({"order": "ask", "menu": "lids"}, "takes menu, choice"),
        ({"order": "ask", "menu": "lids", "choice": "sleepy", "x": 1}, "takes menu, choice"),
        ({"order": "ask", "menu": 1, "choice": "sleepy"}, "names"),
        ({"order": "look_at", "p_world_m": [1.0, 2.0]}, "three finite numbers"),
        ({"order": "look_at", "p_world_m": [1.0, nan, 2.0]}, "three finite numbers"),
        ({"order": "look_at", "p_world_m": [1.0, True, 2.0]}, "three finite numbers"),
        ({"order": "jog", "angles_rad": [["nose", 0.1]]}, "known are left_eye_pan"),
        ({"order": "jog", "angles_rad": [["neck_yaw", inf]]}, "finite angle"),
        ({"order": "jog", "angles_rad": "neck"}, "pairs"),
        ({"order": "stop", "why": None}, "text"),
        ({"order": "tune", "changes": [["a", 1, 2]]}, "pairs"),
    ],
)
def test_what_is_no_order_is_refused_with_the_rule(data: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        from_json(data)


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(max_size=8),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(["order", "menu", "choice", "why"]), inner, max_size=3
            )
        ),
        max_leaves=8,
    )
)
def test_rubbish_is_refused_and_nothing_else_happens(data: Any) -> None:
    try:
        order = from_json(data)
    except ValueError:
        return
    check(order)


def test_a_stop_takes_the_torque_off_within_one_tick_and_nothing_moves_after(
    running: Running,
) -> None:
    running.order(Stop("the space bar"))
    ticks = running.go(1.0)
    first = ticks[0]
    assert first.orders == (Stop("the space bar"),) and first.stopped == "the space bar"
    assert not any(ticks[1].joints.torque)
    assert {tick.verdict.level for tick in ticks} == {"limp"}
    assert first.verdict.reasons == ("all: stopped (the space bar)",)
    assert any("torque off" in event for event in first.events)
    later = [tick.joints.position_rad for tick in ticks[20:]]
    assert max(abs(a - b) for p in later for a, b in zip(p, later[0], strict=True)) < 0.02
    # The program goes on: people can see, and resume.
    assert running.count.stopped_by == "seconds"


def test_resume_goes_on_slowly_from_where_the_joints_are(running: Running) -> None:
    running.order(Stop("test"))
    before = running.go(0.5)[-1]
    running.order(Resume())
    ticks = running.go(3.0)
    assert not ticks[0].stopped and all(ticks[2].joints.torque)
    start = ticks[0].verdict.command_rad
    assert start == pytest.approx(before.joints.position_rad, abs=radians(0.5))
    gentle = radians(load_rig("desk").guard.gentle_speed_deg_s)
    for a, b in zip(ticks, ticks[1:100], strict=False):
        for old, new in zip(a.verdict.command_rad, b.verdict.command_rad, strict=True):
            assert abs(new - old) <= gentle * (b.t_s - a.t_s) * 1.01 + 1e-9
    assert ticks[-1].verdict.level in ("ok", "limited")
    assert ticks[-1].target.kind == "face"


def test_a_run_that_ends_stopped_does_not_park(running: Running) -> None:
    running.order(Stop("test"))
    running.go(0.2)
    said: list[str] = []
    leave(running.made, running.count, said.append)
    assert said == ["stopped by seconds: not parked, as it was stopped, torque off"]


def test_a_stop_while_parking_is_obeyed_at_once(running: Running) -> None:
    robot, made = running.made.robot, running.made
    robot.order(Jog((("neck_yaw", radians(50.0)),)))
    running.go(2.0)
    began_s = made.clock.now_s()
    robot.order(LookAt(None))
    robot.order(Stop("a hand"))
    assert not robot.park(made.park_rad, made.clock, made.loop)
    assert made.clock.now_s() - began_s < 0.011
    joints = robot.body.read(made.clock.now_s())
    assert not any(joints.torque) and degrees(joints.position_rad[YAW]) > 45.0


def test_two_stops_are_one_and_a_resume_of_nothing_is_nothing(running: Running) -> None:
    running.order(Resume())
    assert not any("torque" in e for tick in running.go(0.1) for e in tick.events)
    running.order(Stop("one"))
    running.order(Stop("two"))
    tick = running.go(0.1)[0]
    assert sum("stopped" in event for event in tick.events) == 1


def test_the_head_looks_at_a_chosen_point_and_freely_again(running: Running) -> None:
    point = (1.2, 0.6, 0.3)
    running.order(LookAt(point))
    ticks = running.go(2.0)
    assert ticks[0].target.kind == "puppet" and ticks[-1].target.p_world_m == point
    assert ticks[-1].gaze.gaze_point_world_m == pytest.approx(point, abs=0.02)
    assert ticks[-1].verdict.level in ("ok", "limited")
    running.order(LookAt(None))
    assert running.go(1.0)[-1].target.kind == "face"


def test_a_jogged_joint_goes_there_slowly_while_the_others_hold(running: Running) -> None:
    held = running.ticks[-1].verdict.command_rad
    running.order(Jog((("neck_yaw", radians(25.0)),)))
    ticks = running.go(2.0)
    end = ticks[-1].verdict.command_rad
    assert degrees(end[YAW]) == pytest.approx(25.0, abs=0.1)
    assert all(
        abs(a - b) < 1e-3 for i, (a, b) in enumerate(zip(end, held, strict=True)) if i != YAW
    )
    gentle = radians(load_rig("desk").guard.gentle_speed_deg_s)
    steps = [
        abs(b.verdict.command_rad[YAW] - a.verdict.command_rad[YAW]) / (b.t_s - a.t_s)
        for a, b in zip(ticks, ticks[1:], strict=False)
    ]
    assert max(steps) <= gentle * 1.01
    running.order(Jog(()))
    assert running.go(2.0)[-1].target.kind == "face"


def test_a_jog_beyond_the_end_is_limited_and_says_so(running: Running) -> None:
    running.order(Jog((("neck_yaw", pi),)))
    tick = running.go(3.0)[-1]
    joint = load_rig("desk").joints["neck_yaw"]
    assert degrees(tick.verdict.command_rad[YAW]) <= joint.max_deg + 1e-6
    assert tick.verdict.why[YAW] == "out of range"


def test_unknown_menus_are_refused_when_asked(running: Running) -> None:
    with pytest.raises(ValueError, match="there is behaviour, conversation, lids"):
        running.order(Ask("mood", "x"))
    with pytest.raises(ValueError, match="there is awake"):
        running.order(Ask("lids", "x"))

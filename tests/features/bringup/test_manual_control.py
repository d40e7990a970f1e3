"""Moving rigs of every kind slowly by command, over emulated buses in simulated time."""

from collections.abc import Callable, Iterator
from math import degrees, radians
from typing import Any, cast

import pytest
from desk import GAZE_JOINTS
from emulated_rig import EmulatedRig
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.schema import Rig
from gazerig.features.bringup.manual_control import ManualControl, Step
from gazerig.robot.loop.body import Body
from gazerig.robot.model.types import GuardResult, JointAngles, JointState
from gazerig.robot.run.buses import rig_bus
from gazerig.robot.run.rig_limits import limits
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.devices import DynamixelLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

CROOKED = {"neck_yaw": -12.0, "left_eye_pan": 6.0, "neck_pitch": -8.0}


class NotedGuard(Guard):
    """A guard that shows every step."""

    note: Callable[[Step], None]

    def check(
        self, desired_rad: JointAngles, joints: JointState, frame_age_s: float, t_s: float
    ) -> GuardResult:
        result = super().check(desired_rad, joints, frame_age_s, t_s)
        self.note(Step(t_s, desired_rad, result, joints))
        return result


class Bench(EmulatedRig):
    """An emulated rig that is moved by command, and every step of it."""

    def __init__(
        self, rig: Rig, speed_deg_s: float, lines: dict[str, DynamixelLine] | None = None
    ) -> None:
        super().__init__(rig, lines)
        guard = NotedGuard(rig.guard, limits(rig.joints), rig.names)
        guard.note = self.note
        self.steps: list[Step] = []
        self.why: str | None = None
        self.at: dict[float, str] = {}
        self.control = ManualControl(
            Body(rig_bus(rig, self.ports), rig.joints),
            guard,
            self.clock,
            speed_deg_s,
            lambda: self.why,
        )

    def note(self, step: Step) -> None:
        """Keep a step; carry out the fault commands that are due."""
        self.steps.append(step)
        for due_s in [due for due in self.at if due <= step.t_s]:
            self.command(self.at.pop(due_s))

    def torque(self) -> list[bool]:
        return [servo.torque for servo in cast(Any, self.devices[""]).servos]


def crooked(rig: Rig, speed_deg_s: float = 20.0) -> Bench:
    """Return a rig whose joints are not at rest, without its mechanical stops."""
    joints = ((name, rig.joints[name]) for name in rig.names)
    specs = tuple(
        ServoSpec(j.id, j.model, round(j.steps(radians(CROOKED.get(name, 0.0)))))
        for name, j in joints
    )
    return Bench(rig, speed_deg_s, {"": DynamixelLine(specs)})


@pytest.fixture
def bench(desk_rig: Rig) -> Iterator[Bench]:
    made = crooked(desk_rig)
    made.control.start()
    yield made
    made.control.stop()
    assert not any(made.torque())


def test_one_joint_moves_and_the_others_hold(bench):
    before = bench.where()
    moved = bench.control.jog("neck_yaw", 20.0)
    after = bench.where()
    assert moved.arrived
    assert moved.joints["neck_yaw"].measured == pytest.approx(20.0, abs=2.0)
    assert after.pop("neck_yaw") == pytest.approx(20.0, abs=2.0)
    assert moved.joints["neck_yaw"].reasons == ()
    del before["neck_yaw"]
    assert after == pytest.approx(before, abs=0.5)


@settings(max_examples=5, deadline=None)
@given(
    joint=st.sampled_from(["left_eye_pan", "right_upper_lid", "neck_roll"]),
    angle=st.floats(-60.0, 60.0),
    speed=st.floats(5.0, 60.0),
)
def test_no_goal_is_faster_than_asked_nor_outside_the_range(desk_rig, joint, angle, speed):
    bench = crooked(desk_rig, speed)
    bench.control.start()
    moved = bench.control.pose({joint: angle})
    i, params = GAZE_JOINTS.index(joint), desk_rig.joints[joint]
    low, high = radians(params.min_deg), radians(params.max_deg)
    sent = [(s.t_s, s.guard_result.command_rad[i]) for s in bench.steps]
    for (t0, a), (t1, b) in zip(sent, sent[1:], strict=False):
        assert low - 1e-9 <= b <= high + 1e-9
        assert degrees(abs(b - a)) <= 1.1 * speed * (t1 - t0) + 1e-6
    assert moved.arrived == (params.min_deg - 2.0 <= angle <= params.max_deg + 2.0)
    bench.control.stop()


@pytest.mark.parametrize(
    ("fault", "after_s", "reason", "end_reason"),
    [
        ("stick 7", 0.0, "not moving", "held back"),
        ("lose 7", 0.0, "stale joints", "held back"),
        ("overload 7", 0.5, "overload", "torque_off"),
    ],
)
def test_a_joint_that_cannot_is_named_and_not_pushed(bench, fault, after_s, reason, end_reason):
    bench.at[bench.clock.now_s() + after_s] = fault
    before = bench.where()["neck_yaw"]
    moved = bench.control.jog("neck_yaw", 30.0)
    part = moved.joints["neck_yaw"]
    assert not moved.arrived and moved.end_reason == end_reason
    assert any(reason in one for one in part.reasons)
    assert (moved.last.guard_result.level == "torque_off") == (end_reason == "torque_off")
    assert part.commanded == pytest.approx(before, abs=15.0)
    assert bench.where()["neck_yaw"] < 10.0


def test_a_stop_ends_the_way_and_parking_goes_on(bench, desk_rig):
    bench.why = "SIGINT"
    moved = bench.control.jog("neck_yaw", 40.0)
    assert moved.end_reason == "SIGINT" and moved.seconds < 0.1
    assert bench.control.park(desk_rig.park_deg).arrived
    assert bench.where()["neck_pitch"] == pytest.approx(-12.0, abs=2.0)
